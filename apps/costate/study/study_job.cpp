#include "study_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "costate/base/text_file.h"
#include "costate/record/atomic_file.h"
#include "costate/scene/scene_files.h"
#include "task_options.h"

namespace costate::app {

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

Json json_of_file(const std::filesystem::path& path) {
  constexpr std::size_t most = std::size_t{1} << 30;  // bytes
  if (!std::filesystem::exists(path)) return {};
  return Json::parse(read_text_file(path.string(), most, "The file of a study's run"), nullptr, false);
}

Json StudyJob::definition() const {
  Json files = Json::object();
  for (const SceneFile& f : run.files)
    if (!f.path.empty()) files[f.path] = f.digest;
  Json j = {{"scene", run.scene_text}, {"files", files}, {"parameters", run.parameters}, {"options", run.options}};
  if (!run.design.empty() || run.task != "optimize") j["task"] = run.task;
  if (run.design.empty()) return j;
  j["overrides"] = run.overrides;
  j["outputs"] = run.outputs;
  return j;
}

StudyJob::Left StudyJob::find_earlier() {
  Json known = json_of_file(directory / "study_run.json");
  if (!known.is_object()) return Left::nothing;
  const Json digest = known.value("summary", Json());
  const Json failed = known.value("failed", Json());
  known.erase("summary");
  known.erase("failed");
  if (known != definition()) return Left::nothing;
  if (failed.is_string()) {
    error = failed;
    return Left::failed;
  }
  if (!digest.is_string() || digest != file_digest(summary().string())) return Left::begun;
  result = json_of_file(summary());
  return Left::finished;
}

void StudyJob::note(bool finished) const {
  Json j = definition();
  if (finished) j["summary"] = file_digest(summary().string());
  if (!error.empty()) j["failed"] = error;
  write_file_atomically(directory / "study_run.json", json_text(j) + "\n");
}

void StudyJob::require_files() const {
  std::vector<std::string> names = {"study_run.json", "evaluations.jsonl", "log.txt"};
  for (const std::string& task : study_tasks()) names.push_back(task + ".json");
  for (const std::string& name : names) {
    const std::filesystem::path file = directory / name;
    if (std::filesystem::exists(file) && !std::filesystem::is_regular_file(file))
      throw Error(
          fmt::format("'{}' is no regular file: the run '{}' cannot write there; remove it, or choose another "
                      "directory with --output.",
                      file.string(), run.name));
  }
}

long StudyJob::evaluations() const {
  const std::string journal = text_of_file(directory / "evaluations.jsonl");
  return std::max<long>(0, std::count(journal.begin(), journal.end(), '\n') - 1);
}

}  // namespace costate::app
