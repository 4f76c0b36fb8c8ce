// Files in one file of ZIP, stored as they are: what an FMU comes in.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace costate::app {

/// The bytes of a ZIP file with these entries (path inside, content), without compression. Throws Error beyond 4 GB.
std::string zip_bytes(const std::vector<std::pair<std::string, std::string>>& entries);

}  // namespace costate::app
