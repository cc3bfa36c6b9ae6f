// Rendered images: their AOVs (arbitrary output variables), display transforms, EXR and PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

// What an image holds of each pixel. docs/rendering.md has the table of units and means.
enum class Aov : std::uint32_t {
  beauty,     // incident radiance, linear RGB
  albedo,     // of the first surface, linear RGB
  normal,     // shading normal of the first surface, in world space, towards the camera
  depth,      // distance of the first surface from the camera along the view direction
  position,   // of the first surface, in world space
  texcoord,   // of the first surface in its solid texture, in texels
  footprint,  // radius of the sample's footprint on the first surface, in texels
  cost,       // solid texture points evaluated for the sample's path
  variance,   // of the beauty's mean, per channel
  samples     // number of samples
};
inline constexpr std::size_t kAovCount = 10;

struct AovInfo {
  Aov aov;
  std::string name;
  std::vector<std::string> channels;  // names in an EXR: "albedo.R"; of the beauty "R"
};

// All AOVs, in the order of the enumeration.
const std::vector<AovInfo>& all_aovs();
inline const AovInfo& info(Aov aov) { return all_aovs()[static_cast<std::size_t>(aov)]; }

class AovSet {
 public:
  AovSet() = default;
  AovSet(std::initializer_list<Aov> aovs) {
    for (const Aov aov : aovs) add(aov);
  }
  void add(Aov aov) { bits_ |= bit(aov); }
  bool has(Aov aov) const { return (bits_ & bit(aov)) != 0; }
  bool has_any(const AovSet& others) const { return (bits_ & others.bits_) != 0; }
  bool empty() const { return bits_ == 0; }
  bool operator==(const AovSet&) const = default;

 private:
  static std::uint32_t bit(Aov aov) { return 1u << static_cast<std::uint32_t>(aov); }
  std::uint32_t bits_ = 0;
};

// Pixels x0 <= x < x1, y0 <= y < y1. Row 0 is the top.
struct Window {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool empty() const { return x1 <= x0 || y1 <= y0; }
  std::size_t pixel_count() const {
    return static_cast<std::size_t>(width()) * static_cast<std::size_t>(height());
  }
  bool operator==(const Window&) const = default;
};

// RGB, 3 floats a pixel. Row 0 is the top.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgb;
};

// The AOVs of an image, or of a window of it.
struct AovImage {
  struct Plane {
    Aov aov;
    std::vector<float> values;  // of the window's pixels, channels interleaved, row 0 on top
  };

  int width = 0, height = 0;  // of the full image (OpenEXR's display window)
  Window window;              // the pixels held here (OpenEXR's data window)
  std::vector<Plane> planes;  // in the order of the enumeration

  // Throws std::out_of_range if the image does not hold the AOV.
  const std::vector<float>& values(Aov aov) const;
};

// The beauty of the window's pixels.
Image beauty(const AovImage& image);

// Maps linear light to display values.
enum class ViewTransform {
  srgb,        // clamps to [0, 1], applies the sRGB curve
  filmic,      // Hable's curve; radiance 5.6 is white
  aces,        // Narkowicz's fit of the ACES reference rendering transform
  false_color  // color ramp of the stops above and below middle gray, 0.18
};

const std::map<std::string, ViewTransform>& view_transforms();  // by name

struct Display {
  float exposure = 0;  // stops, applied before the view transform
  ViewTransform transform = ViewTransform::srgb;
};

// Returns display values from 0 to 1.
Image to_display(const Image& light, const Display& display);

// An AOV as a viewable image.
struct Visualization {
  Image encoded;
  std::string legend;  // what black and white, or the colors, stand for
};
// `display` applies to the beauty only.
Visualization visualize(const AovImage& image, Aov aov, const Display& display);

// Writes a linear EXR with 32-bit float channels, named as in AovInfo. The window becomes the data
// window. The write functions throw std::runtime_error, naming the file, if it cannot be written
// completely.
void write_exr(const AovImage& image, const std::filesystem::path& file);
void write_exr(const Image& image, const std::filesystem::path& file);

// Writes 8 bits a channel. `encoded` holds display values.
void write_png(const Image& encoded, const std::filesystem::path& file);

}  // namespace solidtex::pathtracer
