// What a computation has to say without ending: warnings, as whole sentences. They are kept for the thread that made
// them until somebody takes them; the tool does at the end of each command, a program may after each run.
#pragma once

#include <string>
#include <vector>

namespace costate {

/// Keeps the sentence; one that is kept already is not repeated.
void notice(const std::string& sentence);
/// Those of this thread since the last call, in order.
std::vector<std::string> take_notices();

}  // namespace costate
