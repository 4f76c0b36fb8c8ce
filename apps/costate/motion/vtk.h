// A stage as a series for ParaView: a collection (.pvd) and beside it a folder with one VTK file (.vtp) a sample, both
// XML as https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html has it.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "stage.h"

namespace costate::app {

/// One sample after the other as PolyData: the solids' triangles in the scene's own axes [m], as 32-bit floats, with
/// the cells' arrays `element` (a place in the file's list `element_names`) and `color` (red, green, blue, opacity),
/// and the sample's time `TimeValue` [s]. Cells are the same ones in each sample.
class VtpWriter {
 public:
  explicit VtpWriter(const Stage& stage);
  std::string text(std::size_t sample) const;

 private:
  struct Part {
    const Solid* solid;
    std::vector<Eigen::Vector3d> corners;  // of its mesh, each once
  };
  const Stage& stage_;
  std::vector<Part> parts_;
  std::size_t points_ = 0;
  std::string names_, head_, tail_;  // what does not change in time
};

/// Where the frames of the collection `file` are: motion/ of motion.pvd.
std::filesystem::path frames_folder(const std::filesystem::path& file);

/// Throws Error where a series cannot be: the folder's name is a file's, or none that XML can hold.
void require_series_place(const std::filesystem::path& file);

/// Writes all frames, calling `written` with how many there are, then the collection, then removes the frames of an
/// earlier one. Names of frames begin with a fingerprint of the motion, so that at any moment an existing collection
/// names whole frames of its own motion alone; where an exception ends the writing (check_stop is called), an earlier
/// series is as it was and nothing of this one is left. Throws Error where something cannot be written.
void write_series(const std::filesystem::path& file, const Stage& stage,
                  const std::function<void(std::size_t frames)>& written);

}  // namespace costate::app
