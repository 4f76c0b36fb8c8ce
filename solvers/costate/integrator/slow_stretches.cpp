#include "costate/integrator/slow_stretches.h"

#include <Eigen/Core>
#include <algorithm>

#include "costate/assembly/packed_state.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"

namespace costate {

namespace {
// Of the largest |w| of a slip: below it is slow, and above no longer.
constexpr double kSlowPart = 1e-2, kFastPart = 2e-2;
// Of the error of velocities: an adjoint loses the square of that, with a step.
constexpr double kAboveErrors = 1e3;
// Speeds of a slip from rest that are kept apart.
constexpr double kFaster = 2;
}  // namespace

void SlowStretches::look(double t, const double* y, const double* yp, Point& at) {
  const int n = system_.assembly().n(), nz = system_.assembly().nz(), size = system_.size();
  const StateView s = system_.look_state(t, y);
  at.t = t;
  at.mode = system_.mode();
  at.slowest = system_.slowest_in_space(s);
  at.y.clear();
  at.qvz.clear();
  at.z.assign(s.z, s.z + nz);
  if (!(at.slowest.part < 2)) return;  // nothing slides in space
  at.y.assign(y, y + size);
  at.yp.assign(yp ? yp : y, yp ? yp + size : y);
  at.qvz = packed(s, n, nz);
  at.error = rtol_ * Eigen::Map<const Eigen::VectorXd>(s.v, n).cwiseAbs().maxCoeff() + atol_;
}

void SlowStretches::open(const Point& at) {
  goes_on_ = true;
  Stretch& s = all_.emplace_back();
  s.session = session_;
  s.begin = at.t;
  s.mode = at.mode;
  s.y = at.y;
  s.yp = at.yp;
  s.before = at.qvz;
}

void SlowStretches::close(double t, const double* y_after, const Point& after) {
  goes_on_ = false;
  Stretch& s = all_.back();
  s.end = t;
  s.mode_after = after.mode;
  s.y_after.assign(y_after, y_after + system_.size());
  s.after = after.qvz;
}

void SlowStretches::open_from_rest(const Point& at) {
  open(at);
  all_.back().from_rest = true;
  faster_.clear();
  fastest_ = 0;
}

bool SlowStretches::finish_from_rest(double t, const double* y, const Point& here) {
  const auto end = std::find_if(faster_.begin(), faster_.end(), [&](const Point& p) {
    return p.slowest.speed > kFastPart * fastest_ && p.slowest.speed > kAboveErrors * p.error;
  });
  const bool found = end != faster_.end() && end->t <= t;
  if (found)
    close(end->t, end->y.data(), *end);
  else
    close(t, y, here);
  return found;
}

void SlowStretches::begin(std::size_t session, double t, const double* y, const double* yp) {
  if (!possible_) return;
  session_ = session;
  std::vector<double> z_before = std::move(now_.z);
  look(t, y, yp, now_);
  z_before.resize(now_.z.size(), 0);
  previous_ = last_ = now_;
  if (now_.qvz.empty()) return;
  if (begins_slip_from_rest(system_.assembly().mechanism(), z_before.data(), now_.z.data()))
    open_from_rest(now_);
  else if (now_.slowest.part < kSlowPart)
    open(now_);
}

void SlowStretches::step(double t, const double* y, const double* yp) {
  if (!possible_) return;
  look(t, y, yp, now_);
  const double part = now_.slowest.part;
  const bool rested = from_rest();
  if (rested) {
    fastest_ = std::max(fastest_, now_.slowest.speed);
    if (part < kSlowPart)
      finish_from_rest(last_.t, last_.y.data(), last_);
    else if (faster_.empty() || now_.slowest.speed > kFaster * faster_.back().slowest.speed)
      faster_.push_back(now_);
  }
  if (!goes_on_ && part < kSlowPart) open(last_);
  if (goes_on_ && !rested && part > kFastPart) close(t, y, now_);
  if (goes_on_ && !rested) return;
  previous_ = std::move(last_);
  last_ = now_;
}

void SlowStretches::part(double t, const double* y, const double* yp) {
  if (!possible_) return;
  const auto over = [&](const Stretch& s) { return s.session == session_ && s.begin < t && t < s.end; };
  const bool beyond = !all_.empty() && !goes_on_ && over(all_.back());
  if (!goes_on_ && !beyond) return;
  Point here;
  look(t, y, yp, here);
  if (here.qvz.empty()) return;
  if (from_rest()) {
    if (finish_from_rest(t, y, here)) return;
    std::vector<Point> later = std::move(faster_);
    std::erase_if(later, [&](const Point& p) { return p.t <= t; });
    open_from_rest(here);
    faster_ = std::move(later);
    return;
  }
  const Stretch whole = all_.back();
  close(t, y, here);
  open(here);
  if (!beyond) return;
  goes_on_ = false;
  Stretch& rest = all_.back();
  rest.end = whole.end;
  rest.mode_after = whole.mode_after;
  rest.y_after = whole.y_after;
  rest.after = whole.after;
}

void SlowStretches::jump(const Jump& jump, double t_after, const double* y_after, const double* yp_after) {
  if (!possible_) return;
  const bool rested = from_rest(), rests = rested && !finish_from_rest(jump.t, jump.y.data(), now_);
  // The step that has ended with the jump's state is the last one that was looked at.
  const bool stops = jump.event >= 0 && !now_.qvz.empty() && now_.t == jump.t &&
                     system_.stops_slip(jump.event, now_.qvz.data() + 2 * system_.assembly().n());
  const bool before = !previous_.qvz.empty() && !(rested && previous_.t < all_.back().end);
  if (stops && !goes_on_) open(before ? previous_ : now_);
  if (stops) {
    all_.back().last_speed = now_.slowest.speed;
    all_.back().stop = jump.event;
    Point after;
    const int n = system_.assembly().n(), nz = system_.assembly().nz();
    after.qvz = packed(system_.look_state(t_after, y_after), n, nz);
    after.mode = system_.mode();
    close(jump.t, y_after, after);
  } else if (goes_on_) {
    close(jump.t, jump.y.data(), now_);
  }
  begin(session_ + 1, t_after, y_after, yp_after);
  if (rests && !goes_on_ && !now_.qvz.empty()) open_from_rest(now_);
}

void SlowStretches::end(double t, const double* y) {
  if (!goes_on_) return;
  Point here;
  look(t, y, nullptr, here);
  if (from_rest())
    finish_from_rest(t, y, here);
  else
    close(t, y, here);
}

void SlowStretches::leave_out_long_ones(double rtol) {
  for (std::size_t i = all_.size(); i-- > 0;)
    if (all_[i].from_rest) try {
        map(i, rtol);
      } catch (const CapabilityError&) {
        all_.erase(all_.begin() + static_cast<std::ptrdiff_t>(i));
      }
}

const StretchMap& SlowStretches::map(std::size_t i, double rtol) {
  Stretch& s = all_[i];
  if (!s.map) {
    const auto solve = [&](bool redundant) {
      if (!slip_)
        slip_ = std::make_unique<SlowSlip>(system_.assembly(), system_.objective(), system_.event_history(), redundant);
      s.map = std::make_shared<const StretchMap>(slip_->map(s, rtol));
    };
    try {
      solve(false);
    } catch (const SolverError&) {  // a singular matrix
      slip_.reset();
      solve(true);
    }
  }
  return *s.map;
}

}  // namespace costate
