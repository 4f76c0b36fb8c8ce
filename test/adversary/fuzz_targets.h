// What the fuzzer does with an input: everything that is read is read, and what reads whole is run.
#pragma once

#include <filesystem>
#include <string>

#include "adversary/fuzz_inputs.h"

namespace costate::fuzz {

enum class Verdict {
  refused,    // by an error that names its place
  read,       // whole
  ran,        // and run
  failed,     // and refused or ended with a cause while it ran
  placeless,  // refused by an error that names no place
  raw,        // ended in a library's own words
  wrong       // read as what it is not
};

struct Outcome {
  Verdict verdict = Verdict::refused;
  std::string message;  // of what is none of the first four
};

/// Reads the input, written to `directory` where it is a file. `index` chooses formulation and method of a run.
Outcome try_input(const Input& input, long index, const std::filesystem::path& directory);

/// Whether a message says where: file, line or element; and whether it holds words of a library.
bool names_a_place(const std::string& message);
bool is_raw(const std::string& message);

}  // namespace costate::fuzz
