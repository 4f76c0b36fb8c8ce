// The files besides itself that a scene reads: scenes that it includes, road profiles, tyre properties. They are part
// of what a run is: its journal knows their bytes, and a scene that is written elsewhere names them so that they are
// found from there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "costate/scene/scene_file.h"
#include "costate/scene/scene_table.h"

namespace costate {

class Scene;
struct ParameterSelection;

/// Collects what this thread reads for scenes while it lives. One inside another hands on what it has at its end.
class SceneFileLog {
 public:
  /// `scene`: the file from which paths count that stand in no file, those of the command line.
  /// `below`: what it hands on is of a scene that the outer one names there, "case[0].scene", its included files, too.
  explicit SceneFileLog(std::string scene, std::string below = {});
  ~SceneFileLog();
  SceneFileLog(const SceneFileLog&) = delete;
  SceneFileLog& operator=(const SceneFileLog&) = delete;

  static void add(SceneFile file);
  static std::string scene();
  const std::vector<SceneFile>& files() const { return files_; }

 private:
  SceneFileLog* outer_;
  std::string scene_, below_;
  std::vector<SceneFile> files_;
};

/// The file that a key names, as it can be opened. Relative paths count from the file that the key stands in; those of
/// the command line from the scene's.
std::string named_file(SceneTable& table, const std::string& key);
/// What `read` makes of it; an error about the file as a whole says where the scene names it, too.
template <class Read>
auto read_named_file(SceneTable& table, const std::string& key, const Read& read) {
  const std::string file = named_file(table, key);
  try {
    return read(file);
  } catch (const SceneError& e) {
    if (e.where().line > 0) throw;
    throw SceneError(table.where(key), e.what());
  }
}

/// The fingerprint of a regular file's bytes as they are now; empty for anything else.
std::string file_digest(const std::string& file);

/// The scene's text for a file in `directory`: relative paths of `files` are those from there. With an empty directory
/// they become absolute, for a text that may go anywhere. Nothing is read.
std::string scene_text_for(const Scene& scene, const std::vector<SceneFile>& files,
                           const std::filesystem::path& directory);
/// The same with the values rho in all numbers that the parameters are bound to.
std::string scene_text_for(const Scene& scene, const std::vector<SceneFile>& files,
                           const std::filesystem::path& directory, const ParameterSelection& selection,
                           const std::vector<double>& rho);

}  // namespace costate
