// Renders that are interrupted and go on, in the library and by the command.
#include <algorithm>
#include <atomic>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;
using Catch::Contains;

namespace {

pt::Scene lit_ball() {
  pt::Scene scene = make_scene(make_sphere(12), {}, {0, 0, 4}, 40);
  scene.environment = uniform_light({0.3f, 0.4f, 0.5f});
  scene.lights.push_back({{-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  return scene;
}

pt::RenderSettings long_settings() {
  pt::RenderSettings settings = small_settings(40, 96);
  for (const pt::LayerInfo& layer : pt::all_layers()) settings.layers.add(layer.layer);
  settings.noise = 0.05;
  return settings;
}

bool same(const pt::Picture& a, const pt::Picture& b) {
  return std::equal(
      a.planes.begin(), a.planes.end(), b.planes.begin(), b.planes.end(),
      [](const auto& x, const auto& y) { return x.layer == y.layer && x.values == y.values; });
}

// Renders until should_stop has been asked so often.
bool go_on_for(pt::Rendering& rendering, std::atomic<int> questions) {
  return rendering.go_on({{}, [&] { return --questions < 0; }});
}

}  // namespace

TEST_CASE("A render resumed from checkpoints has the bits of one that was never interrupted") {
  const TemporaryFolder folder;
  const pt::Scene scene = lit_ball();
  pt::RenderSettings settings = long_settings();
  pt::Rendering whole(scene, settings);
  CHECK(whole.go_on());

  int parts = 0;
  for (bool finished = false; !finished; ++parts) {
    settings.threads = 1 + parts % 3;
    settings.progressive = parts % 2 == 1;
    pt::Rendering part(scene, settings);
    const std::uint64_t all = part.samples_left();
    if (parts > 0) {
      part.resume(folder / "state");
      CHECK(part.samples_left() < all);
    }
    finished = go_on_for(part, 5);
    part.save(folder / "state");
  }
  CHECK(parts > 3);

  pt::Rendering resumed(scene, settings);
  resumed.resume(folder / "state");
  CHECK(resumed.samples_left() == 0);
  CHECK(same(resumed.picture(), whole.picture()));
  CHECK(resumed.statistics().ray_count == whole.statistics().ray_count);
}

TEST_CASE("A checkpoint of another render is refused, and says what is different") {
  const TemporaryFolder folder;
  const pt::Scene scene = lit_ball();
  pt::RenderSettings settings = long_settings();
  pt::Rendering rendering(scene, settings);
  CHECK(!go_on_for(rendering, 3));
  rendering.save(folder / "state");
  const auto resume = [&](const pt::Scene& other, const pt::RenderSettings& with) {
    pt::Rendering(other, with).resume(folder / "state");
  };
  CHECK_NOTHROW(resume(scene, settings));
  pt::RenderSettings different = settings;
  different.samples = 97;
  CHECK_THROWS_WITH(resume(scene, different),
                    Contains("state") && Contains("samples 96") && Contains("97"));
  different = settings;
  different.layers = {pt::Layer::beauty};
  CHECK_THROWS_WITH(resume(scene, different), Contains("layers"));
  pt::Scene moved = lit_ball();
  moved.meshes[0].positions[5].x += 0.01f;
  CHECK_THROWS_WITH(resume(moved, settings), Contains("another scene"));

  const std::string bytes = read_text(folder / "state");
  for (const std::string& damaged :
       {std::string(), std::string("no checkpoint\n{}\n"), bytes.substr(0, 40),
        bytes.substr(0, bytes.size() - 1), bytes + "x"}) {
    write_text(folder / "state", damaged);
    CHECK_THROWS_WITH(resume(scene, settings), Contains("state") && Contains("expected"));
  }
}
