// ONNX Runtime is loaded when it is first needed: libsolidtex does not depend on it.
#include "engine/space/encoder.h"

#include "engine/common/error.h"

#ifdef SOLIDTEX_ONNXRUNTIME_NAME
#define ORT_API_MANUAL_INIT
#include <dlfcn.h>
#include <onnxruntime_cxx_api.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

namespace solidtex::engine {
namespace {

constexpr std::size_t max_memory = std::size_t{1} << 30;  // for values between layers
constexpr std::size_t batch = 8;                          // patches at a time
constexpr const char* input_name = "patches";
constexpr const char* output_name = "codes";

// Places of the library: a path in SOLIDTEX_ONNXRUNTIME, in the folder solidtex beside
// libsolidtex, the system's folders.
std::vector<std::string> library_candidates() {
  std::vector<std::string> result;
  if (const char* chosen = std::getenv("SOLIDTEX_ONNXRUNTIME"); chosen && *chosen) return {chosen};
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&library_candidates), &info) != 0 && info.dli_fname) {
    std::error_code ignored;
    const auto folder = std::filesystem::canonical(info.dli_fname, ignored).parent_path();
    if (!folder.empty()) result.push_back(folder / "solidtex/libonnxruntime.so.1");
  }
  for (const char* name : {SOLIDTEX_ONNXRUNTIME_NAME, "libonnxruntime.so.1", "libonnxruntime.so"})
    result.emplace_back(name);
  return result;
}

Error unavailable(const std::string& reason) {
  return Error(SOLIDTEX_UNAVAILABLE,
               "encoding a photograph needs ONNX Runtime: " + reason +
                   "; install it (Debian 13: apt-get install libonnxruntime-dev; elsewhere: pip "
                   "install onnxruntime) or name its libonnxruntime.so in the environment variable "
                   "SOLIDTEX_ONNXRUNTIME");
}

// ONNX Runtime's own builds since 1.29 report their use to Microsoft, and write files in the home
// folder, unless this variable is set when an environment is made. A host's own value stays.
void switch_off_telemetry() { setenv("ORT_DISABLE_TELEMETRY", "1", 0); }

const OrtApi& load_api() {
  switch_off_telemetry();
  std::string problem;
  for (const std::string& candidate : library_candidates()) {
    void* library = dlopen(candidate.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!library) {
      problem += (problem.empty() ? "" : "; ") + std::string(dlerror());
      continue;
    }
    const auto get_base =
        reinterpret_cast<const OrtApiBase* (*)()>(dlsym(library, "OrtGetApiBase"));
    const OrtApi* api = get_base ? get_base()->GetApi(ORT_API_VERSION) : nullptr;
    if (api) return *api;
    problem += (problem.empty() ? "" : "; ") + candidate + " is older than version 1." +
               std::to_string(ORT_API_VERSION);
    dlclose(library);
  }
  throw unavailable(problem);
}

// Debian 13's ONNX Runtime registers all operators twice, and says so on std::cerr, in 570 lines.
class QuietErrors {
 public:
  ~QuietErrors() { std::cerr.rdbuf(buffer_); }

 private:
  std::streambuf* buffer_ = std::cerr.rdbuf(nullptr);
};

// Lives as long as the process: the library's threads may outlast every texture.
const Ort::Env& environment() {
  static const Ort::Env& instance = [&]() -> const Ort::Env& {
    Ort::InitApi(&load_api());
    const QuietErrors quiet;
    auto* env = new Ort::Env(ORT_LOGGING_LEVEL_FATAL, "solidtex");
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
    env->CreateAndRegisterAllocator(memory, Ort::ArenaCfg(max_memory, -1, -1, -1));
    return *env;
  }();
  return instance;
}

std::string show(const std::vector<std::int64_t>& shape) {
  std::string result;
  for (const std::int64_t size : shape)
    result += (result.empty() ? "" : ", ") + (size < 0 ? "n" : std::to_string(size));
  return "[" + result + "]";
}

Ort::Session make_session(const Space& space) {
  const Ort::Env& env = environment();  // first: it initializes the interface
  Ort::SessionOptions options;
  options.SetLogSeverityLevel(ORT_LOGGING_LEVEL_FATAL);
  options.SetGraphOptimizationLevel(ORT_DISABLE_ALL);  // constants are not folded without a limit
  options.AddConfigEntry("session.use_env_allocators", "1");
  options.AddConfigEntry("session.intra_op.allow_spinning", "0");
  return {env, space.encoder.data(), space.encoder.size(), options};
}

}  // namespace

