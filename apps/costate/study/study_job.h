// One run of a study: where its results are, how far it is, and what they belong to.
#pragma once

#include <filesystem>
#include <string>

#include "costate/command.h"
#include "study_file.h"

namespace costate::app {

/// One run of the study and where it is.
struct StudyJob {
  StudyRun run;
  std::filesystem::path directory;
  enum class State { waiting, kept, running, done, failed } state = State::waiting;
  bool resume = false;
  std::string error;
  Json result;

  std::filesystem::path summary() const { return directory / (run.task + ".json"); }
  /// What the results belong to: a change of it makes them worthless.
  Json definition() const;
  /// What an earlier study left of this definition; a summary counts as it was written, to the byte, and is read then.
  /// Of one that has failed `error` is set.
  enum class Left { nothing, begun, failed, finished };
  Left find_earlier();
  /// Notes in the directory what its results belong to, and the digest of the summary once there is one, or the error.
  void note(bool finished) const;
  /// Throws where the place of one of its files is taken by a pipe, a device or a directory.
  void require_files() const;
  /// Those in the journal.
  long evaluations() const;
  bool ok() const { return state == State::kept || state == State::done; }
  const char* status() const {
    return state == State::kept     ? "kept"
           : state == State::done   ? "ok"
           : state == State::failed ? "failed"
                                    : "interrupted";
  }
};

/// A file's bytes, and the JSON in it: null where there is none, discarded where it is damaged.
std::string text_of_file(const std::filesystem::path& path);
Json json_of_file(const std::filesystem::path& path);

}  // namespace costate::app
