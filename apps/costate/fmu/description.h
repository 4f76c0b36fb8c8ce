// modelDescription.xml of an FMU (FMI 3.0).
#pragma once

#include <string>

#include "fmu_model.h"

namespace costate::app {

/// `identifier`: the name of its library, a C identifier.
std::string model_description(const FmuModel& model, const std::string& title, const std::string& description,
                              const std::string& identifier, const std::string& token);

}  // namespace costate::app
