// A candidate adjoint that misbehaves in the way that the environment variable COSTATE_SPOIL names, for test/cli.
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>

#include "costate/candidate/candidate.h"

namespace {

using costate::AdjointBlocks;

bool spoil(const char* how) {
  const char* s = std::getenv("COSTATE_SPOIL");
  return s && std::string(s) == how;
}

/// Processes that leave the candidate's group and its session, told by their ids; then it never ends itself.
void leave_family() {
  for (int i = 0; i < 2; ++i)
    if (::fork() == 0) {
      if (i == 1) ::setsid();
      if (i == 1 && ::fork() != 0) ::_exit(0);
      if (std::FILE* file = std::fopen(std::getenv("COSTATE_SPOIL_FILE"), "a")) {
        std::fprintf(file, "%d\n", static_cast<int>(::getpid()));
        std::fclose(file);
      }
      while (true) ::pause();
    }
  while (true) ::pause();
}

/// Writes without end into every pipe that is open.
void flood() {
  static char zeros[1 << 16] = {};
  while (true)
    for (int fd = 3; fd < 64; ++fd) {
      struct stat status {};
      if (::fstat(fd, &status) == 0 && S_ISFIFO(status.st_mode) && ::write(fd, zeros, sizeof zeros) < 0) continue;
    }
}

class Spoiled final : public costate::CandidateAdjoint {
 public:
  std::string formulation() const override { return spoil("formulation") ? "lagrange-of-the-third-kind" : "baumgarte"; }
  Vector rhs(const AdjointBlocks& b, const Vector& mu) const override {
    if (spoil("crash")) std::raise(SIGSEGV);
    if (spoil("throw")) throw std::runtime_error("no idea");
    if (spoil("exit")) std::exit(0);
    if (spoil("print")) std::puts("printed by the candidate");
    if (spoil("size")) return Vector::Zero(1);
    if (spoil("quadratic")) return mu.cwiseProduct(mu);
    while (spoil("hang")) {
    }
    if (spoil("close")) {
      for (int fd = 0; fd < 1024; ++fd) ::close(fd);
      while (true) {
      }
    }
    if (spoil("family")) leave_family();
    if (spoil("flood")) flood();
    const Vector s = b.solve_kkt(mu.segment(b.n, b.n) + b.g_a, b.g_lambda), s1 = s.head(b.n), s2 = s.tail(b.m);
    Vector r(mu.size());
    r << -b.g_q + b.K.transpose() * s1 + b.R2_q.transpose() * s2 - b.f_q.transpose() * mu.tail(b.nz),
        -b.g_v - mu.head(b.n) + b.C.transpose() * s1 + b.R2_v.transpose() * s2 - b.f_v.transpose() * mu.tail(b.nz),
        -b.g_z - b.Q_z.transpose() * s1 - b.f_z.transpose() * mu.tail(b.nz);
    if (spoil("term")) r.head(b.n) -= b.Phi_lambda_q.transpose() * s1;
    if (spoil("nan")) r[0] = std::numeric_limits<double>::quiet_NaN();
    return r;
  }
  void terminal(const AdjointBlocks& b, Vector& mu, Vector& gradient) const override {
    mu << b.w_q, b.w_v, b.w_z;
    gradient += b.w_rho;
  }
  Vector integrand(const AdjointBlocks& b, const Vector& mu) const override {
    const Vector s = b.solve_kkt(mu.segment(b.n, b.n) + b.g_a, b.g_lambda);
    return b.g_rho - b.F_rho.transpose() * s.head(b.n) - b.R2_rho.transpose() * s.tail(b.m) +
           b.f_rho.transpose() * mu.tail(b.nz);
  }
};

}  // namespace

extern "C" __attribute__((visibility("default"))) void costate_candidate_build(costate::CandidateBuild* b) {
  *b = costate::CandidateBuild{};
  if (spoil("abi")) b->abi = -1;
}
extern "C" __attribute__((visibility("default"))) costate::CandidateAdjoint* costate_candidate_make() {
  return new Spoiled;
}
