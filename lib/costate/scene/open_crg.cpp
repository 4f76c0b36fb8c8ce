#include "costate/scene/open_crg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/letters.h"
#include "costate/base/text_file.h"

namespace costate {

namespace {

constexpr std::size_t kLongestCrg = 256 << 20;  // bytes
/// Headings that differ by less are one [rad].
constexpr double kStraight = 1e-6;
/// So far apart two places are one [m].
constexpr double kSamePlace = 1e-6;

class CrgReader {
 public:
  CrgReader(const std::string& name, const std::string& file) : file_(file), table_(std::make_shared<DataTable>()) {
    table_->name = name;
    table_->source = fmt::format("data '{}' ({})", name, std::filesystem::path(file).filename().string());
    in_.str(read_text_file(file, kLongestCrg, "This file of a road, whose path is relative to the scene,"));
  }

  std::shared_ptr<DataTable> read() {
    read_head();
    if (format_ != "LRFI" && format_ != "LDFI")
      fail(format_line_,
           format_.empty()
               ? "The format of the data is missing: a line '#:LRFI' or '#:LDFI' in $KD_Definition."
               : fmt::format("The format '{}' is not read; write the road as text, LRFI or LDFI.", format_));
    place_sections();
    read_rows();
    return table_;
  }

 private:
  struct Channel {
    enum class Kind { heading, slope, banking, section } kind;
    double v = 0;  // of a section [m], or its number
    int line = 0;
  };

  [[noreturn]] void fail(int line, const std::string& what, int column = 1) const {
    throw SceneError({file_, line, column}, what);
  }
  bool next() {
    if (!std::getline(in_, line_)) return false;
    if (!line_.empty() && line_.back() == '\r') line_.pop_back();
    ++number_;
    return true;
  }

  /// $NAME opens a block, $ ends it, $$ begins the data.
  void read_head() {
    std::string block;
    while (next()) {
      if (line_.rfind("$$", 0) == 0) return;
      std::string text = trimmed(line_.substr(0, line_.find('!')));
      if (!text.empty() && text[0] == '$') {
        block = in_capitals(trimmed(text.substr(1)));
        if (block == "ROAD_CRG_FILE")
          fail(number_, "Roads that refer to other files are not read; name that file in the scene.");
        continue;
      }
      if (text.empty() || text[0] == '*') continue;
      if (block == "ROAD_CRG_MODS")
        fail(number_, fmt::format("Modifiers are not read ('{}'); write the road as it is with them.", text));
      if (block == "ROAD_CRG") read_entry(text);
      if (block == "KD_DEFINITION") read_definition(text);
    }
    fail(number_, "The data are missing: they begin behind a line '$$'.");
  }

  void read_entry(const std::string& text) {
    const std::size_t equals = text.find('=');
    double value = 0;
    if (equals == std::string::npos || !read_number(trimmed(text.substr(equals + 1)), value))
      fail(number_, fmt::format("Expected 'NAME = number', found '{}'.", text));
    head_[in_capitals(trimmed(text.substr(0, equals)))] = value;
  }

  void read_definition(const std::string& text) {
    if (text.rfind("#:", 0) == 0) {
      format_ = in_capitals(trimmed(text.substr(2)));
      format_line_ = number_;
      return;
    }
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string what = trimmed(text.substr(std::min<std::size_t>(2, text.size()), comma < 2 ? 0 : comma - 2)),
                      rest = trimmed(text.substr(std::min(comma + 1, text.size())));
    if (text.rfind("U:", 0) == 0) {
      if (what != "reference line u") return;
      std::istringstream parts(rest);
      std::string unit, start, step;
      std::getline(parts, unit, ',');
      std::getline(parts, start, ',');
      std::getline(parts, step, ',');
      double x = 0;
      if (read_number(trimmed(start), x)) head_["REFERENCE_LINE_START_U"] = x;
      if (read_number(trimmed(step), x)) head_["REFERENCE_LINE_INCREMENT"] = x;
      return;
    }
    if (text.rfind("D:", 0) != 0) return;
    using Kind = Channel::Kind;
    static const std::map<std::string, std::pair<Kind, const char*>> lines = {
        {"reference line phi", {Kind::heading, "rad"}},
        {"reference line slope", {Kind::slope, "m/m"}},
        {"reference line banking", {Kind::banking, "m/m"}}};
    const std::string section = "long section ", at = "at v = ";
    const auto known = lines.find(what);
    if (known == lines.end() && what.rfind(section, 0) != 0)
      fail(
          number_,
          fmt::format(
              "The channel '{}' is unknown; expected 'long section ...' or 'reference line phi', 'slope' or 'banking'.",
              what));
    const char* unit = known == lines.end() ? "m" : known->second.second;
    if (rest != unit) fail(number_, fmt::format("Expected the unit '{}' of '{}', found '{}'.", unit, what, rest));
    Channel c{known == lines.end() ? Kind::section : known->second.first, 0, number_};
    if (c.kind == Kind::section) {
      std::string place = what.substr(section.size());
      const bool by_place = place.rfind(at, 0) == 0;
      if (by_place) place = trimmed(place.substr(at.size()));
      if (!read_number(place, c.v))
        fail(number_, fmt::format("Expected 'long section at v = number' or its number, found '{}'.", what));
      if (sections_ > 0 && by_place != placed_)
        fail(number_, "Long sections are given by place or by number, not both.");
      placed_ = by_place;
      ++sections_;
    }
    channels_.push_back(c);
  }

  double head(const std::string& key, double otherwise) const {
    const auto at = head_.find(key);
    return at == head_.end() ? otherwise : at->second;
  }

