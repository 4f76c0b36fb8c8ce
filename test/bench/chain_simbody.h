// The chains of chain.h in Simbody, whose headers are C++17: of the library nothing is included here.
#pragma once

#include <memory>
#include <string>

namespace costate::bench {

struct SimbodyRun {
  double psi = 0;
  long steps = 0;
};
/// The chains in Simbody; only where COSTATE_BENCH_SIMBODY is defined.
class SimbodyChain {
 public:
  SimbodyChain(int bars, bool spatial);
  ~SimbodyChain();
  /// By "merson" or "feldberg", of order 4 and 5. (Its CPodes holds vectors of an old SUNDIALS under the names of those
  /// that this program is linked with, and cannot be run beside them.)
  SimbodyRun run(double accuracy, const std::string& integrator, double t_end) const;

 private:
  struct Model;
  std::unique_ptr<Model> model_;
};

}  // namespace costate::bench
