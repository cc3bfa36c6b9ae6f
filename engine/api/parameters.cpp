#include <algorithm>
#include <limits>

#include "engine/api/handle.h"
#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

struct IntegerParameter {
  std::string_view name;
  std::uint64_t Parameters::*value;
  std::uint64_t max = std::numeric_limits<std::uint64_t>::max();
};
constexpr IntegerParameter kIntegers[] = {{"cache_limit_bytes", &Parameters::cache_limit_bytes},
                                          {"period", &Parameters::period},
                                          {"seed", &Parameters::seed},
                                          {"threads", &Parameters::threads, 1024}};

struct StringParameter {
  std::string_view name;
  std::string Parameters::*value;
  std::string_view choices[2];
};
constexpr StringParameter kStrings[] = {{"precision", &Parameters::precision, {"full", "fast"}}};

std::string quoted(std::string_view text) {
  std::string result = "\"";
  return result.append(text).append("\"");
}

[[noreturn]] void refuse(const std::string& message) {
  throw Error(SOLIDTEX_INVALID_ARGUMENT, message);
}

template <class List>
std::string names_of(const List& parameters) {
  std::string names;
  for (const auto& parameter : parameters)
    names += (names.empty() ? "" : ", ") + std::string(parameter.name);
  return names;
}

template <class List>
auto find(const List& parameters, std::string_view name) {
  const auto has_name = [&](const auto& parameter) { return parameter.name == name; };
  const auto found = std::ranges::find_if(parameters, has_name);
  if (found == std::end(parameters))
    refuse("no parameter " + quoted(name) + " of this type; there are the integers " +
           names_of(kIntegers) + " and the string " + names_of(kStrings));
  return found;
}

}  // namespace

void set_integer(Parameters& parameters, std::string_view name, std::uint64_t value) {
  const auto parameter = find(kIntegers, name);
  if (value > parameter->max)
    refuse("parameter " + quoted(name) + " is " + std::to_string(value) + ", expected 0 to " +
           std::to_string(parameter->max));
  parameters.*(parameter->value) = value;
}

void set_string(Parameters& parameters, std::string_view name, std::string_view value) {
  const auto parameter = find(kStrings, name);
  const auto& [first, second] = parameter->choices;
  if (value != first && value != second)
    refuse("parameter " + quoted(name) + " is " + quoted(value) + ", expected " + quoted(first) +
           " or " + quoted(second));
  parameters.*(parameter->value) = value;
}

std::uint64_t get_integer(const Parameters& parameters, std::string_view name) {
  return parameters.*(find(kIntegers, name)->value);
}

const std::string& get_string(const Parameters& parameters, std::string_view name) {
  return parameters.*(find(kStrings, name)->value);
}

}  // namespace solidtex::engine
