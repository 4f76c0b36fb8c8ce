// What the fuzzer starts from, and how it changes it: gently mostly, one number, key, name or table at a time, so that
// what is read reaches the code behind the parser.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace costate::fuzz {

struct Input {
  enum class Kind { scene, tyre, profile, include, over, study, baseline, journal, csv, crg };
  Kind kind = Kind::scene;
  std::string text;
  std::string folder = {};  // of a scene that names files: they are found from there
};

inline constexpr std::size_t kKinds = static_cast<std::size_t>(Input::Kind::crg) + 1;

const char* name_of(Input::Kind kind);
/// The file that an input of this kind is written to, or the name it is read by.
const char* file_of(Input::Kind kind);

/// Everything to start from: models, parts that they include, the examples of all kinds and laws, tyre files,
/// baselines, and one of each other kind.
std::vector<Input> corpus();

/// A scene with a wheel on a road, whose tyre or road is that of a file, appended behind it.
extern const char* const kWheel;
/// A scene that optimizes two parameters; the journal of the corpus is of a run like it.
extern const char* const kPendulum;
/// A journal's header and records: what a run of two parameters and one constraint would have written.
std::string journal_text();

class Mutator {
 public:
  Mutator(const std::vector<Input>& corpus, std::uint64_t seed);
  Input make();

 private:
  using Range = std::pair<std::size_t, std::size_t>;  // [begin, end)
  std::size_t pick(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(engine_() % n); }
  bool chance(int percent) { return static_cast<int>(pick(100)) < percent; }

  Range line(const std::string& s);
  /// A random number of the text: not part of a name, nor of a comment's first line. Empty if there is none.
  Range number(const std::string& s);
  Range quoted(const std::string& s);
  /// From a header "[kind.NAME]" to the next one.
  Range table(const std::string& s);
  /// Of a random "key = value" line.
  Range key(const std::string& s);
  Range value(const std::string& s);

  void change(Input& input);
  void change_gently(std::string& s);
  void change_roughly(std::string& s);
  std::string other_number(const std::string& old);

  const std::vector<Input>& corpus_;
  std::vector<std::vector<const Input*>> by_kind_;
  std::mt19937_64 engine_;
};

}  // namespace costate::fuzz
