#include "costate/kind/tyre/magic_formula.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <set>
#include <sstream>

#include "costate/base/error.h"
#include "costate/base/letters.h"
#include "costate/base/notice.h"
#include "costate/element/force/magic_formula.h"
#include "costate/kind/tyre/tir_file.h"
#include "costate/kind/tyre/tyre_parts.h"
#include "costate/scene/scene_files.h"

namespace costate {

const std::vector<MagicFormula::Entry>& MagicFormula::coefficients() {
  static const std::vector<Entry> all = [] {
    std::vector<Entry> list;
    std::istringstream words(names);
    for (std::string name; words >> name;) {
      if (name.back() == ',') name.pop_back();
      list.push_back({name, name[0] == 'L' ? 1.0 : 0.0});
      if (name == "LONGVL") list.back().usual = 16.7;  // m/s, reference of the rolling resistance
      if (name == "PKY4") list.back().usual = 2;       // what 5.2 has in its place
    }
    return list;
  }();
  return all;
}

namespace {

/// Throws where the relaxation lengths lack coefficients.
void require_relaxation(const std::string& path, const MagicFormulaOptions& o) {
  std::vector<const char*> needed = {"PTY1", "PTY2"};
  if (!o.free_rolling) needed.insert(needed.begin(), {"PTX1", "PTX2", "PTX3"});
  std::string missing;
  for (const char* key : needed)
    if (!o.coefficients.count(key)) missing += (missing.empty() ? "" : ", ") + std::string(key);
  if (!missing.empty())
    throw ModelError(
        path + "relaxation",
        fmt::format("\"coefficients\" needs {}, which {}. Write what is missing into magic_formula = {{ ... }}, "
                    "or give numbers: relaxation_length_m{}.",
                    missing,
                    o.tir_file.empty() ? "'magic_formula' does not give"
                                       : fmt::format("neither {} nor 'magic_formula' gives", o.tir_file),
                    o.free_rolling ? "" : " and longitudinal_relaxation_length_m"));
  for (const char* key : {"PTX1", "PTY1", "PTY2"}) {
    const auto at = o.coefficients.find(key);
    if (at != o.coefficients.end() && !(at->second > 0) && (key[2] == 'Y' || !o.free_rolling))
      throw ModelError(path + "relaxation",
                       fmt::format("\"coefficients\" needs a positive {}, found {}: the relaxation length at "
                                   "the nominal load grows with it.",
                                   key, at->second));
  }
}

}  // namespace

namespace {

/// Why a coefficient cannot have this value, or null. Offsets and shapes may be negative, these not.
const char* nonsense(const std::string& name, double x) {
  for (const char* positive : {"UNLOADED_RADIUS", "FNOMIN", "LFZO", "NOMPRES"})
    if (name == positive && !(x > 0)) return "must be positive";
  for (const char* scale : {"LMUX", "LMUY", "LKX", "LKY", "LCX", "LCY", "VERTICAL_STIFFNESS", "VERTICAL_DAMPING"})
    if (name == scale && !(x >= 0)) return "must not be negative";
  return nullptr;
}

/// PDX of PDX1, or nothing.
std::string family_of(const std::string& name) {
  const std::size_t digits = name.find_last_not_of("0123456789") + 1;
  return digits < name.size() ? name.substr(0, digits) : "";
}

/// MF-Tyre 6.1's radial force and radius beyond VERTICAL_STIFFNESS, BREFF, DREFF and FREFF.
constexpr const char* kOfLoad[] = {"Q_V1",   "Q_V2",   "Q_FZ2",  "Q_FCX",  "Q_FCY",  "Q_FCY2", "Q_CAM",
                                   "Q_CAM1", "Q_CAM2", "Q_CAM3", "Q_FYS1", "Q_FYS2", "Q_FYS3", "PFZ1"};

/// Of a file's numbers those that coefficients of the equations may have been meant by, and those of their families
/// and of the radial force which the equations do not have.
void tell_left_out(const TirFile& file, const std::string& path) {
  std::set<std::string> known, families, left(std::begin(kOfLoad), std::end(kOfLoad));
  for (const auto& entry : MagicFormula::coefficients()) {
    known.insert(entry.name);
    if (const std::string family = family_of(entry.name); !family.empty()) families.insert(family);
  }
  std::vector<std::string> left_out;
  for (const std::string& name : file.names()) {
    if (known.count(name) || !file.is_number(name) || file.number(name) == 0) continue;
    const auto meant = std::find_if(known.begin(), known.end(), [&](const std::string& other) {
      return !file.has(other) && edit_distance(name, other) == 1;
    });
    const bool readable =
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (families.count(family_of(name)) || left.count(name))
      left_out.push_back(name);
    else if (meant != known.end() && readable)
      notice(
          fmt::format("{}: there is no coefficient {}, and {}, which is one letter from it, is not given: the "
                      "number is left out.",
                      path, name, *meant));
  }
  if (!left_out.empty())
    notice(fmt::format("{}: {} {} no part in the equations that are computed (MF-Tyre 6.1, 5.2), and {} left out.",
                       path, fmt::join(left_out, ", "), left_out.size() == 1 ? "has" : "have",
                       left_out.size() == 1 ? "is" : "are"));
}

/// PY of PDY1, QX of QSX3: what one force or moment is made of; nothing of what is no coefficient of a shape.
std::string part_of(const std::string& name) {
  constexpr const char* parts = "PX PY RX RY QX QY QZ SZ";
  const std::string family = family_of(name);
  if (family.size() != 3) return "";  // PPMX1
  const std::string part = {family.front(), family.back()};
  return std::string(parts).find(part) != std::string::npos ? part : "";
}

/// What a file of the generation need not have.
bool may_be_missing(const std::string& name, bool older, bool has_pressure) {
  constexpr const char* of_61[] = {"RBX3",  "RBY4",  "PEY5", "PKY4", "PKY5", "PKY6", "PKY7", "QDZ10",
                                   "QDZ11", "QEZ5",  "QSX4", "QSX5", "QSX6", "QSX7", "QSX8", "QSX9",
                                   "QSX10", "QSX11", "QSY5", "QSY6", "QSY7", "QSY8"};
  if (name.starts_with("PT") || (name.starts_with("PP") && (older || !has_pressure))) return true;
  return older ? std::find(std::begin(of_61), std::end(of_61), name) != std::end(of_61) : name == "PHY3";
}

/// What neither the file nor the scene gives, of forces and moments of which they give something.
void tell_missing(const MagicFormulaOptions& o) {
  const auto given = [&](const std::string& name) { return o.coefficients.count(name) > 0; };
  std::set<std::string> parts;
  for (const auto& [name, value] : o.coefficients)
    if (const std::string part = part_of(name); !part.empty()) parts.insert(part);
  std::vector<std::string> missing;
  for (const auto& entry : MagicFormula::coefficients())
    if (!given(entry.name) && parts.count(part_of(entry.name)) &&
        !may_be_missing(entry.name, o.camber_as_angle, given("NOMPRES")))
      missing.push_back(entry.usual == 0 ? entry.name : fmt::format("{} (taken as {})", entry.name, entry.usual));
  if (!missing.empty())
    notice(
        fmt::format("{} does not give {}, which {} taken as zero. Write what is missing into the file, or into "
                    "magic_formula = {{ ... }}, zeros where they are meant.",
                    o.tir_file, fmt::join(missing, ", "), missing.size() == 1 ? "is" : "are"));
}

}  // namespace

void add_magic_formula_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre,
                            const TyreSlipOptions& slip, const MagicFormulaOptions& o) {
  const std::string path = "tyre." + name + ".", table = path + "magic_formula.";
  if (tyre.bilateral)
    throw ModelError(path + "bilateral",
                     "A Magic Formula tyre cannot pull: its forces are not defined for a negative load.");
  const auto has = [&](const char* key) {
    const auto at = o.coefficients.find(key);
    return at != o.coefficients.end() && at->second != 0;
  };
  for (const char* needed : {"FNOMIN", "UNLOADED_RADIUS", "PCX1", "PDX1", "PCY1", "PDY1", "PKY1", "PKY2"}) {
    if (!has(needed))
      throw ModelError(path + "magic_formula",
                       fmt::format("The coefficient {} is missing, or 0: give a complete tir_file.", needed));
  }
  for (const auto& [coefficient, x] : o.coefficients)
    if (const char* wrong = nonsense(coefficient, x))
      if (coefficient != "NOMPRES" || x < 0)  // 0: without pressure
        throw ModelError(table + coefficient, fmt::format("The coefficient {} {}, found {}.", coefficient, wrong, x));
  MagicFormula model;
  TyreSlip lateral;
  std::vector<int> numbers = add_tyre_slip(builder, name, slip, lateral);
  model.lags = lateral.lags;
  model.lags_along = o.longitudinal_relaxation_length_m > 0;
  if (o.relaxation_by_coefficients) {
    if (model.lags || model.lags_along)
      throw ModelError(path + "relaxation",
                       "\"coefficients\" contradicts a relaxation length of its own: give one of the two.");
    require_relaxation(path, o);
    model.lags_by_load = model.lags = true;
    model.lags_along = !o.free_rolling;
    numbers.push_back(builder.add_number(path + "initial_slip", slip.initial_slip));
    if (model.lags_along)
      numbers.push_back(builder.add_number(path + "initial_longitudinal_slip", o.initial_longitudinal_slip));
  } else if (model.lags_along) {
    numbers.push_back(builder.add_number(path + "longitudinal_relaxation_length_m", o.longitudinal_relaxation_length_m,
                                         NumberRule::positive));
    numbers.push_back(builder.add_number(path + "initial_longitudinal_slip", o.initial_longitudinal_slip));
  }
  if (o.free_rolling && !o.tir_file.empty()) {
    constexpr const char* resistance[] = {"QSY1", "QSY2", "QSY3", "QSY4", "QSY5", "QSY6"};
    if (std::any_of(std::begin(resistance), std::end(resistance), has))
      notice(
          fmt::format("{}free_rolling: the wheel has no longitudinal force, and no rolling resistance either: QSY1 "
                      "to QSY8 of {} are left out.",
                      path, o.tir_file));
  }
  model.free_rolling = o.free_rolling;
  model.mirrored = o.mirrored;
  model.camber_as_angle = o.camber_as_angle;
  const auto pressure = o.coefficients.find("NOMPRES");
  for (const auto& entry : MagicFormula::coefficients()) {
    const auto at = o.coefficients.find(entry.name);
    const bool given = at != o.coefficients.end();
    if (!given && entry.name == "INFLPRES" && pressure != o.coefficients.end()) {
      numbers.push_back(builder.number(table + "NOMPRES"));
      continue;
    }
    numbers.push_back(builder.add_number(table + entry.name, given ? at->second : entry.usual));
    if (!given)
      builder.fix_number(numbers.back(),
                         "neither the tyre's file nor the scene gives this coefficient; write it into "
                         "magic_formula = { ... } to vary it.");
  }
  model.has_pressure = has("NOMPRES");
  model.has_effective_radius =
      tyre.stiffness_N_per_m > 0 && (o.coefficients.count("DREFF") || o.coefficients.count("FREFF"));
  add_tyre_force(builder, name, tyre, model, numbers);
}

