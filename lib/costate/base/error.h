// Errors that a person can act on: where, what was expected, what was found, what to do.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace costate {

/// The root of all errors of this library. what() is a complete sentence for the user.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}
};

/// A place in a text file; line and column count from 1, 0 means unknown.
struct SourceLocation {
  std::string file;
  int line = 0;
  int column = 0;
};

/// A mistake in a scene file: the message starts with file:line:column.
class SceneError : public Error {
 public:
  SceneError(const SourceLocation& where, const std::string& message);
  const SourceLocation& where() const { return where_; }

 private:
  SourceLocation where_;
};

/// A mistake in the mechanism itself (redundant rows, an unreachable start), independent of a file.
/// `subject` is the dotted path of the thing at fault ("bar.A1", "start.given[2]"), or empty.
class ModelError : public Error {
 public:
  ModelError(std::string subject, const std::string& message);
  const std::string& subject() const { return subject_; }
  const std::string& bare_message() const { return message_; }

 private:
  std::string subject_;
  std::string message_;
};

/// A numerical failure while solving: names the time, the step and the worst components.
class SolverError : public Error {
 public:
  using Error::Error;
};

/// A state that the equations have no solution for (positions that cannot be reached, ...). An integrator that meets it
/// in a trial step tries a shorter one.
class StepError : public SolverError {
 public:
  using SolverError::SolverError;
};

/// A run that gets on, but would take more steps than it may.
class TooMuchWork : public SolverError {
 public:
  using SolverError::SolverError;
};

/// A request that a formulation, integrator or method cannot serve.
class CapabilityError : public Error {
 public:
  using Error::Error;
};

/// The candidate nearest to `name` by edit distance, or empty when none is near.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// " Did you mean 'x'?" or, when nothing is near, " Known: a, b, c." (empty without candidates).
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace costate
