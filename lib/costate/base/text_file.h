// Reading text that a user names: whole, bounded, and with the system's reason where it cannot be read.
#pragma once

#include <cstddef>
#include <string>

namespace costate {

/// The bytes of a file, or of a pipe until its other end closes; `what` ("The scene file") begins the complaint. Throws
/// SceneError at the file for what cannot be opened, fails while it is read, or is longer than `most` bytes. Can be
/// stopped (base/stop.h) while a pipe says nothing.
std::string read_text_file(const std::string& path, std::size_t most, const std::string& what);

/// A decimal number as a whole text, by the C locale whatever the program's is; false for anything else, and for what
/// is not finite.
bool read_number(const std::string& text, double& x);

}  // namespace costate
