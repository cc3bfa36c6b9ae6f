// What a texture can be told before it is open, by name.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace solidtex::engine {

struct Parameters {
  std::uint64_t seed = 0, cache_limit_bytes = std::uint64_t{256} << 20, threads = 0;
  std::string precision = "full";
};

// All throw Error for a name that is not there, and list those that are; setting also for a value
// that is out of range.
void set_integer(Parameters& parameters, std::string_view name, std::uint64_t value);
void set_string(Parameters& parameters, std::string_view name, std::string_view value);
std::uint64_t get_integer(const Parameters& parameters, std::string_view name);
const std::string& get_string(const Parameters& parameters, std::string_view name);

}  // namespace solidtex::engine
