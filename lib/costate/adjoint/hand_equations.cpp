#include "costate/adjoint/hand_equations.h"

#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/assembly/packed_state.h"
#include "costate/assembly/slip_directions.h"
#include "costate/level/solved_end.h"

namespace costate {

HandEquations::HandEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                             Objective objective, Stabilization stabilization, Direction direction)
    : assembly_(std::move(mechanism), std::move(parameters)),
      objective_(std::move(objective)),
      level_(assembly_, stabilization),
      velocity_jump_(assembly_, level_),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()),
      A_(0),
      D_(0),
      direction_(direction) {
  running_.resize(assembly_);
  terminal_.resize(assembly_);
}

HandEquations::~HandEquations() = default;

void HandEquations::set_parameters(const double* rho) {
  assembly_.set_parameters(rho);
  start_.reset();
}

const Start& HandEquations::start() {
  if (!start_)
    start_ = std::make_unique<Start>(
        find_start(assembly_, t_start,
                   needs_start_columns(assembly_, direction_ == Direction::backward ? StartDerivative::adjoint
                                                                                    : StartDerivative::columns)));
  return *start_;
}

void HandEquations::add_start_gradient(const double* w_q, const double* w_v, const double* w_z,
                                       Eigen::VectorXd& gradient) {
  const Start& s = start();
  costate::add_start_gradient(assembly_, t_start, s, w_q, w_v, w_z, gradient.data());
}

void HandEquations::add_rows(const std::string& prefix, const std::vector<std::string>& names, bool differential) {
  const int group = groups();
  for (const auto& name : names) {
    group_.push_back(group);
    names_.push_back(prefix + name);
    differential_.push_back(differential ? 1 : 0);
  }
  A_ = BlockMatrix(size());
  D_ = BlockMatrix(size());
}

int HandEquations::place(const SparsePattern& block, int row, int column, bool transposed) {
  D_.place(block, row, column, transposed);
  return A_.place(block, row, column, transposed);
}

void HandEquations::finalize() {
  A_.finalize();
  D_.finalize();
  b_.setZero(size(), columns());
  d_.setZero(size(), columns());
}

void HandEquations::evaluate(double t, const double* qvz) {
  const StateView s = packed_view(t, qvz, n_);
  solve_motion(leads_back_ && !assembly_.has_switched_rows() ? led_back(s) : s);
  running_known_ = false;
  current_ = recalled_ = -1;
  A_.set_zero();
  D_.set_zero();
  b_.setZero();
  d_.setZero();
  fill();
}

StateView HandEquations::led_back(const StateView& s) {
  led_back_.assign(s.q, s.q + 2 * n_ + nz_);
  const StateView r = packed_view(s.t, led_back_.data(), n_);
  // Off by `error`, an entry a row.
  std::vector<double> b(static_cast<std::size_t>(n_ + m_));
  const auto correct = [&](double* x, const double* error) {
    std::fill_n(b.begin(), n_, 0.0);
    std::copy_n(error, m_, b.data() + n_);
    level_.solve_kkt(b.data());
    for (int i = 0; i < n_; ++i) x[i] -= b[static_cast<std::size_t>(i)];
  };
  level_.prepare(r);
  correct(led_back_.data(), assembly_.phi.data());
  level_.prepare(r);
  std::vector<double> rate = assembly_.phi_t;
  level_.add_jacobian(1, r.v, rate.data());
  correct(led_back_.data() + n_, rate.data());
  return r;
}

void HandEquations::solve_motion(const StateView& s) {
  level_.solve(s);
  level_.linearize();
}

void HandEquations::keep(int number) {
  const auto index = static_cast<std::size_t>(number);
  if (kept_.size() <= index) kept_.resize(index + 1);
  Kept& k = kept_[index];
  const StateView s = state();
  k.t = s.t;
  k.values.clear();
  for (const auto& [x, count] : {std::pair{s.q, n_}, {s.v, n_}, {s.z, nz_}, {s.a, n_}, {s.lambda, m_}})
    k.values.insert(k.values.end(), x, x + count);
  if (!integrand_needs_blocks()) k.running = running_gradient();
  current_ = number;
}