void read_tir_file(const std::string& path, MagicFormulaOptions& o, TyreOptions& tyre) {
  const TirFile file = TirFile::read(path);
  o.tir_file = path;
  if (file.has("FITTYP")) {
    const double type = file.number("FITTYP");
    const bool older = type == 5 || type == 6 || type == 21 || type == 51 || type == 52;
    if (!older && type != 60 && type != 61 && type != 62)
      file.fail(
          "FITTYP",
          fmt::format("must be 60, 61 or 62 (MF-Tyre 6) or 5, 6, 21, 51 or 52 (MF-Tyre 5, PAC2002), found {}.", type));
    o.camber_as_angle = older;
  } else if (file.text("PROPERTY_FILE_FORMAT", "") == "PAC2002") {
    o.camber_as_angle = true;
  } else {
    file.fail("FITTYP", "is missing: it tells which Magic Formula the coefficients belong to.");
  }
  for (const char* scaling : {"LGAX", "LGAY", "LGAZ"})
    if (file.number(scaling, 1) != 1)
      file.fail(scaling, "other than 1 is not supported: scale the camber's coefficients.");
  tell_left_out(file, path);
  for (const auto& entry : MagicFormula::coefficients())
    if (file.has(entry.name)) o.coefficients[entry.name] = file.number(entry.name);
  for (const char* name : {"UNLOADED_RADIUS", "FNOMIN", "LFZO", "LMUX", "LMUY", "LKX", "LKY", "LCX", "LCY",
                           "VERTICAL_STIFFNESS", "VERTICAL_DAMPING"})
    if (file.has(name))
      if (const char* wrong = nonsense(name, file.number(name)))
        file.fail(name, fmt::format("{}, found {}.", wrong, file.number(name)));
  tyre.radius_m = file.number("UNLOADED_RADIUS", 0);
  tyre.stiffness_N_per_m = file.number("VERTICAL_STIFFNESS", 0);
  tyre.damping_N_s_per_m = file.number("VERTICAL_DAMPING", 0);
}