  void place_sections() {
    if (sections_ < 2) fail(format_line_, "Expected two long sections or more ('D:long section at v = -0.75,m').");
    const double step = head("LONG_SECTION_V_INCREMENT", 0.01),
                 right = head("LONG_SECTION_V_RIGHT", -0.5 * step * (sections_ - 1));
    const double left = right + step * (sections_ - 1), said = head("LONG_SECTION_V_LEFT", left);
    if (!placed_ && !(std::abs(said - left) <= kSamePlace))
      fail(format_line_,
           fmt::format("LONG_SECTION_V_LEFT is {:g} m, and {} long sections from {:g} m on, {:g} m apart, "
                       "end at {:g} m: give the LONG_SECTION_V_INCREMENT that is meant.",
                       said, sections_, right, step, left));
    table_->columns.push_back({"u", "m", {}});
    std::map<std::string, int> lines;
    for (Channel& c : channels_) {
      if (c.kind != Channel::Kind::section) continue;
      if (!placed_) {
        if (!(c.v >= 1 && c.v <= sections_ && c.v == std::floor(c.v)))
          fail(c.line, fmt::format("Expected a number from 1 to {} of a long section, found {:g}.", sections_, c.v));
        c.v = right + (c.v - 1) * step;
        // To a micrometre: "v=-0.9", not what rounding makes of it.
        c.v = std::round(c.v * 1e6) / 1e6;
      }
      const std::string column = fmt::format("v={:g}", c.v == 0 ? 0.0 : c.v);
      if (!lines.emplace(column, c.line).second) fail(c.line, fmt::format("There are two long sections '{}'.", column));
      table_->columns.push_back({column, "m", {}});
    }
  }

  /// The values of a row: fields of fixed width, which need no blanks between them, in lines of 80.
  bool read_row(std::vector<double>& row) {
    const std::size_t width = format_ == "LRFI" ? 10 : 20, a_line = 80 / width;
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (k % a_line == 0 && !next_data(k > 0)) return false;
      const std::size_t at = k % a_line * width;
      const std::string field = at < line_.size() ? trimmed(line_.substr(at, width)) : "";
      row[k] = std::numeric_limits<double>::quiet_NaN();
      if (!field.empty() && field[0] == '*') continue;  // missing, or not used
      if (!read_number(field, row[k]))
        fail(number_, fmt::format("Expected a number in {} characters, found '{}'.", width, field),
             static_cast<int>(at) + 1);
    }
    return true;
  }
  bool next_data(bool needed) {
    do {
      if (!next()) {
        if (needed) fail(number_, fmt::format("The last row ends here; each has {} values.", channels_.size()));
        return false;
      }
    } while (trimmed(line_).empty());
    return true;
  }

  void read_rows() {
    const double begin = head("REFERENCE_LINE_START_U", 0), step = head("REFERENCE_LINE_INCREMENT", 0.01),
                 heading = head("REFERENCE_LINE_START_PHI", std::numeric_limits<double>::quiet_NaN());
    if (!(step > 0)) fail(1, fmt::format("REFERENCE_LINE_INCREMENT must be positive, found {:g}.", step));
    double height = head("REFERENCE_LINE_START_Z", 0), first_heading = heading;
    std::vector<double> row(channels_.size());
    std::vector<DataColumn>& columns = table_->columns;
    for (std::size_t i = 0; read_row(row); ++i) {
      double slope = head("REFERENCE_LINE_START_S", 0), banking = head("REFERENCE_LINE_START_B", 0);
      for (std::size_t k = 0; k < channels_.size(); ++k) {
        const Channel::Kind kind = channels_[k].kind;
        if (kind == Channel::Kind::section) continue;
        // Headings and slopes are of the way from the row before.
        if (kind != Channel::Kind::banking && i == 0) continue;
        if (!std::isfinite(row[k])) fail(number_, "A heading, slope or banking is missing.");
        if (kind == Channel::Kind::slope) slope = row[k];
        if (kind == Channel::Kind::banking) banking = row[k];
        if (kind != Channel::Kind::heading) continue;
        if (std::isnan(first_heading)) first_heading = row[k];
        if (std::abs(row[k] - first_heading) > kStraight)
          fail(number_, fmt::format("The reference line bends here, from a heading of {:g} rad to {:g}: roads of "
                                    "scenes are profiles along a straight line.",
                                    first_heading, row[k]));
      }
      if (i > 0) height += slope * step;
      columns[0].values.push_back(begin + static_cast<double>(i) * step);
      std::size_t column = 1;
      for (std::size_t k = 0; k < channels_.size(); ++k)
        if (channels_[k].kind == Channel::Kind::section)
          columns[column++].values.push_back(height + banking * channels_[k].v + row[k]);
    }
    if (columns[0].values.size() < 2) fail(number_, "Expected two rows of data or more.");
    // Slopes are written to some six digits.
    const double end = head("REFERENCE_LINE_END_Z", height),
                 rounding = kSamePlace * (1 + step * static_cast<double>(columns[0].values.size()));
    if (!(std::abs(end - height) <= rounding))
      fail(1,
           fmt::format("REFERENCE_LINE_END_Z is {:g} m, and the slopes lead to {:g} m: correct one of them, or leave "
                       "the key out, for heights that follow the slopes from REFERENCE_LINE_START_Z on.",
                       end, height));
  }

  std::string file_, line_, format_;
  std::istringstream in_;
  int number_ = 0, format_line_ = 1, sections_ = 0;
  bool placed_ = false;
  std::map<std::string, double> head_;
  std::vector<Channel> channels_;
  std::shared_ptr<DataTable> table_;
};

}  // namespace

bool is_open_crg(const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  return ending == ".crg" || ending == ".CRG";
}

std::shared_ptr<DataTable> read_open_crg(const std::string& name, const std::string& file) {
  return CrgReader(name, file).read();
}

}  // namespace costate