void HandEquations::recall(int number) {
  if (number == current_ && recalled_ < 0) return;
  const Kept& k = kept_[static_cast<std::size_t>(number)];
  if (integrand_needs_blocks()) {
    evaluate(k.t, k.values.data());
    current_ = number;
    return;
  }
  running_ = k.running;
  running_known_ = true;
  recalled_ = number;
}

StateView HandEquations::view(const Kept& k) const {
  StateView s;
  s.t = k.t;
  s.q = k.values.data();
  s.v = s.q + n_;
  s.z = s.v + n_;
  s.a = s.z + nz_;
  s.lambda = s.a + n_;
  return s;
}

std::vector<double> HandEquations::plan(const std::vector<double>&, const Motion&) { return {}; }

bool HandEquations::before_step(double, double, const double*, Eigen::MatrixXd&, Eigen::VectorXd&) { return false; }

void HandEquations::go_to_slips() {
  if (recalled_ < 0) return;
  const StateView s = state();
  assembly_.switch_rows(s.z);
  if (slips_in_space(assembly_)) assembly_.calc_jacobian(s);
}

const ScalarGradient& HandEquations::running_gradient() {
  if (!running_known_) {
    running_.set_zero();
    objective_.add_running_gradient(state(), assembly_, running_);
    running_known_ = true;
  }
  return running_;
}

const ScalarGradient& HandEquations::terminal_gradient() {
  terminal_.set_zero();
  objective_.add_terminal_gradient(state(), assembly_, terminal_);
  return terminal_;
}

const Assembly::ParameterColumns& HandEquations::parameter_columns() {
  assembly_.calc_parameter_columns(state(), columns_);
  return columns_;
}

void HandEquations::eliminate_terminal(Eigen::VectorXd& wq, Eigen::VectorXd& wv, Eigen::VectorXd& wz,
                                       Eigen::VectorXd& gradient) {
  terminal_gradient();
  ScalarGradient& w = terminal_;
  gradient += w.rho;
  if (objective_.terminal_needs_accelerations()) eliminate_at_end(level_, assembly_, state(), w, 1, gradient.data());
  wq = w.q;
  wv = w.v;
  wz = w.z;
}

void HandEquations::solve_tangent_accelerations(const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv,
                                                const Eigen::MatrixXd& Sz, Eigen::MatrixXd& Sa, Eigen::MatrixXd& Sl) {
  Eigen::MatrixXd S(2 * n_ + nz_, assembly_.np()), x(n_ + m_, assembly_.np());
  S << Sq, Sv, Sz;
  std::vector<const double*> columns;
  for (int j = 0; j < assembly_.np(); ++j) columns.push_back(S.col(j).data());
  level_.solve_tangent(columns.data(), assembly_.np(), &parameter_columns(), x.data());
  Sa = x.topRows(n_);
  Sl = x.bottomRows(m_);
}

namespace {
Eigen::VectorXd along(const ScalarGradient& g, const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv,
                      const Eigen::MatrixXd& Sz, const Eigen::MatrixXd& Sa, const Eigen::MatrixXd& Sl) {
  return g.rho + Sq.transpose() * g.q + Sv.transpose() * g.v + Sz.transpose() * g.z + Sa.transpose() * g.a +
         Sl.transpose() * g.lambda;
}
}  // namespace

void HandEquations::add_terminal_tangent(const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv,
                                         const Eigen::MatrixXd& Sz, const Eigen::MatrixXd& Sa,
                                         const Eigen::MatrixXd& Sl, Eigen::VectorXd& gradient) {
  gradient += along(terminal_gradient(), Sq, Sv, Sz, Sa, Sl);
}

void HandEquations::add_running_tangent(const Eigen::MatrixXd& Sq, const Eigen::MatrixXd& Sv, const Eigen::MatrixXd& Sz,
                                        const Eigen::MatrixXd& Sa, const Eigen::MatrixXd& Sl, Eigen::VectorXd& out) {
  out = along(running_gradient(), Sq, Sv, Sz, Sa, Sl);
}

}  // namespace costate
