// Groups, columns of numbers and texts, and attributes in an HDF5 file: names in UTF-8, numbers as 64-bit
// little-endian, texts of variable length in UTF-8, no time stamps, so that the same content gives the same bytes.
#pragma once

#include <string>
#include <vector>

#include "costate/record/hdf5_handle.h"

namespace costate::record_detail {

// All throw Error.

Hdf5Handle hdf5_text_type();
Hdf5Handle make_group(hid_t parent, const std::string& name);
/// Compressed where they are many.
Hdf5Handle write_numbers(hid_t parent, const std::string& name, const std::vector<double>& values);
Hdf5Handle write_texts(hid_t parent, const std::string& name, const std::vector<std::string>& values);
/// Writes datasets of numbers of one length, each with the attributes `unit` and `column`: what they have in common is
/// made once, which halves the time of a hundred thousand of them.
class Hdf5ColumnWriter {
 public:
  explicit Hdf5ColumnWriter(std::size_t rows);
  void write(hid_t parent, const std::string& name, const std::vector<double>& values, const std::string& unit,
             long long column) const;

 private:
  Hdf5Handle links_, properties_, space_, scalar_, text_;
};
/// A single text, which may hold no zero byte.
void write_text(hid_t parent, const std::string& name, const std::string& text);

void write_text_attribute(hid_t object, const char* name, const std::string& text);
void write_integer_attribute(hid_t object, const char* name, long long value);

}  // namespace costate::record_detail
