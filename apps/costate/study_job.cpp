#include "study_job.h"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace costate::app {

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

Json json_of_file(const std::filesystem::path& path) {
  std::ifstream in(path);
  return in ? Json::parse(in, nullptr, false) : Json();
}

Json StudyJob::definition() const {
  Json files = Json::object();
  for (const SceneFile& f : run.files)
    if (!f.path.empty()) files[f.path] = f.digest;
  return {{"scene", run.scene_text}, {"files", files}, {"parameters", run.parameters}, {"options", run.options}};
}

long StudyJob::evaluations() const {
  const std::string journal = text_of_file(directory / "evaluations.jsonl");
  return std::max<long>(0, std::count(journal.begin(), journal.end(), '\n') - 1);
}

}  // namespace costate::app
