#include "costate/event/step_motion.h"

#include <algorithm>
#include <cmath>

namespace costate {

namespace {
// Of what a coordinate travels within the step, no more than this of an angle: what the cubic may be off by.
constexpr double kOffMotion = 1e-2, kMostAngle = 1;
constexpr int kMotionDepth = 5;
// The angle that a unit direction turns by while one of its components, or an Euler parameter, changes by one: at least
// one of three or four components takes its share.
constexpr double kAnglePerComponent = 3;

double angle_per_unit(const Coordinate& c) { return c.unit == "rad" ? 1 : c.unit == "1" ? kAnglePerComponent : 0; }
}  // namespace

double turning_speed(const Mechanism& mechanism, const std::vector<int>* coordinates, const double* v) {
  double most = 0;
  const auto meet = [&](std::size_t i) {
    if (const double angle = angle_per_unit(mechanism.coordinates()[i]); angle > 0)
      most = std::max(most, angle * std::abs(v[i]));
  };
  if (coordinates)
    for (const int i : *coordinates) meet(static_cast<std::size_t>(i));
  else
    for (std::size_t i = 0; i < mechanism.coordinates().size(); ++i) meet(i);
  return most;
}

StepMotion::StepMotion(const Mechanism& mechanism, double rtol, double atol)
    : mechanism_(mechanism),
      n_(mechanism.coordinates().size()),
      nz_(static_cast<std::size_t>(mechanism.state_count())),
      rtol_(rtol),
      atol_(atol),
      q_(n_),
      v_(n_),
      z_(nz_) {
  for (const Coordinate& c : mechanism.coordinates()) angle_per_unit_.push_back(angle_per_unit(c));
  here_.q = q_.data();
  here_.v = v_.data();
  here_.z = z_.data();
}

std::size_t StepMotion::add(double u, const StateView& s) {
  if (node_count_ == nodes_.size()) nodes_.emplace_back();
  Node& node = nodes_[node_count_];
  node.u = u;
  node.q.assign(s.q, s.q + n_);
  node.v.assign(s.v, s.v + n_);
  node.z.assign(s.z, s.z + nz_);
  return node_count_++;
}

void StepMotion::take(double from, double to, const GapTrace::States& at) {
  const bool goes_on = node_count_ > 1 && from == to_, again = node_count_ > 1 && from == from_;
  if (goes_on) std::swap(nodes_[0], nodes_[1]);
  node_count_ = goes_on || again ? 1 : 0;
  piece_count_ = 0;
  from_ = from;
  to_ = to;
  if (node_count_ == 0) add(0, at(from));
  nodes_[0].u = 0;
  divide(0, add(1, at(to)), 0, at);
}

void StepMotion::divide(std::size_t begin, std::size_t end, int depth, const GapTrace::States& at) {
  const double u = 0.5 * (nodes_[begin].u + nodes_[end].u);
  const std::size_t middle = add(u, at(from_ + u * (to_ - from_)));
  if (depth < kMotionDepth && !is_smooth(nodes_[begin], nodes_[middle], nodes_[end])) {
    divide(begin, middle, depth + 1, at);
    divide(middle, end, depth + 1, at);
    return;
  }
  if (piece_count_ == pieces_.size()) pieces_.emplace_back();
  Piece& piece = pieces_[piece_count_++];
  piece.begin = begin;
  piece.middle = middle;
  piece.end = end;
  fit(piece);
}

bool StepMotion::is_smooth(const Node& a, const Node& m, const Node& b) const {
  const double h = (b.u - a.u) * (to_ - from_);
  const Node &first = nodes_[0], &last = nodes_[1];
  for (std::size_t i = 0; i < n_; ++i) {
    const double off = std::abs(m.q[i] - 0.5 * (a.q[i] + b.q[i]) - h / 8 * (a.v[i] - b.v[i]));
    double way = std::max({std::abs(last.q[i] - first.q[i]), std::abs(m.q[i] - a.q[i]), std::abs(b.q[i] - m.q[i])});
    if (angle_per_unit_[i] > 0) way = std::min(way, kMostAngle / angle_per_unit_[i]);
    if (off > kOffMotion * way + tolerance(m.q[i])) return false;
  }
  return true;
}

void StepMotion::fit(Piece& piece) const {
  const Node &a = nodes_[piece.begin], &m = nodes_[piece.middle], &b = nodes_[piece.end];
  const double h = (b.u - a.u) * (to_ - from_);
  piece.c.resize(11 * n_ + 3 * nz_);
  double* c = piece.c.data();
  for (std::size_t i = 0; i < n_; ++i, c += 11) {
    const double v1 = 4 * m.v[i] - 3 * a.v[i] - b.v[i], v2 = 2 * (a.v[i] + b.v[i] - 2 * m.v[i]);
    // By how much the parabola's integral misses the positions in the middle and at the end.
    const double e1 = m.q[i] - a.q[i] - h * (0.5 * a.v[i] + v1 / 8 + v2 / 24);
    const double e2 = b.q[i] - a.q[i] - h * (a.v[i] + v1 / 2 + v2 / 3);
    const double noise = tolerance(std::max(std::abs(a.q[i]), std::abs(b.q[i])));
    if (std::abs(e1) <= noise && std::abs(e2) <= noise) {
      const double only[] = {
          a.q[i], 4 * m.q[i] - 3 * a.q[i] - b.q[i], 2 * (a.q[i] + b.q[i] - 2 * m.q[i]), 0, 0, 0, a.v[i], v1, v2, 0, 0};
      std::copy(std::begin(only), std::end(only), c);
      continue;
    }
    // e1 16 s^2 (1 - s)^2 + e2 s^2 (2 s - 1)^2 (7 - 6 s)
    const double d2 = 16 * e1 + 7 * e2, d3 = -32 * e1 - 34 * e2, d4 = 16 * e1 + 52 * e2, d5 = -24 * e2;
    const double both[] = {a.q[i], h * a.v[i],      h * v1 / 2 + d2, h * v2 / 3 + d3, d4,        d5,
                           a.v[i], v1 + 2 * d2 / h, v2 + 3 * d3 / h, 4 * d4 / h,      5 * d5 / h};
    std::copy(std::begin(both), std::end(both), c);
  }
  for (std::size_t i = 0; i < nz_; ++i, c += 3) {
    c[0] = a.z[i];
    c[1] = 4 * m.z[i] - 3 * a.z[i] - b.z[i];
    c[2] = 2 * (a.z[i] + b.z[i] - 2 * m.z[i]);
  }
}

const StateView& StepMotion::at(double u, const std::vector<int>& coordinates) {
  std::size_t k = 0;
  while (k + 1 < piece_count_ && u > nodes_[pieces_[k].end].u) ++k;
  const Piece& piece = pieces_[k];
  const double u0 = nodes_[piece.begin].u, s = (u - u0) / (nodes_[piece.end].u - u0);
  for (const int k_of : coordinates) {
    const auto i = static_cast<std::size_t>(k_of);
    const double* c = piece.c.data() + 11 * i;
    q_[i] = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))));
    v_[i] = c[6] + s * (c[7] + s * (c[8] + s * (c[9] + s * c[10])));
  }
  const double* c = piece.c.data() + 11 * n_;
  for (std::size_t i = 0; i < nz_; ++i, c += 3) z_[i] = c[0] + s * (c[1] + s * c[2]);
  here_.t = u < 1 ? from_ + u * (to_ - from_) : to_;
  return here_;
}

double StepMotion::turn(const std::vector<int>& coordinates) const {
  double most = 0;
  for (std::size_t k = 0; k < node_count_; ++k)
    most = std::max(most, turning_speed(mechanism_, &coordinates, nodes_[k].v.data()));
  return most * (to_ - from_);
}

double StepMotion::size(const std::vector<int>& coordinates) const {
  double most = 0;
  for (std::size_t k = 0; k < node_count_; ++k)
    for (const int i : coordinates) {
      const auto c = static_cast<std::size_t>(i);
      most = std::max({most, std::abs(nodes_[k].q[c]), std::abs(nodes_[k].v[c])});
    }
  return most;
}

}  // namespace costate
