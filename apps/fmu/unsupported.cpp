// Functions of FMI 3.0 that every library has to have, and for which this FMU has nothing: variables of other types
// than Float64, clocks, stored states, structural parameters, scheduled execution. They fail, as the capability flags
// in modelDescription.xml say. What their arguments are does not matter to them.
#include "fmi3.h"

#define COSTATE_UNSUPPORTED(name) \
  COSTATE_FMI fmi3Status name(fmi3Instance) { return fmi3Error; }

#define COSTATE_UNSUPPORTED_TYPE(type) \
  COSTATE_UNSUPPORTED(fmi3Get##type)   \
  COSTATE_UNSUPPORTED(fmi3Set##type)

COSTATE_UNSUPPORTED_TYPE(Float32)
COSTATE_UNSUPPORTED_TYPE(Int8)
COSTATE_UNSUPPORTED_TYPE(UInt8)
COSTATE_UNSUPPORTED_TYPE(Int16)
COSTATE_UNSUPPORTED_TYPE(UInt16)
COSTATE_UNSUPPORTED_TYPE(Int32)
COSTATE_UNSUPPORTED_TYPE(UInt32)
COSTATE_UNSUPPORTED_TYPE(Int64)
COSTATE_UNSUPPORTED_TYPE(UInt64)
COSTATE_UNSUPPORTED_TYPE(Boolean)
COSTATE_UNSUPPORTED_TYPE(String)
COSTATE_UNSUPPORTED_TYPE(Binary)
COSTATE_UNSUPPORTED_TYPE(Clock)
COSTATE_UNSUPPORTED_TYPE(FMUState)
COSTATE_UNSUPPORTED_TYPE(IntervalDecimal)
COSTATE_UNSUPPORTED_TYPE(IntervalFraction)
COSTATE_UNSUPPORTED_TYPE(ShiftDecimal)
COSTATE_UNSUPPORTED_TYPE(ShiftFraction)

COSTATE_UNSUPPORTED(fmi3FreeFMUState)
COSTATE_UNSUPPORTED(fmi3SerializedFMUStateSize)
COSTATE_UNSUPPORTED(fmi3SerializeFMUState)
COSTATE_UNSUPPORTED(fmi3DeserializeFMUState)
COSTATE_UNSUPPORTED(fmi3GetNumberOfVariableDependencies)
COSTATE_UNSUPPORTED(fmi3GetVariableDependencies)
COSTATE_UNSUPPORTED(fmi3EnterConfigurationMode)
COSTATE_UNSUPPORTED(fmi3ExitConfigurationMode)
COSTATE_UNSUPPORTED(fmi3EvaluateDiscreteStates)
COSTATE_UNSUPPORTED(fmi3GetOutputDerivatives)
COSTATE_UNSUPPORTED(fmi3ActivateModelPartition)

COSTATE_FMI fmi3Instance fmi3InstantiateScheduledExecution(fmi3String) { return nullptr; }
