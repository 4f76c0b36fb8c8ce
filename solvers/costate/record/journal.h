// The journal of an optimization run: an append-only file of JSON lines that survives a killed process and
// lets the run go on where it stopped. The first line identifies the run (its header: scene, settings, ...);
// every further line is one record, on disk before append() returns.
//
//   {"costate_journal":2,"header":{...}}
//   {"checksum":"...", ...}
//   {"checksum":"...", ...}
//
// The checksum (base/digest.h) is of the header's line, the record's number and its text, so that a record counts only
// as it was written and where it was written. Finite doubles read back bit-exactly. Non-finite ones are stored as the
// strings "nan", "inf", "-inf": read numbers that may be non-finite with number_from_json (json_number.h).
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
  /// (the process was killed in the middle of a write) is dropped and cut off; so is everything from the first record
  /// on that is not as it was written, and damage() tells.
  ///
  /// Throws Error if the file cannot be read or written, is in use by another run, is not a journal, or has a damaged
  /// header or another one (the error names the keys that differ).
  [[nodiscard]] static Journal open(const std::filesystem::path& path, const nlohmann::json& header, bool resume);

  /// All records: those read on resume, then those appended since, with non-finite numbers as text.
  [[nodiscard]] const std::vector<nlohmann::json>& records() const { return records_; }

  /// How many of records() were read from the file on resume; 0 for a new journal.
  [[nodiscard]] std::size_t resumed_records() const { return resumed_records_; }

  /// Whether a truncated last line was dropped on resume.
  [[nodiscard]] bool dropped_partial_record() const { return dropped_partial_record_; }

  /// Which record was damaged and why, and that it was cut off with all after it; or empty.
  [[nodiscard]] const std::string& damage() const { return damage_; }

  /// Cuts off all records behind the first `count`: the next one is not what this run can have written (`why`).
  void keep(std::size_t count, const std::string& why);

  /// The header of the journal at `path`, without opening it for a run; null where there is none.
  [[nodiscard]] static nlohmann::json header_of(const std::filesystem::path& path);

  /// Whether a run holds the journal at `path`.
  [[nodiscard]] static bool in_use(const std::filesystem::path& path);

  /// Appends one record, an object, as one line and flushes it to disk. Throws Error if that fails; the file is then
  /// cut back to its last complete record, so that the journal stays valid.
  void append(const nlohmann::json& record);

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  Journal() = default;
  void cut();

  std::filesystem::path path_;
  record_detail::FileDescriptor file_;
  std::vector<nlohmann::json> records_;
  std::string header_;             // its line
  std::vector<std::size_t> ends_;  // of the header and of each record, in bytes
  std::string damage_;
  std::size_t resumed_records_ = 0;
  bool dropped_partial_record_ = false;
};

}  // namespace costate
