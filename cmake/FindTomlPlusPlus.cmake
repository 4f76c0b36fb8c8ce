# Finds the header-only form of toml++ and defines the imported target TomlPlusPlus::header_only. (The
# package configuration that comes with toml++ may select a compiled form, depending on how it was built.)
find_path(TomlPlusPlus_INCLUDE_DIR toml++/toml.h)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(TomlPlusPlus REQUIRED_VARS TomlPlusPlus_INCLUDE_DIR)
mark_as_advanced(TomlPlusPlus_INCLUDE_DIR)

if(TomlPlusPlus_FOUND AND NOT TARGET TomlPlusPlus::header_only)
  add_library(TomlPlusPlus::header_only INTERFACE IMPORTED)
  set_target_properties(
    TomlPlusPlus::header_only PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${TomlPlusPlus_INCLUDE_DIR}"
                                         INTERFACE_COMPILE_DEFINITIONS "TOML_HEADER_ONLY=1")
endif()
