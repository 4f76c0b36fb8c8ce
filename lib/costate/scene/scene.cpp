#include "costate/scene/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "costate/analysis/not_finite.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_include.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/scene_reader.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"

namespace costate {

namespace {

/// "path=value", in order.
void set_overrides(SceneNode& root, const std::vector<std::string>& overrides) {
  for (const auto& o : overrides) {
    const std::string source = "override '" + o + "'";
    const std::size_t equals = o.find('=');
    if (equals == std::string::npos || equals == 0)
      throw SceneError({source, 0, 0}, "An override looks like path=value, for example run.rtol=1e-10.");
    try {
      set_node(root, o.substr(0, equals), read_toml_value(o.substr(equals + 1), source));
    } catch (const SceneError&) {
      throw;
    } catch (const Error& e) {
      throw SceneError({source, 0, 0}, e.what());
    }
  }
}

}  // namespace

Scene Scene::load(const std::string& path, const std::vector<std::string>& overrides) {
  return parse(read_scene_text(path), path, overrides);
}

Scene Scene::parse(const std::string& text, const std::string& file_name, const std::vector<std::string>& overrides) {
  const SceneFileLog files(file_name);
  auto root = std::make_shared<SceneNode>(read_with_includes(text, file_name));
  set_overrides(*root, overrides);
  return read(root, file_name);
}

Scene Scene::read(std::shared_ptr<const SceneNode> root, const std::string& file_name) {
  Scene scene;
  scene.file_name_ = file_name;
  scene.root_ = root;
  const SceneFileLog files(file_name);
  SceneReader reader(*root);
  try {
    reader.read();
  } catch (const ModelError& e) {
    throw reader.located(e, file_name);
  }
  scene.title = reader.title;
  scene.description = reader.description;
  scene.run = reader.run;
  scene.formulation = reader.formulation;
  scene.optimize = reader.optimize;
  scene.cycle = reader.cycle;
  scene.mechanism_ = reader.mechanism;
  scene.objective_ = reader.objective;
  scene.constraints_ = std::move(reader.constraints);
  scene.load_cases(std::move(reader.cases));
  return scene;
}

namespace {
/// A scene that is read as a case of another one.
thread_local bool reading_case = false;
struct ReadingCase {
  ReadingCase() { reading_case = true; }
  ~ReadingCase() { reading_case = false; }
};
}  // namespace

void Scene::load_cases(std::vector<CaseSettings> settings) {
  if (settings.empty()) return;
  if (reading_case)
    throw SceneError(settings.front().where,
                     "This scene is a case of another one, and lists cases itself: a case is one scene.");
  for (std::size_t i = 0; i < settings.size(); ++i) {
    SceneCase c{std::move(settings[i]), {}};
    const ReadingCase guard;
    const SceneFileLog files(c.file.empty() ? file_name_ : c.file, fmt::format("case[{}].scene", i));
    try {
      if (!c.file.empty()) {
        c.scene = std::make_shared<const Scene>(load(c.file, c.overrides));
      } else {
        auto own = std::make_shared<SceneNode>(*root_);
        std::erase_if(own->children, [](const SceneNode& n) { return n.key == "case"; });
        if (SceneNode* o = own->find("optimize"))
          std::erase_if(o->children, [](const auto& n) { return n.key == "goal"; });
        set_overrides(*own, c.overrides);
        c.scene = std::make_shared<const Scene>(read(own, file_name_));
      }
    } catch (const SceneError& e) {
      if (e.where().line > 0) throw;  // it tells its place itself
      throw SceneError(c.where, fmt::format("The case '{}': {}", c.name, e.what()));
    } catch (const Error& e) {
      throw SceneError(c.where, fmt::format("The case '{}': {}", c.name, e.what()));
    }
    cases.push_back(std::move(c));
  }
}

const SceneCase& Scene::find_case(const std::string& name) const {
  std::vector<std::string> names;
  for (const SceneCase& c : cases) {
    if (c.name == name) return c;
    names.push_back(c.name);
  }
  if (names.empty()) throw Error(fmt::format("The scene '{}' lists no cases, [[case]].", file_name_));
  throw Error(fmt::format("There is no case '{}'.{}", name, suggestion(name, names)));
}

std::string Scene::dump() const { return write_toml(*root_); }

SourceLocation Scene::locate(const std::string& path) const {
  const auto found = locate_path(*root_, path);
  return found ? *found : SourceLocation{file_name_, 0, 0};
}

namespace {

/// The keys of an element's table that hold laws.
std::vector<std::string> law_keys(const SceneNode* element) {
  std::vector<std::string> keys;
  if (element)
    for (const auto& c : element->children)
      if (c.is_table() && (c.find("kind") || c.find("formula"))) keys.push_back(c.key);
  return keys;
}

}  // namespace

SceneError Scene::located(const ModelError& e) const {
  const auto* not_finite = dynamic_cast<const NotFinite*>(&e);
  if (!not_finite) return SceneError(locate(e.subject()), e.what());
  std::string owner = e.subject(), message = e.what();
  const SceneNode* element = owner.empty() ? nullptr : find_node(*root_, owner);
  auto keys = law_keys(element);
  if (element && keys.empty())  // a tyre's law is that of its road
    if (const SceneNode* road = element->find("road"); road && road->type == SceneNode::Type::text) {
      owner = "road." + road->text;
      keys = law_keys(find_node(*root_, owner));
    }
  if (!keys.empty())
    message += fmt::format(" {} '{}'{}.", keys.size() == 1 ? "Its law is" : "Its laws are", fmt::join(keys, "', '"),
                           owner == e.subject() ? "" : fmt::format(" of [{}]", owner));
  if (!not_finite->report.empty()) message += " " + not_finite->report;
  return SceneError(locate(keys.size() == 1 ? owner + "." + keys[0] : keys.empty() ? e.subject() : owner), message);
}

Scene Scene::with_override(const std::string& path, const std::string& value) const {
  return with_overrides({{path, value}});
}

Scene Scene::with_overrides(const std::vector<std::pair<std::string, std::string>>& values) const {
  if (values.empty()) return *this;  // what was changed by hand (its cases) stays
  auto root = std::make_shared<SceneNode>(*root_);
  for (const auto& [path, value] : values)
    set_node(*root, path, read_toml_value(value, fmt::format("override '{}={}'", path, value)));
  return read(root, file_name_);
}

Scene Scene::with_number(const std::string& path, double value) const {
  auto root = std::make_shared<SceneNode>(*root_);
  set_number(*root, path, value);
  return read(root, file_name_);
}

Scene Scene::with_parameters(const ParameterSelection& selection, const std::vector<double>& rho) const {
  auto root = std::make_shared<SceneNode>(*root_);
  set_parameters(*root, *mechanism_, selection, rho);
  return read(root, file_name_);
}

}  // namespace costate
