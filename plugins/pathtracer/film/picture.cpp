#include <solidtex/picture.hpp>
#include <stdexcept>

namespace solidtex::pathtracer {

const std::vector<LayerInfo>& all_layers() {
  static const std::vector<LayerInfo> layers = {
      {Layer::beauty, "beauty", {"R", "G", "B"}},
      {Layer::albedo, "albedo", {"albedo.R", "albedo.G", "albedo.B"}},
      {Layer::normal, "normal", {"normal.X", "normal.Y", "normal.Z"}},
      {Layer::depth, "depth", {"depth.Z"}},
      {Layer::position, "position", {"position.X", "position.Y", "position.Z"}},
      {Layer::texcoord, "texcoord", {"texcoord.X", "texcoord.Y", "texcoord.Z"}},
      {Layer::footprint, "footprint", {"footprint.radius"}},
      {Layer::cost, "cost", {"cost.points"}},
      {Layer::variance, "variance", {"variance.R", "variance.G", "variance.B"}},
      {Layer::samples, "samples", {"samples.count"}}};
  return layers;
}

const std::vector<float>& Picture::values(Layer layer) const {
  for (const Plane& plane : planes) {
    if (plane.layer == layer) return plane.values;
  }
  throw std::out_of_range("the picture has no layer " + info(layer).name);
}

Image beauty_of(const Picture& picture) {
  return {picture.window.width(), picture.window.height(), picture.values(Layer::beauty)};
}

}  // namespace solidtex::pathtracer
