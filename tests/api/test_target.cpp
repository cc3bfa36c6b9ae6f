// SOLIDTEX_TARGET through the public library: the same bits on every instruction set. A process
// reads the variable once, so each case runs this program again for a hidden test case.
#include <sys/wait.h>

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <solidtex/solidtex.hpp>
#include <string>
#include <vector>

#include "catch.hpp"

namespace {

struct Outcome {
  int status;
  std::string text;
};

Outcome run_with_target(const std::string& target) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");
  const std::string command = "SOLIDTEX_TARGET='" + target + "' '" + self + "' 'print values' 2>&1";
  std::FILE* pipe = popen(command.c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::string text;
  char buffer[4096];
  while (const std::size_t count = std::fread(buffer, 1, sizeof buffer, pipe))
    text.append(buffer, count);
  return {WEXITSTATUS(pclose(pipe)), text};
}

// Returns the text from `begin` to the end of its line.
std::string line_after(const std::string& text, const std::string& begin) {
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return "";
  return text.substr(at + begin.size(), text.find('\n', at) - at - begin.size());
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> names;
  for (std::size_t begin = 0, end = 0; end != std::string::npos && !list.empty(); begin = end + 2) {
    end = list.find(", ", begin);
    names.push_back(list.substr(begin, end == std::string::npos ? end : end - begin));
  }
  return names;
}

void print_bits(const std::vector<float>& values) {
  for (const float value : values) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    std::printf("%08x", bits);
  }
}

}  // namespace

TEST_CASE("print values", "[.]") {
  std::string target, message;
  try {
    target = solidtex::target();
  } catch (const solidtex::error& error) {
    message = error.what();
  }
  if (target.empty()) {  // opening fails in the same way
    CHECK_THROWS_WITH(solidtex::texture("granite-grey"), message);
    std::printf("refused: %s\n", message.c_str());
    FAIL();
  }
  std::printf("target: %s\nvalues: ", target.c_str());
  for (const char* model : {"granite-grey", "stone-grey"}) {
    const solidtex::texture texture(model, {.seed = 4});
    std::vector<float> box(2 * 3 * 5 * texture.channel_count());
    texture.eval_box({-7, 1 << 30, 31}, {2, 3, 5}, box);
    print_bits(box);
    const std::vector<float> points{0.25f, 1.5f, -3.75f, 100.125f, -20, 7};
    std::vector<float> values(2 * texture.channel_count());
    texture.eval_points({1e6, 0, -12}, points, values);
    print_bits(values);
    const solidtex::texture fast(model, {.precision = "fast"});
    fast.eval_points({}, points, values);
    CHECK(solidtex::target() == target);
  }
  std::printf("\n");
}

TEST_CASE("target: the same bits on every instruction set of the machine", "[target]") {
  const Outcome refused = run_with_target("ABACUS");
  CHECK(refused.status != 0);
  const std::string message = line_after(refused.text, "refused: ");
  CHECK(message.find("SOLIDTEX_TARGET is \"ABACUS\"") != std::string::npos);
  const auto names = split(line_after(message, "that this machine has: "));
  REQUIRE(!names.empty());

  const Outcome best = run_with_target("");
  REQUIRE(best.status == 0);
  CHECK(line_after(best.text, "target: ") == names.front());
  const std::string expected = line_after(best.text, "values: ");
  CHECK(expected.size() == 2 * (30 + 2) * 3 * 8);
  for (const std::string& name : names) {
    INFO(name);
    const Outcome found = run_with_target(name);
    CHECK(found.status == 0);
    CHECK(line_after(found.text, "target: ") == name);
    CHECK(line_after(found.text, "values: ") == expected);
  }
}
