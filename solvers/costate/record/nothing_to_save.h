// Commands that compute one thing and store nothing on the way end at once when they are interrupted.
#pragma once

#include <string>

namespace costate {

/// While one of these lives there is nothing that an orderly end would save: a signal that no one has looked at within
/// half a second ends the process there, with a word on standard error (with `json` also an object on standard output)
/// and the status 128 + signal. For programs that have called install_interrupt_handler.
class NothingToSave {
 public:
  explicit NothingToSave(bool json);
  ~NothingToSave();
  NothingToSave(const NothingToSave&) = delete;
  NothingToSave& operator=(const NothingToSave&) = delete;
};

/// A file that is to be removed where that happens: one that is being written under a name of its own.
class RemovedAtOnce {
 public:
  explicit RemovedAtOnce(const std::string& path);
  ~RemovedAtOnce();
  RemovedAtOnce(const RemovedAtOnce&) = delete;
  RemovedAtOnce& operator=(const RemovedAtOnce&) = delete;

 private:
  int place_ = -1;
};

}  // namespace costate
