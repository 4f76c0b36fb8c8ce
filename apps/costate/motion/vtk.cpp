#include "vtk.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <map>
#include <system_error>

#include "base64.h"
#include "costate/base/digest.h"
#include "costate/base/error.h"
#include "costate/base/stop.h"
#include "costate/base/version.h"
#include "costate/record/atomic_file.h"
#include "costate/record/posix_file.h"
#include "costate/record/svg_plot.h"

namespace costate::app {

namespace {

namespace fs = std::filesystem;

template <class Number>
std::string_view bytes_of(const std::vector<Number>& x) {
  return {reinterpret_cast<const char*>(x.data()), x.size() * sizeof(Number)};
}

/// Inline data as the format has it without compression: base64 of the count of bytes (header_type) and the bytes.
std::string array(const char* tag, const std::string& attributes, std::string_view bytes) {
  const std::uint64_t count = bytes.size();
  std::string data(sizeof count, '\0');
  std::memcpy(data.data(), &count, sizeof count);
  data += bytes;
  return fmt::format("<{0} {1} format=\"binary\">{2}</{0}>\n", tag, attributes, base64(data));
}
template <class Number>
std::string data_array(const std::string& attributes, const std::vector<Number>& x) {
  return array("DataArray", attributes, bytes_of(x));
}

std::string file_head(const char* type) {
  return fmt::format("<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"{1}\" header_type=\"UInt64\">\n<{0}>\n", type,
                     std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
}
std::string file_tail(const char* type) { return fmt::format("</{0}>\n</VTKFile>\n", type); }

/// The stage's motion as eight digits.
std::string fingerprint(const Stage& stage) {
  Digest digest;
  const auto add = [&](const auto& numbers) { digest.add(bytes_of(numbers)); };
  digest.add(version);
  add(stage.times);
  for (const SolidMesh& m : stage.meshes) {
    for (const auto& c : m.corners) add(std::vector<float>(c.begin(), c.end()));
    add(m.triangles);
  }
  for (const Solid& s : stage.solids) {
    digest.add(s.name);
    for (const Pose& p : s.poses) {
      std::vector<double> x(p.at.begin(), p.at.end());
      x.insert(x.end(), p.turn.coeffs().begin(), p.turn.coeffs().end());
      x.insert(x.end(), p.scale.begin(), p.scale.end());
      add(x);
    }
  }
  return digest.text().substr(0, 8);
}

/// FINGERPRINT_NUMBER.vtp, or what becomes one: .FINGERPRINT_NUMBER.vtp.tmp
bool is_frame_of_others(std::string name, const std::string& tag) {
  const bool hidden = name.size() > 5 && name[0] == '.' && name.substr(name.size() - 4) == ".tmp";
  if (hidden) name = name.substr(1, name.size() - 5);
  const auto all = [&](std::size_t from, std::size_t to, int (*kind)(int)) {
    return std::all_of(name.begin() + static_cast<long>(from), name.begin() + static_cast<long>(to),
                       [&](char c) { return kind(static_cast<unsigned char>(c)) != 0; });
  };
  // Frames of the same motion are those that have just been written: its times are part of the fingerprint.
  return name.size() >= 17 && name[8] == '_' && name.substr(name.size() - 4) == ".vtp" && all(0, 8, std::isxdigit) &&
         all(9, name.size() - 4, std::isdigit) && (hidden || name.substr(0, 8) != tag);
}

[[noreturn]] void throw_not_written(const fs::path& file, int failed) {
  throw Error(fmt::format("cannot write '{}': {}; check the free space and the permissions", file.string(),
                          record_detail::errno_text(failed)));
}

/// Whole or not at all, but not yet sure to be on the disk: that is so of all frames at once, before the collection.
void write_frame(const fs::path& file, const fs::path& temporary, const std::string& text) {
  record_detail::FileDescriptor out(::open(temporary.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0666));
  int failed = out.valid() ? record_detail::write_all(out.get(), text) : errno;
  if (failed == 0) failed = out.close();
  if (failed == 0 && ::rename(temporary.c_str(), file.c_str()) != 0) failed = errno;
  if (failed != 0) throw_not_written(file, failed);
}

/// What has been written to the folder's file system is on the disk. Of large series that may take a while.
void bring_to_disk(const fs::path& folder) {
  run_stoppably([folder] {
    const record_detail::FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!opened.valid() || ::syncfs(opened.get()) != 0) throw_not_written(folder, errno);
  });
}

/// Files of a series that is not finished; they go, and their folder if it is of this series, unless it is kept.
class Unfinished {
 public:
  explicit Unfinished(fs::path folder) : folder_(std::move(folder)), made_(!fs::exists(folder_)) {}
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished() {
    std::error_code ignored;
    for (const auto& f : files_) fs::remove(f, ignored);
    if (!temporary_.empty()) fs::remove(temporary_, ignored);
    if (made_) fs::remove(folder_, ignored);  // only where it is empty
  }
  /// A frame of the same motion may have been there; then it stays.
  void add(const fs::path& file, const fs::path& temporary) {
    if (!fs::exists(file)) files_.push_back(file);
    temporary_ = temporary;
  }
  void keep() {
    files_.clear();
    made_ = false;
  }

