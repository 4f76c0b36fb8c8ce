// Keeps the integrator's own last message instead of letting it print to the terminal.
#pragma once

#include <string>

namespace costate {

/// `message` must outlive the integrator memory.
void capture_ida_messages(void* ida_memory, std::string& message);
void capture_cvode_messages(void* cvode_memory, std::string& message);

}  // namespace costate