struct Encoder::Network {
  std::string where;  // begins a message
  std::int64_t side, code_size;
  Ort::Session session;

  explicit Network(const Space& space)
      : where(space.label + ": encoder"),
        side(space.patch),
        code_size(static_cast<std::int64_t>(space.code_size)),
        session(make_session(space)) {
    check("inputs", session.GetInputCount(), input_name, {-1, 3, side, side});
    check("outputs", session.GetOutputCount(), output_name, {-1, code_size});
  }

  Error refuse(const std::string& found, const std::string& expected) const {
    return Error(SOLIDTEX_INVALID_MODEL, where + ": found " + found + ", expected " + expected);
  }

  void check(const std::string& what, std::size_t count, const std::string& name,
             const std::vector<std::int64_t>& shape) const {
    const bool is_input = name == input_name;
    const std::string expected = "\"" + name + "\" of shape " + show(shape) + ", float32";
    if (count != 1) throw refuse(std::to_string(count) + " " + what, "one, " + expected);
    Ort::AllocatorWithDefaultOptions memory;
    const auto found = is_input ? session.GetInputNameAllocated(0, memory)
                                : session.GetOutputNameAllocated(0, memory);
    const auto type = is_input ? session.GetInputTypeInfo(0) : session.GetOutputTypeInfo(0);
    if (type.GetONNXType() != ONNX_TYPE_TENSOR)
      throw refuse(what + " that are no tensor", expected);
    const auto tensor = type.GetTensorTypeAndShapeInfo();
    const auto sizes = tensor.GetShape();
    if (found.get() != name || sizes != shape ||
        tensor.GetElementType() != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT)
      throw refuse("\"" + std::string(found.get()).substr(0, 60) + "\" of shape " + show(sizes),
                   expected);
  }

  // Appends the codes of up to `batch` patches.
  void run(std::span<const float> patches, std::vector<std::vector<float>>& codes) {
    const auto count = static_cast<std::int64_t>(patches.size()) / (3 * side * side);
    const std::array<std::int64_t, 4> shape{count, 3, side, side};
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
    const auto input = Ort::Value::CreateTensor<float>(memory, const_cast<float*>(patches.data()),
                                                       patches.size(), shape.data(), shape.size());
    const auto outputs =
        session.Run(Ort::RunOptions{nullptr}, &input_name, &input, 1, &output_name, 1);
    const auto sizes = outputs.front().GetTensorTypeAndShapeInfo().GetShape();
    if (sizes != std::vector<std::int64_t>{count, code_size})
      throw refuse("codes of shape " + show(sizes),
                   show({count, code_size}) + " for " + std::to_string(count) + " patches");
    const float* values = outputs.front().GetTensorData<float>();
    for (std::int64_t i = 0; i < count; ++i, values += code_size) {
      codes.emplace_back(values, values + code_size);
      for (const float value : codes.back())
        if (!std::isfinite(value)) throw refuse("a code that is not finite", "finite numbers");
    }
  }
};

namespace {

// Runs a call of ONNX Runtime; its exceptions become ours, in one line.
template <class Call>
void translated(const std::string& where, const Call& call) {
  try {
    call();
  } catch (const Ort::Exception& error) {
    std::string text = error.what();
    text = text.substr(0, text.find('\n')).substr(0, 300);
    throw Error(SOLIDTEX_INVALID_MODEL, where + ": ONNX Runtime refuses it: " + text);
  }
}

}  // namespace

Encoder::Encoder(const Space& space) {
  translated(space.label + ": encoder", [&] { network_ = std::make_unique<Network>(space); });
}

std::vector<std::vector<float>> Encoder::codes(std::span<const float> patches) const {
  std::vector<std::vector<float>> result;
  const auto stride = static_cast<std::size_t>(batch * 3 * network_->side * network_->side);
  translated(network_->where, [&] {
    for (std::size_t begin = 0; begin < patches.size(); begin += stride)
      network_->run(patches.subspan(begin, std::min(stride, patches.size() - begin)), result);
  });
  return result;
}

#else

namespace solidtex::engine {

struct Encoder::Network {};

Encoder::Encoder(const Space&) {
  throw Error(
      SOLIDTEX_UNAVAILABLE,
      "encoding a photograph needs ONNX Runtime, and this libsolidtex was built without its "
      "headers: install them (Debian 13: libonnxruntime-dev; Debian 12: ./demo.sh), "
      "configure and build again");
}

std::vector<std::vector<float>> Encoder::codes(std::span<const float>) const { return {}; }

#endif

Encoder::~Encoder() = default;
Encoder::Encoder(Encoder&&) noexcept = default;

}  // namespace solidtex::engine