 private:
  fs::path folder_;
  bool made_;
  std::vector<fs::path> files_;
  fs::path temporary_;
};

}  // namespace

VtpWriter::VtpWriter(const Stage& stage) : stage_(stage) {
  std::vector<std::int32_t> connectivity, offsets, element;
  std::vector<std::uint8_t> color;
  std::map<std::string, std::int32_t> ids;
  std::string names;
  for (const Solid& s : stage.solids) {
    const SolidMesh& m = stage.meshes[static_cast<std::size_t>(s.mesh)];
    if (m.triangles.empty()) continue;
    const auto [id, fresh] = ids.try_emplace(s.name, static_cast<std::int32_t>(ids.size()));
    if (fresh) names += s.name + '\0';
    // Faces share their corners here; without normals of points viewers shade each face for itself.
    Part part{&s, {}};
    std::map<std::array<float, 3>, std::int32_t> known;
    for (const auto i : m.triangles) {
      const auto& c = m.corners[i];
      const auto next = static_cast<std::int32_t>(points_ + part.corners.size());
      const auto [at, found_none] = known.try_emplace({c[0], c[1], c[2]}, next);
      if (found_none) part.corners.push_back(c.cast<double>());
      connectivity.push_back(at->second);
    }
    for (std::size_t k = 0; k < m.triangles.size(); k += 3) {
      offsets.push_back(static_cast<std::int32_t>(connectivity.size() - m.triangles.size() + k + 3));
      element.push_back(id->second);
      for (const unsigned shift : {16U, 8U, 0U}) color.push_back(static_cast<std::uint8_t>(s.color >> shift));
      color.push_back(static_cast<std::uint8_t>(255 * s.opacity + 0.5));
    }
    points_ += part.corners.size();
    parts_.push_back(std::move(part));
  }
  names_ =
      array("Array", fmt::format("type=\"String\" Name=\"element_names\" NumberOfTuples=\"{}\"", ids.size()), names);
  head_ = fmt::format(
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
      "NumberOfPolys=\"{}\">\n<Points>\n",
      points_, offsets.size());
  tail_ = "</Points>\n<CellData Scalars=\"element\">\n" + data_array("type=\"Int32\" Name=\"element\"", element) +
          data_array("type=\"UInt8\" Name=\"color\" NumberOfComponents=\"4\"", color) + "</CellData>\n<Polys>\n" +
          data_array("type=\"Int32\" Name=\"connectivity\"", connectivity) +
          data_array("type=\"Int32\" Name=\"offsets\"", offsets) + "</Polys>\n</Piece>\n" + file_tail("PolyData");
}

std::string VtpWriter::text(std::size_t sample) const {
  std::vector<float> x;
  x.reserve(3 * points_);
  for (const Part& part : parts_) {
    const Pose& p = part.solid->poses[sample];
    const Eigen::Matrix3d turn = p.turn.toRotationMatrix() * p.scale.asDiagonal();
    for (const auto& c : part.corners)
      for (const double r : Vector3d(p.at + turn * c)) x.push_back(static_cast<float>(r));
  }
  const std::vector<double> time{stage_.times[sample]};
  return file_head("PolyData") + "<FieldData>\n" +
         data_array("type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\"", time) + names_ + "</FieldData>\n" +
         head_ + data_array("type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\"", x) + tail_;
}

fs::path frames_folder(const fs::path& file) { return file.parent_path() / file.stem(); }

void require_series_place(const fs::path& file) {
  const fs::path folder = frames_folder(file);
  const std::string stem = file.stem().string(), bad = "\xEF\xBF\xBD";  // what stands for characters not allowed
  if (xml_escaped(stem).find(bad) != std::string::npos)
    throw Error(
        "--output names a .pvd file whose name is no UTF-8 or has control characters, which XML cannot hold; choose "
        "another name.");
  if (fs::exists(folder) && !fs::is_directory(folder))
    throw Error(fmt::format("The frames of '{}' go into the folder '{}', but that is a file; choose another name.",
                            file.string(), folder.string()));
}

void write_series(const fs::path& file, const Stage& stage, const std::function<void(std::size_t frames)>& written) {
  const VtpWriter writer(stage);
  const fs::path folder = frames_folder(file);
  const std::string tag = fingerprint(stage);
  Unfinished unfinished(folder);
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) throw_not_written(folder, failed.value());
  std::string collection = file_head("Collection");
  for (std::size_t i = 0; i < stage.times.size(); ++i) {
    check_stop();
    const std::string name = fmt::format("{}_{:04}.vtp", tag, i);
    const fs::path frame = folder / name, temporary = folder / ("." + name + ".tmp");
    unfinished.add(frame, temporary);
    write_frame(frame, temporary, writer.text(i));
    collection += fmt::format("<DataSet timestep=\"{}\" part=\"0\" file=\"{}/{}\"/>\n", stage.times[i],
                              xml_escaped(file.stem().string()), name);
    written(i + 1);
  }
  bring_to_disk(folder);
  write_file_atomically(file, collection + file_tail("Collection"));
  unfinished.keep();
  std::vector<fs::path> old;
  for (const auto& entry : fs::directory_iterator(folder, failed))
    if (is_frame_of_others(entry.path().filename().string(), tag)) old.push_back(entry.path());
  for (const auto& f : old) {
    check_stop();
    fs::remove(f, failed);
  }
}

}  // namespace costate::app
