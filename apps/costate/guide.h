// The failure guide: where apps/README.md says what a message means, why it usually comes and what to do.
#pragma once

#include <string>
#include <vector>

namespace costate::app {

struct GuideEntry {
  std::string anchor;                // of a heading in apps/README.md
  std::vector<std::string> phrases;  // messages that hold one of these are told there
};

/// In the order in which messages are looked for.
const std::vector<GuideEntry>& failure_guide();

/// "apps/README.md#newton-fails", or empty where the guide has nothing on this message.
std::string guide_to(const std::string& message);
/// The message with that behind it.
std::string with_guide(const std::string& message);

}  // namespace costate::app
