#include "costate/kind/tyre/tyre_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"

namespace costate {

namespace {
std::vector<TyreModelKind>& registry() {
  static std::vector<TyreModelKind> models;
  return models;
}
}  // namespace

RegisterTyreModel::RegisterTyreModel(TyreModelKind kind) { registry().push_back(std::move(kind)); }

std::vector<std::string> tyre_model_names() {
  std::vector<std::string> names;
  for (const auto& m : registry()) names.push_back(m.name);
  std::sort(names.begin(), names.end());
  return names;
}

const TyreModelKind& find_tyre_model(const std::string& name) {
  return *std::find_if(registry().begin(), registry().end(), [&](const auto& m) { return m.name == name; });
}

TyreOptions read_tyre(SceneTable& table, const MechanismBuilder& builder, const TyreOptions& usual) {
  const auto given = [](double x) { return x > 0 ? std::optional<double>(x) : std::nullopt; };
  TyreOptions o;
  o.wheel = table.text("wheel");
  o.road = table.text("road");
  if (table.has("axis")) {
    const auto axis = table.values("axis");
    if (axis.size() != 3) table.fail("axis", fmt::format("must hold x, y, z, found {} numbers.", axis.size()));
    std::copy(axis.begin(), axis.end(), o.axis.begin());
  }
  o.spin = table.text("spin", "");
  o.radius_m = table.value("radius_m", NumberRule::positive, given(usual.radius_m));
  o.stiffness_N_per_m = table.value("stiffness_N_per_m", NumberRule::non_negative, given(usual.stiffness_N_per_m));
  o.damping_N_s_per_m = table.value("damping_N_s_per_m", NumberRule::non_negative, usual.damping_N_s_per_m);
  o.damping_ramp_m = table.value("damping_ramp_m", NumberRule::non_negative, o.damping_ramp_m);
  o.road_factor = table.value("road_factor", NumberRule::any, 1);
  const auto road = find_road(builder, table.path("road"), o.road);
  const bool post = road->kind() == Road::Kind::post;
  if (table.has(post ? "road_offset_m" : "road_delay_s"))
    table.fail(post ? "road_offset_m" : "road_delay_s",
               post ? fmt::format("belongs to a profile, but road '{}' is a post: give road_delay_s.", o.road)
                    : fmt::format("belongs to a post, but road '{}' is none: give road_offset_m.", o.road));
  o.road_shift = table.value(post ? "road_delay_s" : "road_offset_m", NumberRule::any, 0);
  const std::string contact = table.one_of("contact", {"disc", "source", "vertical"}, "disc");
  o.contact = contact == "disc" ? TyreContact::disc : contact == "source" ? TyreContact::source : TyreContact::vertical;
  return o;
}

TyreSlipOptions read_tyre_slip(SceneTable& table) {
  TyreSlipOptions o;
  o.slip_speed_m_per_s = table.value("slip_speed_m_per_s", NumberRule::non_negative, o.slip_speed_m_per_s);
  o.relaxation_length_m = table.find_value("relaxation_length_m", NumberRule::positive).value_or(0);
  if (o.relaxation_length_m > 0) o.initial_slip = table.value("initial_slip", NumberRule::any, 0);
  return o;
}

std::vector<int> add_tyre_slip(MechanismBuilder& builder, const std::string& name, const TyreSlipOptions& o,
                               TyreSlip& slip) {
  const std::string path = "tyre." + name + ".";
  slip.lags = o.relaxation_length_m > 0;
  std::vector<int> numbers = {
      builder.add_number(path + "slip_speed_m_per_s", o.slip_speed_m_per_s, NumberRule::non_negative)};
  if (!slip.lags) return numbers;
  numbers.push_back(builder.add_number(path + "relaxation_length_m", o.relaxation_length_m, NumberRule::positive));
  numbers.push_back(builder.add_number(path + "initial_slip", o.initial_slip));
  return numbers;
}

TyreParts add_tyre_parts(MechanismBuilder& builder, const std::string& name, const TyreOptions& o) {
  const std::string path = "tyre." + name + ".";
  if (!builder.has_spatial_point(o.wheel))
    throw ModelError(path + "wheel", fmt::format("There is no point '{}' in space. A wheel's centre is a point on a "
                                                 "rigid body: [point.{}] with on = \"BODY\" and z_m.",
                                                 o.wheel, o.wheel));
  const SpatialPoint& wheel = builder.spatial_point(o.wheel);
  if (wheel.kind() != SpatialPoint::Kind::on_body)
    throw ModelError(
        path + "wheel",
        fmt::format("'{}' is not fixed to a rigid body, as a wheel's centre must be. ([rigid_body]: bodies "
                    "in natural coordinates carry no tyre.)",
                    o.wheel));
  if (o.axis[0] == 0 && o.axis[1] == 0 && o.axis[2] == 0) throw ModelError(path + "axis", "The axis must not be zero.");
  TyreParts parts{{find_road(builder, path + "road", o.road), o.contact, o.bilateral, !o.spin.empty()}, wheel, {}, {}};
  if (!o.spin.empty()) {
    parts.spin = {find_coordinate(builder, path + "spin", o.spin)};
    const auto& q = wheel.coordinates();
    if (std::find(q.begin(), q.end(), parts.spin[0]) != q.end())
      throw ModelError(path + "spin", fmt::format("'{}' belongs to the wheel's own body; a spin is a coordinate of its "
                                                  "own, relative to the body. Without one, the body itself spins.",
                                                  o.spin));
  }
  const auto number = [&](const std::string& key, double value, NumberRule rule = NumberRule::non_negative) {
    parts.numbers.push_back(builder.add_number(path + key, value, rule));
  };
  for (std::size_t i = 0; i < 3; ++i) number(fmt::format("axis[{}]", i), o.axis[i], NumberRule::any);
  number("radius_m", o.radius_m, NumberRule::positive);
  number("stiffness_N_per_m", o.stiffness_N_per_m);
  number("damping_N_s_per_m", o.damping_N_s_per_m);
  number("damping_ramp_m", o.damping_ramp_m);
  number("road_factor", o.road_factor, NumberRule::any);
  const bool post = parts.setup.road->kind() == Road::Kind::post;
  number(post ? "road_delay_s" : "road_offset_m", o.road_shift, NumberRule::any);
  return parts;
}

}  // namespace costate
