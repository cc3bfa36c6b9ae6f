// Memory that is refused at the N-th allocation, for all N:
//   solidtex_refused_memory [--every=K] MODEL... [--spaces SPACE...] [--encode SPACE...]
//
// Each N has a process of its own. A call must end with the status "out of memory" or, where it can
// do without, with the right values; the same call must succeed afterwards; and nothing may leak.
#include <malloc.h>
#include <solidtex/solidtex.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
}

namespace {

std::atomic<long> until_refusal = 0;  // allocations; 0: none is refused
std::atomic<bool> for_good = false;   // all later ones are refused too
std::atomic<long> count = 0, live = 0;

bool is_refused() {
  ++count;
  if (until_refusal == 0) return false;
  if (until_refusal > 1) return --until_refusal, false;
  if (!for_good) until_refusal = 0;
  errno = ENOMEM;
  return true;
}

void* counted(void* memory) {
  if (memory) ++live;
  return memory;
}

}  // namespace

extern "C" {
void* malloc(std::size_t size) { return is_refused() ? nullptr : counted(__libc_malloc(size)); }
void* calloc(std::size_t number, std::size_t size) {
  return is_refused() ? nullptr : counted(__libc_calloc(number, size));
}
void* realloc(void* memory, std::size_t size) {
  if (is_refused()) return nullptr;
  return memory ? __libc_realloc(memory, size) : counted(__libc_realloc(memory, size));
}
void* memalign(std::size_t alignment, std::size_t size) {
  return is_refused() ? nullptr : counted(__libc_memalign(alignment, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  *memory = memalign(alignment, size);
  return *memory ? 0 : ENOMEM;
}
void free(void* memory) {
  if (memory) --live;
  __libc_free(memory);
}
}

namespace {

constexpr std::size_t kPointCount = 2;
constexpr std::int64_t kEdge = 2;

enum Outcome { same_values = 0, out_of_memory, wrong_status, wrong_values, not_repeated, leak };
const char* const names[] = {"same values",  "out of memory",         "another status",
                             "other values", "no success afterwards", "a leak"};

// Calls of the library. Values go to memory that is there already.
struct Scenario {
  std::string name;
  std::function<solidtex_status(float* values)> run;
  std::size_t value_count;
};

// Evaluates everything that `open` opens.
template <class Open>
Scenario evaluation(const std::string& name, std::size_t channels, const Open& open) {
  const std::size_t box = channels * kEdge * kEdge * kEdge, row = channels * kPointCount;
  static const std::vector<float> points = [] {
    std::vector<float> made;
    for (std::size_t i = 0; i < 3 * kPointCount; ++i)
      made.push_back(static_cast<float>(i * 7919 % 251));
    return made;
  }();
  static const std::vector<float> radii(kPointCount, 2.5f);
  const auto run = [=](float* values) {
    static const std::int64_t origin[3] = {-2, 100, 3}, size[3] = {kEdge, kEdge, kEdge};
    solidtex_texture* texture = solidtex_new();
    if (!texture) return solidtex_error_status();
    solidtex_footprints footprints = {};
    footprints.struct_size = sizeof footprints;
    footprints.radii = radii.data();
    solidtex_status status = solidtex_set_integer(texture, "threads", 1);
    if (status == SOLIDTEX_OK) status = open(texture);
    if (status == SOLIDTEX_OK) status = solidtex_eval_box(texture, origin, size, values);
    if (status == SOLIDTEX_OK)
      status = solidtex_eval(texture, nullptr, points.data(), nullptr, kPointCount, values + box,
                             values + box + row);
    if (status == SOLIDTEX_OK)
      status = solidtex_eval(texture, nullptr, points.data(), &footprints, kPointCount,
                             values + box + 4 * row, nullptr);
    solidtex_release(texture);
    return status;
  };
  return {name, run, box + 5 * row};
}

std::vector<char> read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Runs a call in a process of its own. Returns its exit code, or minus the signal that ended it.
// This process never calls the library, so that each child finds it as after its start.
template <class Call>
int in_child(const Call& call) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    alarm(120);
    const int code = static_cast<int>(call());
    std::fflush(stdout);
    std::_Exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

std::size_t channel_count(const std::string& model) {
  return static_cast<std::size_t>(in_child([&] {
    solidtex_texture* texture = solidtex_new();
    solidtex_open(texture, model.c_str());
    return solidtex_channel_count(texture);
  }));
}

// Memory that children share with this process.
template <class T>
T* shared(std::size_t count) {
  return static_cast<T*>(
      mmap(nullptr, count * sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
}

void add_model(std::vector<Scenario>& scenarios, const std::string& path) {
  const std::size_t channels = channel_count(path);
  const std::vector<char> bytes = read(path);
  scenarios.push_back(evaluation(path, channels, [=](solidtex_texture* texture) {
    return solidtex_open(texture, path.c_str());
  }));
  scenarios.push_back(evaluation(path + " in memory", channels, [=](solidtex_texture* texture) {
    return solidtex_open_memory(texture, bytes.data(), bytes.size());
  }));
}

// Opens the model of a photograph: the space's first, or one that its encoder reads.
solidtex_status open_material(const solidtex_space* space, bool encodes,
                              solidtex_texture* texture) {
  constexpr std::size_t side = 160;
  static float pixels[3 * side * side], code[4096], colors[12];
  std::ranges::fill(pixels, 0.5f);
  const solidtex_status status =
      encodes
          ? solidtex_space_encode(space, pixels, side, side, SOLIDTEX_PATCHES_AVERAGE, code, colors)
          : solidtex_space_photograph(space, 0, code, colors);
  return status == SOLIDTEX_OK ? solidtex_space_texture(space, code, colors, nullptr, texture)
                               : status;
}

void add_space(std::vector<Scenario>& scenarios, const std::string& path, bool encodes) {
  const std::string name = path + (encodes ? ", encoding" : "");
  scenarios.push_back(evaluation(name, 3, [=](solidtex_texture* texture) {
    solidtex_space* space = solidtex_space_open(path.c_str());
    if (!space) return solidtex_error_status();
    const solidtex_status status = open_material(space, encodes, texture);
    solidtex_space_release(space);
    return status;
  }));
}

Outcome judge(solidtex_status status, const Scenario& scenario, const float* found,
              const float* expected) {
  if (status == SOLIDTEX_OUT_OF_MEMORY && solidtex_error_message()[0]) return out_of_memory;
  if (status != SOLIDTEX_OK) {
    std::printf("  status %d: %s\n", static_cast<int>(status), solidtex_error_message());
    return wrong_status;
  }
  const bool same = std::memcmp(found, expected, scenario.value_count * sizeof(float)) == 0;
  return same ? same_values : wrong_values;
}

// Returns the status of the calls if their n-th allocation is refused.
solidtex_status run_refused(const Scenario& scenario, long n, float* values) {
  until_refusal = n;
  const solidtex_status status = scenario.run(values);
  until_refusal = 0;
  return status;
}

// What happens if the n-th allocation is refused. `is_warm`: the calls have succeeded before.
Outcome refuse(const Scenario& scenario, long n, bool is_warm, const float* expected) {
  std::vector<float> found(scenario.value_count);
  float* const values = found.data();
  tbb::task_arena(1).initialize();  // oneTBB waits for ever if its own start lacked memory
  try {  // the C library loads what unwinds the stack at the first exception of a process
    throw n;
  } catch (long) {
  }
  if (is_warm) scenario.run(values);
  const Outcome outcome = judge(run_refused(scenario, n, values), scenario, values, expected);
  if (outcome > out_of_memory) return outcome;
  solidtex_clear_error();
  if (judge(scenario.run(values), scenario, values, expected) != same_values) return not_repeated;
  if (!is_warm) return outcome;
  const long before = live;  // all that is kept for later calls is there
  run_refused(scenario, n, values);
  solidtex_clear_error();
  scenario.run(values);
  return live > before ? leak : outcome;
}

// Returns the number of findings.
int run(const Scenario& scenario, long every) {
  float* const expected = shared<float>(scenario.value_count);
  long* const allocations = shared<long>(1);
  const int failed = in_child([&] {
    const long begin = count;
    const solidtex_status status = scenario.run(expected);
    *allocations = count - begin;
    if (status != SOLIDTEX_OK) std::printf("%s\n", solidtex_error_message());
    return status;
  });
  if (failed != 0) return 1;
  long outcomes[leak + 1] = {}, runs = 0, findings = 0;
  for (long n = 1; n <= *allocations; n += every) {
    for (const bool is_warm : {false, true}) {
      for_good = runs++ / 2 % 2 == 1;
      const int outcome = in_child([&] { return refuse(scenario, n, is_warm, expected); });
      if (outcome >= 0) ++outcomes[outcome];
      if (outcome == same_values || outcome == out_of_memory) continue;
      ++findings;
      std::printf("  %s, allocation %ld%s%s: %s\n", scenario.name.c_str(), n,
                  for_good ? " and later ones" : "", is_warm ? ", not the first call" : "",
                  outcome < 0 ? strsignal(-outcome) : names[outcome]);
    }
  }
  std::printf("%s: %ld allocations, %ld runs, %ld out of memory, %ld went on, %ld findings\n",
              scenario.name.c_str(), *allocations, runs, outcomes[out_of_memory],
              outcomes[same_values], findings);
  return static_cast<int>(findings);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<Scenario> scenarios;
  long every = 1;
  std::string kind = "--models";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.starts_with("--every="))
      every = std::stol(argument.substr(8));
    else if (argument.starts_with("--"))
      kind = argument;
    else if (kind == "--models")
      add_model(scenarios, argument);
    else
      add_space(scenarios, argument, kind == "--encode");
  }
  int findings = 0;
  for (const Scenario& scenario : scenarios) findings += run(scenario, every);
  return findings == 0 ? 0 : 1;
}
