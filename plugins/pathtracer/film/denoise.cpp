// Denoising by Open Image Denoise, which is loaded when it is first used: builds and installations
// do without it. Declares the few functions of its C interface that are used, equal in versions 1
// and 2.
#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <solidtex/denoise.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex::pathtracer {
namespace {

namespace fs = std::filesystem;

struct OidnDevice;
struct OidnFilter;
constexpr int kCpu = 1, kFloat3 = 3;  // OIDN_DEVICE_TYPE_CPU, OIDN_FORMAT_FLOAT3

constexpr const char* kVariable = "SOLIDTEX_OPENIMAGEDENOISE";

// Names of the library, the first to try first. Besides where programs find libraries, it is where
// `pip install pyoidn` puts it in an active virtual environment.
std::vector<std::string> library_names() {
  if (const char* named = std::getenv(kVariable); named && *named) return {named};
  std::vector<std::string> names{"libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1"};
  if (const char* environment = std::getenv("VIRTUAL_ENV")) {
    std::error_code ignored;
    for (const auto& python : fs::directory_iterator(fs::path(environment) / "lib", ignored)) {
      const fs::path packages = python.path() / "site-packages";
      names.push_back(packages / "pyoidn/oidn/lib/libOpenImageDenoise.so.2");
    }
  }
  return names;
}

void* open_library() {
  std::string reason;
  for (const std::string& name : library_names()) {
    if (void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL)) return library;
    if (reason.empty()) reason = dlerror();
  }
  throw std::runtime_error("denoising: found no Open Image Denoise (" + reason +
                           "), expected it from `pip install pyoidn` in an active virtual "
                           "environment, or its library in " +
                           kVariable);
}

template <class Function>
Function* function(void* library, const char* name) {
  void* found = dlsym(library, name);
  if (!found) {
    throw std::runtime_error(std::string("denoising: Open Image Denoise has no function ") + name);
  }
  return reinterpret_cast<Function*>(found);
}

// The library stays loaded until the program ends.
class Denoiser {
 public:
  Denoiser(int width, int height)
      : library_(open_library()),
        width_(static_cast<std::size_t>(width)),
        height_(static_cast<std::size_t>(height)),
        device_(function<OidnDevice*(int)>(library_, "oidnNewDevice")(kCpu),
                function<void(OidnDevice*)>(library_, "oidnReleaseDevice")) {
    function<void(OidnDevice*)>(library_, "oidnCommitDevice")(device_.get());
    check();
  }

  // One image by itself.
  void prefilter(const char* name, std::vector<float>& values) const {
    const Filter filter = make_filter();
    set_image(filter, name, values);
    set_image(filter, "output", values);
    execute(filter);
  }

  // The auxiliary images are free of noise.
  void run(std::vector<float>& color, std::vector<float>& albedo,
           std::vector<float>& normal) const {
    const Filter filter = make_filter();
    set_image(filter, "color", color);
    set_image(filter, "albedo", albedo);
    set_image(filter, "normal", normal);
    set_image(filter, "output", color);
    set_flag(filter, "hdr");
    set_flag(filter, "cleanAux");
    execute(filter);
  }

 private:
  using Filter = std::unique_ptr<OidnFilter, void (*)(OidnFilter*)>;

  Filter make_filter() const {
    using Make = OidnFilter*(OidnDevice*, const char*);
    return {function<Make>(library_, "oidnNewFilter")(device_.get(), "RT"),
            function<void(OidnFilter*)>(library_, "oidnReleaseFilter")};
  }

  void set_image(const Filter& filter, const char* name, std::vector<float>& values) const {
    using Set = void(OidnFilter*, const char*, void*, int, std::size_t, std::size_t, std::size_t,
                     std::size_t, std::size_t);
    function<Set>(library_, "oidnSetSharedFilterImage")(filter.get(), name, values.data(), kFloat3,
                                                        width_, height_, 0, 0, 0);
  }

  void set_flag(const Filter& filter, const char* name) const {
    using Set = void(OidnFilter*, const char*, bool);
    const bool is_current = dlsym(library_, "oidnSetFilterBool") != nullptr;  // since version 2
    function<Set>(library_, is_current ? "oidnSetFilterBool" : "oidnSetFilter1b")(filter.get(),
                                                                                  name, true);
  }

  void execute(const Filter& filter) const {
    function<void(OidnFilter*)>(library_, "oidnCommitFilter")(filter.get());
    function<void(OidnFilter*)>(library_, "oidnExecuteFilter")(filter.get());
    check();
  }

  void check() const {
    const char* message = nullptr;
    using Error = int(OidnDevice*, const char**);
    if (function<Error>(library_, "oidnGetDeviceError")(device_.get(), &message) != 0) {
      throw std::runtime_error(std::string("denoising: Open Image Denoise: ") +
                               (message ? message : "unknown error"));
    }
  }

  void* library_;
  std::size_t width_, height_;
  std::unique_ptr<OidnDevice, void (*)(OidnDevice*)> device_;
};

std::vector<float>& values(AovImage& image, Aov aov) {
  for (AovImage::Plane& plane : image.planes) {
    if (plane.aov == aov) return plane.values;
  }
  throw std::invalid_argument("denoising: found an image without " + info(aov).name);
}

}  // namespace

void check_denoiser() { open_library(); }

void denoise(AovImage& image) {
  const Denoiser denoiser(image.window.width(), image.window.height());
  std::vector<float> albedo = values(image, Aov::albedo), normal = values(image, Aov::normal);
  denoiser.prefilter("albedo", albedo);
  denoiser.prefilter("normal", normal);
  denoiser.run(values(image, Aov::beauty), albedo, normal);
}

}  // namespace solidtex::pathtracer
