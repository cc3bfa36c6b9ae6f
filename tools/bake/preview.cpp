#include "tools/bake/preview.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/bake/channels.h"
#include "tools/bake/cut_cube.h"
#include "tools/bake/image_file.h"
#include "tools/common/cli.h"
#include "tools/common/progress.h"

namespace solidtex::tools {
namespace {

constexpr int panel = 720, gap = 24, margin = 32;
constexpr int slice = (panel - gap) / 2;
constexpr int width = 3 * margin + 2 * panel, height = 2 * margin + panel;
constexpr int subpixels = 2;  // per axis
constexpr int tile_rows = 4;
constexpr std::int64_t min_edge = 128, max_edge = 192;

// Linear display colors of points in the unit cube, which is `edge_` texels long and begins at the
// volume's origin.
class Material {
 public:
  Material(const Volume& volume, const std::string& group)
      : volume_(volume),
        group_(channel_group(volume.texture, group)),
        edge_(static_cast<double>(std::clamp(
            *std::max_element(volume.size.begin(), volume.size.end()), min_edge, max_edge))) {}

  std::vector<glm::dvec3> colors(const std::vector<glm::dvec3>& points) const {
    std::vector<float> texels;
    for (const glm::dvec3& point : points)
      for (int axis = 0; axis < 3; ++axis)
        texels.push_back(static_cast<float>(edge_ * point[axis]));
    std::vector<float> values(points.size() * volume_.channels());
    const Index3& o = volume_.origin;
    volume_.texture.eval_points(
        {static_cast<double>(o[0]), static_cast<double>(o[1]), static_cast<double>(o[2])}, texels,
        values);
    std::vector<glm::dvec3> result;
    for (std::size_t i = 0; i < points.size(); ++i)
      result.push_back(color_of(&values[i * volume_.channels()]));
    return result;
  }

 private:
  // Single channels and plain data are shown in gray, as sRGB-encoded values.
  glm::dvec3 color_of(const float* values) const {
    glm::dvec3 color;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t channel = group_.channels[i % group_.channels.size()];
      const float value = std::clamp(values[channel], 0.0f, 1.0f);
      color[static_cast<int>(i)] =
          group_.encoding == Encoding::linear ? value : srgb_to_linear(value);
    }
    return color;
  }

  Volume volume_;
  ChannelGroup group_;
  double edge_;
};

void set_pixel(Image& image, int x, int y, const glm::dvec3& linear) {
  for (int i = 0; i < 3; ++i) image.pixel(x, y)[i] = linear_to_srgb(static_cast<float>(linear[i]));
}

// Weight of the floor's shadows: they fade out towards the border of the panel.
double fade(double x, double y) {
  constexpr double border = 0.15;
  const double inside = std::min({x, 1 - x, y, 1 - y});
  const double t = std::clamp(inside / border, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// The result of one camera ray: light times the color of the cube, evaluated later, or of the
// backdrop.
struct View {
  double light = 1;
  bool on_cube = false;
};

// (x, y) in [0, 1] from the panel's top left. Points on the cube are added to `cube_points`.
View trace(double x, double y, SampleSequence& samples, std::vector<glm::dvec3>& cube_points) {
  const Ray ray = camera_ray(x, y);
  if (const auto hit = intersect_cut_cube(ray)) {
    cube_points.push_back(hit->point);
    return {irradiance(hit->point, hit->normal, samples), true};
  }
  if (ray.direction[2] >= 0) return {};
  const glm::dvec3 floor = ray.origin + (-ray.origin[2] / ray.direction[2]) * ray.direction;
  return {1 - fade(x, y) * (1 - irradiance(floor, {0, 0, 1}, samples)), false};
}

void render_cube_rows(const Material& material, int first_row, Image& image) {
  std::vector<View> views;
  std::vector<glm::dvec3> points;
  for (int y = first_row; y < first_row + tile_rows; ++y) {
    for (int x = 0; x < panel; ++x) {
      SampleSequence samples(static_cast<std::uint32_t>(y * panel + x));
      for (int i = 0; i < subpixels * subpixels; ++i) {
        const int row = i / subpixels, column = i % subpixels;
        const double sub_x = x + (column + 0.5) / subpixels;
        const double sub_y = y + (row + 0.5) / subpixels;
        views.push_back(trace(sub_x / panel, sub_y / panel, samples, points));
      }
    }
  }
  const std::vector<glm::dvec3> colors = material.colors(points);
  auto color = colors.begin();
  auto view = views.begin();
  for (int y = first_row; y < first_row + tile_rows; ++y) {
    for (int x = 0; x < panel; ++x) {
      glm::dvec3 sum(0);
      for (int i = 0; i < subpixels * subpixels; ++i, ++view) {
        const glm::dvec3 surface = view->on_cube ? *color++ : glm::dvec3(backdrop);
        sum = sum + view->light * surface;
      }
      set_pixel(image, margin + x, margin + y, 1.0 / (subpixels * subpixels) * sum);
    }
  }
}

// A flat cut: the point at the panel's top left corner and its two edges, in the unit cube.
struct Plane {
  glm::dvec3 corner, right, down;
};

const Plane planes[4] = {
    {{0, 0, 0.5}, {1, 0, 0}, {0, 1, 0}},
    {{0, 0.5, 1}, {1, 0, 0}, {0, 0, -1}},
    {{0.5, 0, 1}, {0, 1, 0}, {0, 0, -1}},
    {{0.5 - std::sqrt(0.125), 0.5 - std::sqrt(0.125), 1},
     {std::sqrt(0.5), std::sqrt(0.5), 0},
     {0, 0, -1}},
};

void render_slice_rows(const Material& material, int index, int first_row, Image& image) {
  const Plane& plane = planes[index];
  std::vector<glm::dvec3> points;
  for (int y = first_row; y < first_row + tile_rows; ++y) {
    for (int x = 0; x < slice; ++x) {
      points.push_back(plane.corner + (x + 0.5) / slice * plane.right +
                       (y + 0.5) / slice * plane.down);
    }
  }
  const std::vector<glm::dvec3> colors = material.colors(points);
  const int left = 2 * margin + panel + index % 2 * (slice + gap);
  const int top = margin + index / 2 * (slice + gap);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const int pixel = static_cast<int>(i);
    set_pixel(image, left + pixel % slice, top + first_row + pixel / slice, colors[i]);
  }
}

}  // namespace

void write_preview(const std::filesystem::path& path, const Volume& volume,
                   const std::string& group) {
  static_assert(panel % tile_rows == 0 && slice % tile_rows == 0);
  const Material material(volume, group);
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) set_pixel(image, x, y, glm::dvec3(backdrop));
  }
  constexpr int cube_tiles = panel / tile_rows, slice_tiles = slice / tile_rows;
  Progress progress("Preview of " + volume.texture.name(), cube_tiles + 4 * slice_tiles);
  tbb::parallel_for(0, cube_tiles + 4 * slice_tiles, [&](int tile) {
    throw_if_interrupted();
    if (tile < cube_tiles) {
      render_cube_rows(material, tile * tile_rows, image);
    } else {
      const int rest = tile - cube_tiles;
      render_slice_rows(material, rest / slice_tiles, rest % slice_tiles * tile_rows, image);
    }
    progress.advance(1);
  });
  write_png(path, image);
  progress.finish();
}

}  // namespace solidtex::tools
