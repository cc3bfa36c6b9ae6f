// Exceptions of the module, from the statuses of solidtex.h.
#pragma once

#include <nanobind/nanobind.h>
#include <solidtex/solidtex.h>

#include <string>

namespace nb = nanobind;

// Names of the exceptions in solidtex/errors.py, by solidtex_status.
inline constexpr const char* kExceptions[] = {nullptr,      "InvalidArgument", "FileError",
                                              "ModelError", "OutOfMemory",     "InternalError",
                                              "Cancelled",  "Unavailable"};

[[noreturn]] inline void raise(solidtex_status status, const std::string& message) {
  const nb::object type = nb::module_::import_("solidtex.errors").attr(kExceptions[status]);
  PyErr_SetString(type.ptr(), message.c_str());
  throw nb::python_error();
}

inline void check(solidtex_status status) {
  if (status != SOLIDTEX_OK) raise(status, solidtex_error_message());
}

inline void require(bool condition, const std::string& message) {
  if (!condition) raise(SOLIDTEX_INVALID_ARGUMENT, message);
}

inline std::string text(const char* found) { return found ? found : ""; }
