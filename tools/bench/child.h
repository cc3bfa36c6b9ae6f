// Another program, run to its end.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace solidtex::tools {

struct ChildUsage {
  double wall_seconds = 0, cpu_seconds = 0;
  std::uint64_t peak_resident_bytes = 0;
};

// Runs a program whose standard output is thrown away. Throws when it fails, with what it was, and
// Interrupted after Ctrl-C, when it has stopped the program.
ChildUsage run_child(const std::vector<std::string>& command);

// A program in the folder of this one.
std::filesystem::path sibling_program(const std::string& name);

}  // namespace solidtex::tools
