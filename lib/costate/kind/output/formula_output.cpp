#include "costate/kind/output/formula_output.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/element/defined_output.h"
#include "costate/scene/key_meaning.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_formula_output(MechanismBuilder& builder, const std::string& name, const FormulaOutputOptions& o) {
  const std::string path = "output." + name;
  if (name == "time") throw ModelError(path, "'time' is an output of every scene; choose another name.");
  FormulaReader reader(path, o.keys);
  std::vector<std::string> others;
  const auto formula = reader.read(o.formula, "formula", others, DefinedOutput::kMostNames);
  reader.require_used();
  for (const auto& [key, output] : o.outputs) {
    const auto at = std::find(others.begin(), others.end(), key);
    if (at == others.end()) throw ModelError(path + "." + key, fmt::format("'{}' is in no formula here.", key));
    *at = output;
  }
  builder.add(std::make_unique<DefinedOutput>(name, o.unit, formula, reader.add_numbers(builder), others));
}

namespace {

const KindKeys output_keys("output",
                           {{"formula",
                             "of t, of outputs by their names (P2.x_dot; in single quotes where a name holds "
                             "other signs), and of the table's other keys"},
                            {"unit", "of its value: \"W\""},
                            {"b, c, w",
                             "numbers of the formula of the example, any names will do; each can be a parameter"},
                            {"loss", "a law is a function of the formula of the example, any names will do"},
                            {"cx",
                             "a map is one of two arguments: x, y and z, rows of values, one for each y; or data, "
                             "column and over, two columns; between, beyond, scale as of the law data"},
                            {"pull", "a text is a short name for an output"}});

const RegisterSceneKind output_registered({
    .name = "output",
    .phase = ScenePhase::elements,
    .summary = "an output of one's own: a formula of other outputs, of numbers, laws and of the time",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8
vx_m_per_s = 0.4

[bar.rod]
from = "A"
to = "P"
mass_kg = 2

[spring.strut]
from = "A"
to = "P"
stiffness_N_per_m = 20
natural_length_m = 0.7
damping_N_s_per_m = 1

[output.power]
formula = "c*loss(strut.length)*strut.force*strut.rate"
unit = "W"
c = 1.5
loss = { kind = "data", x = [0.2, 0.8, 1.1, 1.5], y = [0.9, 1, 0.7, 0.75], beyond = "tangent" }

[output.drag]
formula = "cx(strut.length, P.x_dot)*P.y_dot"
unit = "N"
cx = { kind = "map", x = [0.2, 0.8, 1.1], y = [-1, 0, 0.8, 1], z = [[1, 0.7, 0.9], [1.2, 0.8, 0.6], [1.3, 1, 1.1], [0.9, 1.2, 1]], beyond = "tangent" }

[output.effort]
formula = "sqrt(1 + pull^2/b^2) + P.y_ddot*sin(w*t) + exp(-power/10)*energy.kinetic"
unit = "1"
pull = "lambda.bar.rod.length"
b = 3
w = 2

[start]
given = ["P.x"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          FormulaOutputOptions o;
          o.formula = table.text("formula");
          o.unit = table.text("unit");
          std::vector<std::string> others = {"formula", "unit"};
          for (const std::string& key : table.keys())
            if (key != "formula" && key != "unit" && table.is_text(key)) {
              others.push_back(key);
              o.outputs.emplace_back(key, table.text(key));
            }
          o.keys = read_formula_keys(table, others);
          add_formula_output(builder, name, o);
        },
});

}  // namespace

}  // namespace costate
