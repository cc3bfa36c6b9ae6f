// Pictures: what a render gives, layer by layer, and how it is shown and written.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

namespace solidtex::pathtracer {

// What a picture can hold of each pixel; docs/rendering.md has the table of units and means.
enum class Layer : std::uint32_t {
  beauty,     // light that arrives, linear RGB
  albedo,     // colour of the first surface, linear RGB
  normal,     // its shading normal in the scene's space, towards the camera
  depth,      // its distance from the camera along the view direction
  position,   // where it is, in the scene's space
  texcoord,   // where that is in its solid texture, in texels
  footprint,  // radius of what the sample sees of it, in texels
  cost,       // points that the sample's path asked of solid textures
  variance,   // of the beauty's mean, per channel
  samples     // how many there are
};
inline constexpr std::size_t kLayerCount = 10;

struct LayerInfo {
  Layer layer;
  std::string name;
  std::vector<std::string> channels;  // as an EXR names them: "albedo.R"; of the beauty "R"
};

// All of them, in the order of the enumeration.
const std::vector<LayerInfo>& all_layers();
inline const LayerInfo& info(Layer layer) { return all_layers()[static_cast<std::size_t>(layer)]; }

class LayerSet {
 public:
  LayerSet() = default;
  LayerSet(std::initializer_list<Layer> layers) {
    for (const Layer layer : layers) add(layer);
  }
  void add(Layer layer) { bits_ |= bit(layer); }
  bool has(Layer layer) const { return (bits_ & bit(layer)) != 0; }
  bool has_any(const LayerSet& others) const { return (bits_ & others.bits_) != 0; }
  bool empty() const { return bits_ == 0; }
  bool operator==(const LayerSet&) const = default;

 private:
  static std::uint32_t bit(Layer layer) { return 1u << static_cast<std::uint32_t>(layer); }
  std::uint32_t bits_ = 0;
};

// Pixels x0 <= x < x1, y0 <= y < y1; row 0 is the top.
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

// RGB, row 0 on top, 3 floats a pixel.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgb;
};

// The layers of a picture, or of a window of it.
struct Picture {
  struct Plane {
    Layer layer;
    std::vector<float> values;  // of the window, row 0 on top, the layer's channels side by side
  };

  int width = 0, height = 0;  // of the whole picture
  Window window;              // what is here of it
  std::vector<Plane> planes;  // in the order of the enumeration

  // Throws std::out_of_range when the picture does not have the layer.
  const std::vector<float>& values(Layer layer) const;
};

// The beauty alone, of the window.
Image beauty_of(const Picture& picture);

// How linear light becomes a picture on a screen.
enum class ViewTransform {
  srgb,        // clamped to [0, 1], sRGB curve
  filmic,      // Hable's curve, light of 5.6 is white
  aces,        // Narkowicz's fit of the ACES reference rendering
  false_color  // stops above and below middle grey, 0.18, by colours
};

const std::map<std::string, ViewTransform>& view_transforms();  // by their names

struct Display {
  float exposure = 0;  // stops by which light is brightened first
  ViewTransform transform = ViewTransform::srgb;
};

// Encoded for a screen, from 0 to 1.
Image show(const Image& light, const Display& display);

// Any layer for a look at it; all but beauty and albedo by colours of our choice.
struct View {
  Image encoded;
  std::string legend;  // what black and white, or the colours, stand for
};
View show(const Picture& picture, Layer layer, const Display& display);

// Linear EXR with 32-bit float channels, named as LayerInfo says; a window keeps its place.
// These throw std::runtime_error, naming the file, when it cannot be written completely.
void write_exr(const Picture& picture, const std::filesystem::path& file);
void write_exr(const Image& image, const std::filesystem::path& file);

// 8 bits a channel; of values that are encoded already.
void write_png(const Image& encoded, const std::filesystem::path& file);

}  // namespace solidtex::pathtracer
