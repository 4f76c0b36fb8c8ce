// What the tyre models' options have in common, and the registry that a new model enters: [tyre.NAME] with
// model = "NAME".
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/element/force/tyre_force.h"
#include "costate/kind/lookup.h"
#include "costate/kind/tyre/tyre.h"
#include "costate/scene/scene_table.h"

namespace costate {

struct TyreModelKind {
  std::string name;
  std::function<void(const std::string& name, SceneTable& table, MechanismBuilder& builder)> add;
};
struct RegisterTyreModel {
  explicit RegisterTyreModel(TyreModelKind kind);
};
std::vector<std::string> tyre_model_names();
const TyreModelKind& find_tyre_model(const std::string& name);

/// The keys of all tyres. Where `usual` has a radius, a stiffness or a damping (from a file), the scene need
/// not.
TyreOptions read_tyre(SceneTable& table, const MechanismBuilder& builder, const TyreOptions& usual = {});
TyreSlipOptions read_tyre_slip(SceneTable& table);

/// Registers the numbers of the slip in the order of TyreSlip and sets the latter up.
std::vector<int> add_tyre_slip(MechanismBuilder& builder, const std::string& name, const TyreSlipOptions& options,
                               TyreSlip& slip);

struct TyreParts {
  TyreSetup setup;
  SpatialPoint wheel;
  std::vector<int> spin, numbers;
};
/// Names resolved and the numbers of all tyres registered.
TyreParts add_tyre_parts(MechanismBuilder& builder, const std::string& name, const TyreOptions& options);

template <class Model>
void add_tyre_force(MechanismBuilder& builder, const std::string& name, const TyreOptions& options, Model model,
                    const std::vector<int>& model_numbers) {
  TyreParts parts = add_tyre_parts(builder, name, options);
  builder.add(std::make_unique<TyreForce<Model>>(name, std::move(parts.setup), parts.wheel, parts.spin, parts.numbers,
                                                 std::move(model), model_numbers));
}

}  // namespace costate
