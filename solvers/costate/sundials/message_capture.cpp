#include "costate/sundials/message_capture.h"

#include <cvodes/cvodes.h>
#include <idas/idas.h>

#include "costate/sundials/compatibility.h"

namespace costate {

#if SUNDIALS_VERSION_MAJOR < 7
namespace {
void keep(int code, const char*, const char*, char* text, void* message) {
  if (code < 0) *static_cast<std::string*>(message) = text;
}
}  // namespace
void capture_ida_messages(void* memory, std::string& message) { IDASetErrHandlerFn(memory, keep, &message); }
void capture_cvode_messages(void* memory, std::string& message) { CVodeSetErrHandlerFn(memory, keep, &message); }
#else
void capture_ida_messages(void*, std::string&) {}
void capture_cvode_messages(void*, std::string&) {}
#endif

}  // namespace costate
