// The state of the host's process: floating-point environment, locale, signals, fork.
#include <fcntl.h>
#include <solidtex/solidtex.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cfenv>
#include <clocale>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <locale>
#include <string>
#include <thread>
#include <vector>

#include "catch.hpp"
#include "tiny_model.h"

namespace {

constexpr std::int64_t kEdge = 24;
constexpr std::size_t kPointCount = 3000;

struct Opened {
  solidtex_texture* texture = solidtex_new();
  solidtex_status status;
  explicit Opened(const std::vector<std::byte>& bytes) {
    status = solidtex_open_memory(texture, bytes.data(), bytes.size());
  }
  ~Opened() { solidtex_release(texture); }
};

struct Batch {
  std::vector<float> points, radii;
  Batch() {
    for (std::size_t i = 0; i < 3 * kPointCount; ++i)
      points.push_back(static_cast<float>(i * 7919 % 4001) * 0.13f - 200);
    for (std::size_t i = 0; i < kPointCount; ++i) radii.push_back(static_cast<float>(i % 9));
  }
};

// Opens a model and returns the bits of a box, of points, of their jacobians and of footprints.
std::vector<float> values_of(const std::vector<std::byte>& bytes) {
  static const Batch batch;  // made in the usual mode
  const Opened opened(bytes);
  if (opened.status != SOLIDTEX_OK) return {};
  const std::size_t channels = solidtex_channel_count(opened.texture);
  const std::int64_t origin[3] = {-5, 1 << 20, 7}, size[3] = {kEdge, kEdge, kEdge};
  const float* const points = batch.points.data();
  solidtex_footprints footprints = {};
  footprints.struct_size = sizeof footprints;
  footprints.radii = batch.radii.data();
  const std::size_t box = channels * kEdge * kEdge * kEdge, row = channels * kPointCount;
  std::vector<float> values(box + 5 * row);
  float* const after = values.data() + box;
  if (solidtex_eval_box(opened.texture, origin, size, values.data()) != SOLIDTEX_OK ||
      solidtex_eval(opened.texture, nullptr, points, nullptr, kPointCount, after, after + row) !=
          SOLIDTEX_OK ||
      solidtex_eval(opened.texture, nullptr, points, &footprints, kPointCount, after + 4 * row,
                    nullptr) != SOLIDTEX_OK)
    return {};
  return values;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return !a.empty() && a.size() == b.size() &&
         std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// Runs `test` in a thread of its own, so that the state it sets ends with it.
template <class Test>
void in_thread(const Test& test) {
  std::thread(test).join();
}

#if defined(__x86_64__)
// Flushes denormals, rounds towards zero, or traps: bits of the register MXCSR.
void set_mxcsr(unsigned clear, unsigned set) {
  unsigned word = 0;
  __asm__ volatile("stmxcsr %0" : "=m"(word));
  word = (word & ~clear) | set;
  __asm__ volatile("ldmxcsr %0" : : "m"(word));
}
unsigned mxcsr() {
  unsigned word = 0;
  __asm__ volatile("stmxcsr %0" : "=m"(word));
  return word & ~0x3Fu;  // without the flags of past exceptions
}
#endif

volatile std::sig_atomic_t signal_count = 0;
void count_signal(int) { signal_count = signal_count + 1; }

class Comma : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

const auto models = {&tiny_lattice_file, &tiny_sampler_file};

}  // namespace

#if defined(__x86_64__)
TEST_CASE("host state: denormals, rounding and traps of the host change no bit, and are kept",
          "[host]") {
  constexpr unsigned flush = 0x8040, toward_zero = 0x6000, trapped = 0x0E80;
  for (const auto& model : models) {
    const std::vector<std::byte> bytes = model();
    const std::vector<float> expected = values_of(bytes);
    for (const unsigned mode : {flush, toward_zero, flush | toward_zero}) {
      INFO(mode);
      in_thread([&] {
        set_mxcsr(0, mode);
        const unsigned before = mxcsr();
        const std::vector<float> found = values_of(bytes);
        CHECK(mxcsr() == before);
        set_mxcsr(mode, 0);
        CHECK(same_bits(found, expected));
      });
    }
    in_thread([&] {  // invalid, divide by zero, overflow, underflow: SIGFPE would end the process
      set_mxcsr(trapped, 0);
      const std::vector<float> found = values_of(bytes);
      const bool kept = (mxcsr() & trapped) == 0;
      set_mxcsr(0, trapped);
      CHECK(kept);
      CHECK(same_bits(found, expected));
    });
  }
}
#endif

TEST_CASE("host state: a comma for the decimal point and groups of digits change nothing",
          "[host]") {
  for (const auto& model : models) {
    const std::vector<std::byte> bytes = model();
    const std::vector<float> expected = values_of(bytes);
    const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
    const std::vector<float> found = values_of(bytes);
    const Opened opened(bytes);
    const std::string document = solidtex_metadata_json(opened.texture);
    std::locale::global(before);
    CHECK(same_bits(found, expected));
    const Opened usual(bytes);
    CHECK(document == solidtex_metadata_json(usual.texture));
  }
}

TEST_CASE("host state: signals during queries interrupt nothing", "[host]") {
  for (const auto& model : models) {
    const std::vector<std::byte> bytes = model();
    const std::vector<float> expected = values_of(bytes);
    struct sigaction action = {}, before = {};
    action.sa_handler = count_signal;  // without SA_RESTART: calls of the system are interrupted
    sigaction(SIGALRM, &action, &before);
    itimerval often = {{0, 200}, {0, 200}}, never = {};
    signal_count = 0;
    setitimer(ITIMER_REAL, &often, nullptr);
    int rounds = 0;
    bool same = true;
    while (rounds < 3 || signal_count == 0) {
      same = same && same_bits(values_of(bytes), expected);
      ++rounds;
    }
    setitimer(ITIMER_REAL, &never, nullptr);
    sigaction(SIGALRM, &before, nullptr);
    CHECK(same);
  }
}

TEST_CASE("host state: a forked process uses what its parent has opened", "[host]") {
  for (const auto& model : models) {
    const std::vector<std::byte> bytes = model();
    const std::vector<float> expected = values_of(bytes);
    const Opened opened(bytes);
    const std::size_t channels = solidtex_channel_count(opened.texture);
    const std::int64_t origin[3] = {}, size[3] = {kEdge, kEdge, kEdge};
    std::vector<float> before(channels * kEdge * kEdge * kEdge);
    REQUIRE(solidtex_eval_box(opened.texture, origin, size, before.data()) == SOLIDTEX_OK);
    const pid_t child = fork();
    if (child == 0) {
      alarm(60);  // a child that waits for threads of its parent ends by this signal
      std::vector<float> after(before.size());
      const bool same =
          solidtex_eval_box(opened.texture, origin, size, after.data()) == SOLIDTEX_OK &&
          same_bits(after, before) && same_bits(values_of(bytes), expected);
      _exit(same ? 0 : 1);
    }
    REQUIRE(child > 0);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(same_bits(values_of(bytes), expected));
  }
}
