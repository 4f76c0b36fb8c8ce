#include "costate/record/journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <string_view>

#include "costate/base/digest.h"
#include "costate/base/error.h"
#include "costate/record/atomic_file.h"
#include "costate/record/json_number.h"

namespace costate {
namespace {

using nlohmann::json;
using record_detail::errno_text;
using record_detail::FileDescriptor;

constexpr int kVersion = 2;
constexpr const char* kChecksum = "checksum";
constexpr std::string_view kMagic = "{\"costate_journal\":";

std::string shortened(const json& value) {
  std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

// Lists where two JSON values differ, as "key/inner: journal has a, this run has b".
void list_differences(const json& old_value, const json& new_value, const std::string& where,
                      std::vector<std::string>& found) {
  if (old_value == new_value) return;
  const std::string place = where.empty() ? "header" : where;
  const auto step = [&](const std::string& key) { return where.empty() ? key : where + "/" + key; };
  if (old_value.is_object() && new_value.is_object()) {
    for (const auto& [key, value] : old_value.items()) {
      if (new_value.contains(key)) {
        list_differences(value, new_value.at(key), step(key), found);
      } else {
        found.push_back(fmt::format("'{}': the journal has {}, this run has none", step(key), shortened(value)));
      }
    }
    for (const auto& [key, value] : new_value.items()) {
      if (!old_value.contains(key)) {
        found.push_back(fmt::format("'{}': the journal has none, this run has {}", step(key), shortened(value)));
      }
    }
  } else if (old_value.is_array() && new_value.is_array() && old_value.size() == new_value.size()) {
    for (std::size_t i = 0; i < old_value.size(); ++i) {
      list_differences(old_value[i], new_value[i], step(std::to_string(i)), found);
    }
  } else if (old_value.is_string() && new_value.is_string()) {
    // Long texts (a scene) usually begin alike: show where they part.
    const auto& a = old_value.get_ref<const std::string&>();
    const auto& b = new_value.get_ref<const std::string&>();
    std::size_t same = 0;
    long line = 1;
    while (same < a.size() && same < b.size() && a[same] == b[same]) line += a[same++] == '\n';
    const bool many_lines = a.find('\n') != std::string::npos || b.find('\n') != std::string::npos;
    found.push_back(many_lines ? fmt::format("'{}': the texts differ from line {} on", place, line)
                               : fmt::format("'{}': the journal has {}, this run has {}", place, shortened(old_value),
                                             shortened(new_value)));
  } else {
    found.push_back(
        fmt::format("'{}': the journal has {}, this run has {}", place, shortened(old_value), shortened(new_value)));
  }
}

void require_same_header(const json& old_header, const json& new_header, const std::filesystem::path& path) {
  std::vector<std::string> found;
  list_differences(old_header, new_header, "", found);
  if (found.empty()) return;
  std::string text;
  for (std::size_t i = 0; i < found.size() && i < 4; ++i) text += (i == 0 ? "" : "; ") + found[i];
  if (found.size() > 4) text += fmt::format("; and {} more", found.size() - 4);
  throw Error(
      fmt::format("cannot resume from the journal '{}': it belongs to another run. Differing: {}. Use "
                  "the same scene and settings, choose another journal, or start without resuming",
                  path.string(), text));
}

std::string damage_text(std::size_t number, const std::string& why) {
  return fmt::format("record {} is damaged ({}): it and what follows it are cut off", number, why);
}

void lock(const FileDescriptor& file, const std::filesystem::path& path) {
  if (::flock(file.get(), LOCK_EX | LOCK_NB) == 0) return;
  // File systems without locks are accepted; only a lock held by somebody else is an error.
  if (errno == EWOULDBLOCK) {
    throw Error(
        fmt::format("the journal '{}' is in use by another run; wait for it to end or choose another "
                    "journal",
                    path.string()));
  }
}

/// Whether the open file is still the one of that name: a run that begins anew puts another in its place.
bool still_there(const FileDescriptor& file, const std::filesystem::path& path) {
  struct stat opened {
  }, named{};
  return ::fstat(file.get(), &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

FileDescriptor open_file(const std::filesystem::path& path, std::string& content) {
  FileDescriptor file;
  do {
    file = FileDescriptor(::open(path.c_str(), O_RDWR | O_APPEND | O_CLOEXEC));
    if (!file.valid()) {
      if (errno == ENOENT) return file;
      throw Error(fmt::format("cannot open the journal '{}': {}; check the path and its permissions", path.string(),
                              errno_text(errno)));
    }
    struct stat status {};
    // A pipe has no end to wait for, a device none at all.
    if (::fstat(file.get(), &status) == 0 && !S_ISREG(status.st_mode))
      throw Error(
          fmt::format("'{}' is no regular file and cannot be a journal; choose another journal path", path.string()));
    lock(file, path);
  } while (!still_there(file, path));
  const int failed = record_detail::read_all(file.get(), content);
  if (failed != 0) {
    throw Error(fmt::format("cannot read the journal '{}': {}", path.string(), errno_text(failed)));
  }
  if (!content.empty() && content.compare(0, kMagic.size(), kMagic) != 0) {
    throw Error(
        fmt::format("'{}' is not a Costate journal and is left untouched; choose another journal path", path.string()));
  }
  return file;
}

/// The header's line, or an error: without it nothing that follows can be trusted.
json parse_header(std::string_view line, const std::filesystem::path& path) {
  try {
    return json::parse(line);
  } catch (const json::exception& error) {
    throw Error(fmt::format("the header of the journal '{}' is damaged: {}; start without resuming", path.string(),
                            json_reason(error)));
  }
}

/// Of a record in its place: the header's line, its number and its text without the checksum.
std::string checksum(const std::string& header, std::size_t number, const std::string& text) {
  Digest digest;
  digest.add(header);
  digest.add(fmt::format("{} {}", number, text));
  return digest.text();
}

/// The record of a line; throws json::exception or Error for what is not one as it was written.
json parse_record(std::string_view line, const std::string& header, std::size_t number) {
  json value = json::parse(line);
  if (!value.is_object() || !value.contains(kChecksum) || !value.at(kChecksum).is_string())
    throw Error("it has no checksum");
  const std::string stored = value.at(kChecksum).get<std::string>();
  value.erase(kChecksum);
  if (checksum(header, number, value.dump()) != stored) throw Error("its checksum does not fit");
  return value;
}

}  // namespace

Journal Journal::open(const std::filesystem::path& path, const json& header, bool resume) {
  Journal journal;
  journal.path_ = path;
  const json stored_header = json::parse(json_to_line(header, "the journal header"));
  std::string content;
  FileDescriptor existing = open_file(path, content);

  if (!resume || content.empty()) {
    const json first = {{"costate_journal", kVersion}, {"header", stored_header}};
    const std::string line = first.dump() + "\n";
    write_file_atomically(path, line);  // `existing` keeps its lock until the new file is in place
    std::string reread;
    journal.file_ = open_file(path, reread);
    if (reread != line) {
      throw Error(fmt::format("the journal '{}' was changed by another process while it was created", path.string()));
    }
    journal.header_ = first.dump();
    journal.ends_ = {line.size()};
    return journal;
  }

  journal.file_ = std::move(existing);
  std::string_view rest = content;
  while (!rest.empty() && journal.damage_.empty()) {
    const std::size_t end = rest.find('\n');
    if (end == std::string_view::npos) {
      if (journal.ends_.empty()) throw Error(fmt::format("the journal '{}' ends within its header", path.string()));
      journal.dropped_partial_record_ = true;
      break;
    }
    const std::string_view line = rest.substr(0, end);
    if (journal.ends_.empty()) {
      const json value = parse_header(line, path);
      if (value.at("costate_journal") != kVersion || !value.contains("header")) {
        throw Error(
            fmt::format("the journal '{}' was written by another version of Costate; start without "
                        "resuming or use that version",
                        path.string()));
      }
      require_same_header(value.at("header"), stored_header, path);
      journal.header_ = std::string(line);
      journal.ends_.push_back(end + 1);
    } else {
      try {
        journal.records_.push_back(parse_record(line, journal.header_, journal.ends_.size()));
        journal.ends_.push_back(journal.ends_.back() + end + 1);
      } catch (const std::exception& error) {
        journal.damage_ = damage_text(journal.records_.size() + 1, json_reason(error));
      }
    }
    rest.remove_prefix(end + 1);
  }
  journal.resumed_records_ = journal.records_.size();
  if (journal.dropped_partial_record_ || !journal.damage_.empty()) journal.cut();
  return journal;
}

bool Journal::in_use(const std::filesystem::path& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return file.valid() && ::flock(file.get(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

json Journal::header_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line;
  std::getline(in, line);
  const json first = json::parse(line, nullptr, false);
  return first.is_object() ? first.value("header", json()) : json();
}

void Journal::keep(std::size_t count, const std::string& why) {
  if (count >= records_.size()) return;
  damage_ = damage_text(count + 1, why);
  records_.resize(count);
  ends_.resize(count + 1);
  resumed_records_ = count;
  cut();
}

void Journal::cut() {
  const bool done = ::ftruncate(file_.get(), static_cast<off_t>(ends_.back())) == 0;
  const int failed = done ? record_detail::sync_to_disk(file_.get()) : errno;
  if (failed != 0) {
    throw Error(fmt::format("cannot cut what is incomplete or damaged off the journal '{}': {}", path_.string(),
                            errno_text(failed)));
  }
}

void Journal::append(const json& record) {
  if (!record.is_object()) throw Error("a journal record must be a JSON object");
  json stored = json::parse(json_to_line(record, "a journal record"));
  json written = stored;
  written[kChecksum] = checksum(header_, ends_.size(), stored.dump());
  const std::string line = written.dump() + "\n";
  int failed = record_detail::write_all(file_.get(), line);
  if (failed == 0) failed = record_detail::sync_to_disk(file_.get());
  if (failed != 0) {
    [[maybe_unused]] const int ignored = ::ftruncate(file_.get(), static_cast<off_t>(ends_.back()));
    throw Error(
        fmt::format("cannot append to the journal '{}': {}; the records before are kept: free some space "
                    "and resume",
                    path_.string(), errno_text(failed)));
  }
  ends_.push_back(ends_.back() + line.size());
  records_.push_back(std::move(stored));
}

}  // namespace costate
