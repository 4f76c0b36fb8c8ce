// What FMI 3.0 (Functional Mock-up Interface, fmi-standard.org) says of the binary interface, as far as this FMU has
// something to say there: types, and the functions by their signatures.
#pragma once

#include <cstddef>
#include <cstdint>

#define COSTATE_FMI extern "C" __attribute__((visibility("default")))

using fmi3Instance = void*;
using fmi3InstanceEnvironment = void*;
using fmi3FMUState = void*;
using fmi3ValueReference = std::uint32_t;
using fmi3Float64 = double;
using fmi3Boolean = bool;
using fmi3Byte = std::uint8_t;
using fmi3String = const char*;

enum fmi3Status { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal };

using fmi3LogMessageCallback = void (*)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
using fmi3IntermediateUpdateCallback = void (*)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                                fmi3Boolean, fmi3Boolean, fmi3Boolean*, fmi3Float64*);
