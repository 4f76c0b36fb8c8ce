#include "costate/scene/scene_files.h"

#include <fstream>

#include "costate/base/digest.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/scene_reader.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"

namespace costate {

namespace {

namespace fs = std::filesystem;

thread_local SceneFileLog* g_log = nullptr;

/// `file` from a scene in `directory`, or absolute.
std::string path_from(const fs::path& directory, const std::string& file) {
  std::error_code code;
  const fs::path target = fs::weakly_canonical(file, code);
  if (code) return file;
  if (directory.empty()) return target.string();
  const fs::path there = fs::weakly_canonical(directory, code);
  return code ? target.string() : target.lexically_proximate(there).string();
}

}  // namespace

SceneFileLog::SceneFileLog(std::string scene, std::string below)
    : outer_(g_log), scene_(std::move(scene)), below_(std::move(below)) {
  g_log = this;
}

SceneFileLog::~SceneFileLog() {
  g_log = outer_;
  if (!outer_) return;
  for (std::size_t k = 0; k < files_.size() && !below_.empty(); ++k) {
    SceneFile& f = files_[k];
    if (f.path.empty()) f.digest = file_digest(f.file);  // the outer scene's text does not hold it
    f.path = below_ + "." + (f.path.empty() ? "include[" + std::to_string(k) + "]" : f.path);
  }
  outer_->files_.insert(outer_->files_.end(), files_.begin(), files_.end());
}

void SceneFileLog::add(SceneFile file) {
  if (g_log) g_log->files_.push_back(std::move(file));
}

std::string SceneFileLog::scene() { return g_log ? g_log->scene_ : std::string(); }

std::string named_file(SceneTable& table, const std::string& key) {
  const std::string name = table.text(key);
  const SourceLocation own = table.where(key);
  const std::string from = own.line > 0 ? own.file : SceneFileLog::scene();
  const std::string file = (fs::path(from).parent_path() / name).string();
  SceneFileLog::add({table.path(key), file, file_digest(file)});
  return file;
}

std::string file_digest(const std::string& file) {
  std::error_code ignored;  // a pipe or a device would not give its bytes twice
  if (!fs::is_regular_file(file, ignored)) return {};
  std::ifstream in(file, std::ios::binary);
  Digest digest;
  char buffer[65536];
  while (in) {
    in.read(buffer, sizeof buffer);
    digest.add({buffer, static_cast<std::size_t>(in.gcount())});
  }
  return in.eof() ? digest.text() : std::string();
}

std::string scene_text_for(const Scene& scene, const std::vector<SceneFile>& files, const fs::path& directory,
                           const ParameterSelection& selection, const std::vector<double>& rho) {
  SceneNode root = read_toml(scene.dump(), scene.file_name());
  set_parameters(root, *scene.mechanism(), selection, rho);
  for (const SceneFile& f : files) {
    if (f.path.empty()) continue;
    SceneNode node;
    node.type = SceneNode::Type::text;
    const SceneNode* old = find_node(root, f.path);
    if (!old || fs::path(old->text).is_absolute()) continue;
    node.where = old->where;
    node.text = path_from(directory, f.file);
    set_node(root, f.path, std::move(node));
  }
  return write_toml(root);
}

std::string scene_text_for(const Scene& scene, const std::vector<SceneFile>& files, const fs::path& directory) {
  return scene_text_for(scene, files, directory, ParameterSelection{}, {});
}

}  // namespace costate
