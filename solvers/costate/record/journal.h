// The journal of an optimization run: an append-only file of JSON lines that survives a killed process and
// lets the run go on where it stopped. The first line identifies the run (its header: scene, settings, ...);
// every further line is one record, on disk before append() returns.
//
//   {"costate_journal":1,"header":{...}}
//   {...}
//   {...}
//
// Finite doubles read back bit-exactly. Non-finite ones are stored as the strings "nan", "inf", "-inf": read
// numbers that may be non-finite with number_from_json (json_number.h).
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "costate/record/posix_file.h"

namespace costate {

/// An open journal. Movable, not copyable; not thread-safe (callers serialize append). The file is locked
/// while it is open, so that two runs cannot write the same journal.
class Journal {
 public:
  /// Opens the journal at `path` for a run identified by `header` (any JSON, usually an object).
  ///
  /// Without `resume` a new journal is begun and an existing one is replaced; a file that is not a journal is
  /// never replaced. With `resume` the records of an existing journal are read, and its header must equal
  /// `header`; if there is no file (or an empty one), a new journal is begun. A last line without line break
  /// (the process was killed in the middle of a write) is dropped and cut off.
  ///
  /// Throws Error if the file cannot be read or written, is in use by another run, is not a journal, has
  /// another header (the error names the keys that differ) or a corrupt line (the error gives its number).
  [[nodiscard]] static Journal open(const std::filesystem::path& path, const nlohmann::json& header,
                                    bool resume);

  /// All records: those read on resume, then those appended since, with non-finite numbers as text.
  [[nodiscard]] const std::vector<nlohmann::json>& records() const { return records_; }

  /// How many of records() were read from the file on resume; 0 for a new journal.
  [[nodiscard]] std::size_t resumed_records() const { return resumed_records_; }

  /// Whether a truncated last line was dropped on resume.
  [[nodiscard]] bool dropped_partial_record() const { return dropped_partial_record_; }

  /// Appends one record as one line and flushes it to disk. Throws Error if that fails; the file is then
  /// cut back to its last complete record, so that the journal stays valid.
  void append(const nlohmann::json& record);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  Journal() = default;

  std::filesystem::path path_;
  record_detail::FileDescriptor file_;
  std::vector<nlohmann::json> records_;
  std::size_t size_bytes_ = 0;  // of the complete lines in the file
  std::size_t resumed_records_ = 0;
  bool dropped_partial_record_ = false;
};

}  // namespace costate
