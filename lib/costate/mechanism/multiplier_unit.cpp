#include "costate/mechanism/multiplier_unit.h"

#include <cmath>
#include <optional>

namespace costate {

namespace {

/// The power of a length in a number's unit, which its key names: "point.P.x_m", "screw.S.lead_m_per_turn".
int length_power(const std::string& path) {
  std::string key = path.substr(path.rfind('.') + 1);
  key = key.substr(0, key.find('['));
  const std::string unit = key.substr(0, key.find("_per_"));
  if (unit.ends_with("_m")) return 1;
  return unit.ends_with("_m2") ? 2 : 0;
}

/// Phi_q of a constraint somewhere, all lengths `scale` times as large.
Eigen::MatrixXd jacobian_at(const Mechanism& m, const Constraint& c, double scale) {
  std::vector<double> q, p;
  const std::vector<double> rest(c.coordinates().size(), 0.0);
  for (const int k : c.coordinates()) {
    const double somewhere = 0.3 + 0.11 * static_cast<double>(q.size() * 7 % 10);
    q.push_back(m.coordinates()[static_cast<std::size_t>(k)].unit == "m" ? scale * somewhere : somewhere);
  }
  for (const int k : c.numbers()) {
    const Number& n = m.numbers()[static_cast<std::size_t>(k)];
    p.push_back(n.value * std::pow(scale, length_power(n.path)));
  }
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(c.rows(), static_cast<Eigen::Index>(q.size()));
  const LocalState s{0.37, q.data(), rest.data(), rest.data(), nullptr, nullptr, p.data()};
  LocalMatrix block(J.data(), J.rows(), J.cols());
  c.calc_phi_q(s, block);
  return J;
}

std::string unit_of(int length_power) {
  switch (length_power) {
    case 1:
      return "N m";
    case 0:
      return "N";
    case -1:
      return "N/m";
    default:
      return "";
  }
}

}  // namespace

std::vector<std::string> multiplier_units(const Mechanism& m) {
  std::vector<std::string> units;
  for (const auto& c : m.constraints()) {
    const Eigen::MatrixXd once = jacobian_at(m, *c, 1), twice = jacobian_at(m, *c, 2);
    for (Eigen::Index i = 0; i < once.rows(); ++i) {
      std::optional<int> power;
      bool one = true;
      for (Eigen::Index j = 0; j < once.cols(); ++j) {
        const double ratio = twice(i, j) / once(i, j);
        if (!(std::abs(once(i, j)) > 1e-12) || !(ratio > 0)) continue;
        const double exponent = std::log2(ratio);
        const bool length =
            m.coordinates()[static_cast<std::size_t>(c->coordinates()[static_cast<std::size_t>(j)])].unit == "m";
        const int here = (length ? 0 : 1) - static_cast<int>(std::lround(exponent));
        one = one && std::abs(exponent - std::round(exponent)) < 1e-6 && (!power || *power == here);
        power = here;
      }
      units.push_back(one && power ? unit_of(*power) : "");
    }
  }
  return units;
}

std::vector<std::string> state_units(const Mechanism& m) {
  std::vector<std::string> units;
  for (const auto& f : m.forces())
    for (int i = 0; i < f->states(); ++i) units.push_back(f->state_unit(i));
  return units;
}

}  // namespace costate
