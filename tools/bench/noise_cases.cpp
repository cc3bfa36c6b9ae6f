// The seeded noise alone: a box of a model that is one noise node.
#include <cstring>
#include <nlohmann/json.hpp>

#include "tools/bench/cases.h"

namespace solidtex::tools {
namespace {

using nlohmann::json;

// A model file (docs/file-format.md) without tensors: length of the header, header.
std::vector<std::byte> noise_model(const std::string& distribution) {
  const json node = {{"name", "noise"},
                     {"op", "noise"},
                     {"level", 0},
                     {"channels", 1},
                     {"distribution", distribution}};
  const json document = {{"version", 1},
                         {"name", "noise"},
                         {"family", "field"},
                         {"channels", {"value"}},
                         {"color_space", "data"},
                         {"noise", {{"scheme", "solidtex-1"}}},
                         {"field", {{"nodes", {node}}, {"output", "noise"}}}};
  const json header = {{"__metadata__", {{"solidtex", document.dump()}}}};
  std::string text = header.dump();
  text.resize((text.size() + 7) / 8 * 8, ' ');
  std::vector<std::byte> bytes(8 + text.size());
  for (std::size_t i = 0; i < 8; ++i) bytes[i] = static_cast<std::byte>(text.size() >> 8 * i);
  std::memcpy(bytes.data() + 8, text.data(), text.size());
  return bytes;
}

Case noise_case(const std::string& distribution, const CaseSettings& settings) {
  struct State {
    solidtex::texture texture;
    std::array<std::int64_t, 3> corner;
    std::vector<float> values;
  };
  const std::int64_t edge = settings.quick ? 8 : 64;
  const auto count = static_cast<std::size_t>(edge * edge * edge);
  auto state = std::make_shared<State>(State{
      solidtex::texture::from_memory(noise_model(distribution)), {}, std::vector<float>(count)});
  Case made;
  made.unit = "value";
  made.units_per_call = static_cast<double>(count);
  made.time_call = timed(
      1, [state] { state->corner = unvisited_place(); },
      [state, edge] {
        state->texture.eval_box(state->corner, {edge, edge, edge}, state->values);
      });
  return made;
}

}  // namespace

std::vector<CaseInfo> noise_cases() {
  return {
      {.name = "noise.uniform",
       .about = "uniform noise on 64^3 voxels",
       .make = [](Models&, const CaseSettings& s) { return noise_case("uniform", s); }},
      {.name = "noise.normal",
       .about = "normal noise on 64^3 voxels",
       .make = [](Models&, const CaseSettings& s) { return noise_case("normal", s); }},
  };
}

}  // namespace solidtex::tools
