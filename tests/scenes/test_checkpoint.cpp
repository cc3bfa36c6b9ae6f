// Checkpoints of interrupted renders.
#include <algorithm>
#include <atomic>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;

namespace {

pt::Scene lit_ball() {
  pt::Scene scene = make_scene(make_sphere(12), {}, {0, 0, 4}, 40);
  scene.environment = uniform_light({0.3f, 0.4f, 0.5f});
  scene.lights.push_back({{-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, glm::vec3(4)});
  return scene;
}

pt::RenderSettings long_settings() {
  pt::RenderSettings settings = small_settings(40, 96);
  for (const pt::AovInfo& aov : pt::all_aovs()) settings.aovs.add(aov.aov);
  settings.noise = 0.05;
  return settings;
}

bool same(const pt::AovImage& a, const pt::AovImage& b) {
  return std::equal(
      a.planes.begin(), a.planes.end(), b.planes.begin(), b.planes.end(),
      [](const auto& x, const auto& y) { return x.aov == y.aov && x.values == y.values; });
}

// Renders until should_stop has been called this often.
bool go_on_for(pt::Renderer& renderer, std::atomic<int> questions) {
  return renderer.render({{}, [&] { return --questions < 0; }});
}

}  // namespace

TEST_CASE("A render resumed from checkpoints has the bits of an uninterrupted one") {
  const TemporaryFolder folder;
  const pt::Scene scene = lit_ball();
  pt::RenderSettings settings = long_settings();
  pt::Renderer whole(scene, settings);
  CHECK(whole.render());

  int parts = 0;
  for (bool finished = false; !finished; ++parts) {
    settings.threads = 1 + parts % 3;
    settings.progressive = parts % 2 == 1;
    pt::Renderer part(scene, settings);
    const std::uint64_t all = part.remaining_samples();
    if (parts > 0) {
      part.resume(folder / "state");
      CHECK(part.remaining_samples() < all);
    }
    finished = go_on_for(part, 5);
    part.save(folder / "state");
  }
  CHECK(parts > 3);

  pt::Renderer resumed(scene, settings);
  resumed.resume(folder / "state");
  CHECK(resumed.remaining_samples() == 0);
  CHECK(same(resumed.image(), whole.image()));
  CHECK(resumed.statistics().ray_count == whole.statistics().ray_count);
}

TEST_CASE("A checkpoint of another render is refused, naming the difference") {
  const TemporaryFolder folder;
  const pt::Scene scene = lit_ball();
  pt::RenderSettings settings = long_settings();
  pt::Renderer renderer(scene, settings);
  CHECK(!go_on_for(renderer, 3));
  renderer.save(folder / "state");
  const auto resume = [&](const pt::Scene& other, const pt::RenderSettings& with) {
    pt::Renderer(other, with).resume(folder / "state");
  };
  CHECK_NOTHROW(resume(scene, settings));
  pt::RenderSettings different = settings;
  different.samples = 97;
  CHECK_THROWS_WITH(resume(scene, different), ContainsSubstring("state") &&
                                                  ContainsSubstring("samples 96") &&
                                                  ContainsSubstring("97"));
  different = settings;
  different.aovs = {pt::Aov::beauty};
  CHECK_THROWS_WITH(resume(scene, different), ContainsSubstring("layers"));
  pt::Scene moved = lit_ball();
  moved.meshes[0].positions[5].x += 0.01f;
  CHECK_THROWS_WITH(resume(moved, settings), ContainsSubstring("another scene"));

  const std::string bytes = read_text(folder / "state");
  for (const std::string& damaged :
       {std::string(), std::string("no checkpoint\n{}\n"), bytes.substr(0, 40),
        bytes.substr(0, bytes.size() - 1), bytes + "x"}) {
    write_text(folder / "state", damaged);
    CHECK_THROWS_WITH(resume(scene, settings),
                      ContainsSubstring("state") && ContainsSubstring("expected"));
  }
}
