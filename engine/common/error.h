// The exception type of the engine. api/ turns it into a status and a message.
#pragma once

#include <solidtex/solidtex.h>

#include <stdexcept>
#include <string>

namespace solidtex::engine {

class Error : public std::runtime_error {
 public:
  Error(solidtex_status status, const std::string& message)
      : std::runtime_error(message), status_(status) {}
  solidtex_status status() const { return status_; }

 private:
  solidtex_status status_;
};

}  // namespace solidtex::engine