namespace {

const RegisterTyreModel magic_formula_registered(
    {"magic_formula", [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
       MagicFormulaOptions o;
       TyreOptions usual;
       if (table.has("tir_file")) {
         read_named_file(table, "tir_file", [&](const std::string& file) { read_tir_file(file, o, usual); });
         if (table.has("generation"))
           table.fail("generation", "contradicts 'tir_file', whose FITTYP tells the generation.");
       } else {
         o.camber_as_angle = table.one_of("generation", {"5.2", "6.1"}, "6.1") == "5.2";
       }
       if (table.has("magic_formula")) {  // stands over the file
         SceneTable own = table.table("magic_formula");
         for (const auto& entry : MagicFormula::coefficients())
           if (const auto x = own.find_value(entry.name)) o.coefficients[entry.name] = *x;
       } else if (!table.has("tir_file")) {
         table.fail("needs 'tir_file' (a .tir file) or 'magic_formula' (a table of coefficients).");
       }
       if (table.has("tir_file")) tell_missing(o);
       const TyreOptions tyre = read_tyre(table, builder, usual);
       TyreSlipOptions slip = read_tyre_slip(table);
       o.free_rolling = table.flag("free_rolling", false);
       o.mirrored = table.flag("mirror", false);
       if (table.has("relaxation")) {
         table.one_of("relaxation", {"coefficients"});
         o.relaxation_by_coefficients = true;
         for (const char* key : {"relaxation_length_m", "longitudinal_relaxation_length_m"})
           if (table.has(key)) table.fail(key, "contradicts 'relaxation', which gives this length.");
         slip.initial_slip = table.value("initial_slip", NumberRule::any, 0);
         if (!o.free_rolling)
           o.initial_longitudinal_slip = table.value("initial_longitudinal_slip", NumberRule::any, 0);
       }
       o.longitudinal_relaxation_length_m =
           table.find_value("longitudinal_relaxation_length_m", NumberRule::positive).value_or(0);
       if (o.longitudinal_relaxation_length_m > 0) {
         if (o.free_rolling)
           table.fail("longitudinal_relaxation_length_m",
                      "contradicts 'free_rolling': there is no longitudinal slip to lag.");
         o.initial_longitudinal_slip = table.value("initial_longitudinal_slip", NumberRule::any, 0);
       }
       add_magic_formula_tyre(builder, name, tyre, slip, o);
     }});

}  // namespace

}  // namespace costate
