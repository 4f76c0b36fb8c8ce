#include "scene_writer.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/scene/scene.h"

namespace costate::adversary {

void SceneWriter::choose_parameters() {
  std::shuffle(parameters_.begin(), parameters_.end(), engine_);
  parameters_.resize(std::min<std::size_t>(parameters_.size(), 1 + engine_() % 3));
}

KindScene SceneWriter::finish(const char* kind, double t_end, const char* rtol) {
  KindScene r;
  r.kind = kind;
  r.parameters = parameters_;
  std::string list;
  for (const auto& p : parameters_) list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", p);
  text_ += fmt::format("[run]\nt_end_s = {:.4f}\nrtol = {}\nparameters = [{}]\n", t_end, rtol, list);
  try {
    Scene::parse(text_, "random scene");
    r.text = text_;
  } catch (const Error&) {
    r.text.clear();
  }
  return r;
}

}  // namespace costate::adversary
