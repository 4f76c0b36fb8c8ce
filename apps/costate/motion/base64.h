// Bytes as text (RFC 4648), for files that hold numbers inside JSON or XML.
#pragma once

#include <string>
#include <string_view>

namespace costate::app {

std::string base64(std::string_view bytes);

}  // namespace costate::app
