#include "costate/record/hdf5_write.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"

namespace costate::record_detail {

namespace {

constexpr std::size_t kCompressAbove = 4096;  // rows
constexpr hsize_t kChunkRows = 16384;

Hdf5Handle scalar_space() { return {H5Screate(H5S_SCALAR), H5Sclose, "creating a dataspace"}; }

Hdf5Handle column_space(hsize_t rows) {
  return {H5Screate_simple(1, &rows, nullptr), H5Sclose, "creating a dataspace"};
}

/// Of a group or dataset.
Hdf5Handle creation_properties(hid_t kind) {
  Hdf5Handle properties(H5Pcreate(kind), H5Pclose, "creating object properties");
  check_hdf5(H5Pset_obj_track_times(properties.get(), false), "creating object properties");
  return properties;
}

Hdf5Handle link_names() {
  Hdf5Handle properties(H5Pcreate(H5P_LINK_CREATE), H5Pclose, "creating link properties");
  check_hdf5(H5Pset_char_encoding(properties.get(), H5T_CSET_UTF8), "creating link properties");
  return properties;
}

/// Of a dataset of numbers: compressed where they are many.
Hdf5Handle number_properties(std::size_t rows) {
  Hdf5Handle properties = creation_properties(H5P_DATASET_CREATE);
  if (rows <= kCompressAbove) return properties;
  const hsize_t chunk = std::min<hsize_t>(rows, kChunkRows);
  check_hdf5(H5Pset_chunk(properties.get(), 1, &chunk), "setting the chunk size");
  if (H5Zfilter_avail(H5Z_FILTER_DEFLATE) > 0) {
    check_hdf5(H5Pset_shuffle(properties.get()), "setting compression");
    check_hdf5(H5Pset_deflate(properties.get(), 4), "setting compression");
  }
  return properties;
}

Hdf5Handle make_dataset(hid_t parent, const std::string& name, hid_t type, const Hdf5Handle& space,
                        const Hdf5Handle& properties, const Hdf5Handle& links) {
  return {H5Dcreate2(parent, name.c_str(), type, space.get(), links.get(), properties.get(), H5P_DEFAULT), H5Dclose,
          "creating a dataset"};
}

Hdf5Handle number_dataset(hid_t parent, const std::string& name, const std::vector<double>& values,
                          const Hdf5Handle& space, const Hdf5Handle& properties, const Hdf5Handle& links) {
  Hdf5Handle dataset = make_dataset(parent, name, H5T_IEEE_F64LE, space, properties, links);
  check_hdf5(H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
             "writing a dataset");
  return dataset;
}

void write_attribute(hid_t object, const char* name, hid_t type, hid_t memory, const Hdf5Handle& space,
                     const void* value) {
  const Hdf5Handle attribute(H5Acreate2(object, name, type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                             "creating an attribute");
  check_hdf5(H5Awrite(attribute.get(), memory, value), "writing an attribute");
}

void write_text_attribute(hid_t object, const char* name, const Hdf5Handle& type, const Hdf5Handle& space,
                          const std::string& text) {
  const char* pointer = text.c_str();
  write_attribute(object, name, type.get(), type.get(), space, &pointer);
}

void write_integer_attribute(hid_t object, const char* name, const Hdf5Handle& space, long long value) {
  write_attribute(object, name, H5T_STD_I64LE, H5T_NATIVE_LLONG, space, &value);
}

Hdf5Handle write_pointers(hid_t parent, const std::string& name, const Hdf5Handle& space, const char* const* texts) {
  const Hdf5Handle type = hdf5_text_type();
  Hdf5Handle dataset =
      make_dataset(parent, name, type.get(), space, creation_properties(H5P_DATASET_CREATE), link_names());
  check_hdf5(H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, texts), "writing text");
  return dataset;
}

}  // namespace

Hdf5Handle hdf5_text_type() {
  Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "creating the text type");
  check_hdf5(H5Tset_size(type.get(), H5T_VARIABLE), "creating the text type");
  check_hdf5(H5Tset_cset(type.get(), H5T_CSET_UTF8), "creating the text type");
  return type;
}

Hdf5Handle make_group(hid_t parent, const std::string& name) {
  const Hdf5Handle links = link_names(), properties = creation_properties(H5P_GROUP_CREATE);
  return {H5Gcreate2(parent, name.c_str(), links.get(), properties.get(), H5P_DEFAULT), H5Gclose, "creating a group"};
}

Hdf5Handle write_numbers(hid_t parent, const std::string& name, const std::vector<double>& values) {
  return number_dataset(parent, name, values, column_space(values.size()), number_properties(values.size()),
                        link_names());
}

Hdf5ColumnWriter::Hdf5ColumnWriter(std::size_t rows)
    : links_(link_names()),
      properties_(number_properties(rows)),
      space_(column_space(rows)),
      scalar_(scalar_space()),
      text_(hdf5_text_type()) {}

void Hdf5ColumnWriter::write(hid_t parent, const std::string& name, const std::vector<double>& values,
                             const std::string& unit, long long column) const {
  const Hdf5Handle dataset = number_dataset(parent, name, values, space_, properties_, links_);
  write_text_attribute(dataset.get(), "unit", text_, scalar_, unit);
  write_integer_attribute(dataset.get(), "column", scalar_, column);
}

Hdf5Handle write_texts(hid_t parent, const std::string& name, const std::vector<std::string>& values) {
  std::vector<const char*> pointers;
  for (const auto& t : values) pointers.push_back(t.c_str());
  return write_pointers(parent, name, column_space(values.size()), pointers.data());
}

void write_text(hid_t parent, const std::string& name, const std::string& text) {
  if (text.find('\0') != std::string::npos)
    throw Error(fmt::format("the text for /{} contains a zero byte, which HDF5 text cannot hold", name));
  const char* pointer = text.c_str();
  write_pointers(parent, name, scalar_space(), &pointer);
}

void write_text_attribute(hid_t object, const char* name, const std::string& text) {
  write_text_attribute(object, name, hdf5_text_type(), scalar_space(), text);
}

void write_integer_attribute(hid_t object, const char* name, long long value) {
  write_integer_attribute(object, name, scalar_space(), value);
}

}  // namespace costate::record_detail
