#include "plugins/openimageio/query.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <set>
#include <string_view>
#include <system_error>
#include <vector>

namespace solidtex::openimageio {
namespace {

constexpr std::int64_t kMaxOrigin = std::int64_t{1} << 30;  // the engine's precision
constexpr double kMinScale = 1e-9, kMaxScale = 1e9;         // its products with sizes stay in float

// Keeps a message to one line of moderate length.
std::string shown(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string result = "\"";
  for (const char c : text.substr(0, kLongest)) {
    const bool is_control = static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
    result += is_control ? '?' : c;
  }
  return result + (text.size() > kLongest ? "...\"" : "\"");
}

[[noreturn]] void refuse(std::string_view key, std::string_view found,
                         const std::string& expected) {
  throw QueryError(std::string(key) + " is " + shown(found) + ", expected " + expected);
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

// The whole text as a number between two bounds, or nothing. NaN is refused.
template <class Number>
std::optional<Number> number(std::string_view text, Number low, Number high) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || !(value >= low && value <= high)) return std::nullopt;
  return value;
}

void read_size(Query& query, std::string_view text) {
  const std::vector<std::string_view> parts = split(text, 'x');
  const bool is_cube = parts.size() == 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool is_there = is_cube || parts.size() == 3;
    const auto edge = is_there ? number(parts[is_cube ? 0 : axis], 1, kMaxSize) : std::nullopt;
    if (!edge) {
      refuse("size", text,
             "1 to " + std::to_string(kMaxSize) + " texels, or three such as 64x64x1");
    }
    query.size[axis] = *edge;
  }
}

void read_origin(Query& query, std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ',');
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto texel =
        parts.size() == 3 ? number(parts[axis], -kMaxOrigin, kMaxOrigin) : std::nullopt;
    if (!texel) {
      refuse("origin", text,
             "three texels such as 0,-64,512 within +-" + std::to_string(kMaxOrigin));
    }
    query.origin[axis] = *texel;
  }
}

void read_mesh(Query& query, std::string_view text) {
  const bool is_plain =
      std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; });
  if (text.empty() || !is_plain) refuse("mesh", text, "an OBJ or PLY file");
  query.mesh = text;
}

void read_seed(Query& query, std::string_view text) {
  const auto seed = number<std::uint64_t>(text, 0, UINT64_MAX);
  if (!seed) refuse("seed", text, "0 to " + std::to_string(UINT64_MAX));
  query.seed = *seed;
}

// Checked in the end, because the number of levels depends on the size.
void read_lod(Query& query, std::string_view text) {
  query.lod = number(text, 0, kMaxLod);
  if (!query.lod) refuse("lod", text, "0 to " + std::to_string(kMaxLod));
}

void read_scale(Query& query, std::string_view text) {
  const auto scale = number(text, kMinScale, kMaxScale);
  if (!scale) refuse("scale", text, "1e-9 to 1e9 texels per unit of the world");
  query.scale = *scale;
}

void read_type(Query& query, std::string_view text) {
  if (text != "half" && text != "float") refuse("type", text, "half or float");
  query.is_half = text == "half";
}

void read_tile(Query& query, std::string_view text) {
  const auto tile = number(text, kMinTile, kMaxTile);
  if (!tile || (*tile & (*tile - 1)) != 0) {
    refuse("tile", text,
           "a power of two from " + std::to_string(kMinTile) + " to " + std::to_string(kMaxTile));
  }
  query.tile = *tile;
}

struct Key {
  std::string_view name;
  void (*read)(Query&, std::string_view);
};
constexpr Key kKeys[] = {{"mesh", read_mesh}, {"size", read_size}, {"origin", read_origin},
                         {"seed", read_seed}, {"lod", read_lod},   {"scale", read_scale},
                         {"type", read_type}, {"tile", read_tile}};

const Key& key_named(std::string_view name) {
  const auto found = std::find_if(std::begin(kKeys), std::end(kKeys),
                                  [&](const Key& key) { return key.name == name; });
  if (found != std::end(kKeys)) return *found;
  std::string known;
  for (const Key& key : kKeys) known += (known.empty() ? "" : ", ") + std::string(key.name);
  throw QueryError("the query has the key " + shown(name) + ", expected one of " + known);
}

void read_pair(Query& query, std::string_view pair, std::set<std::string_view>& seen) {
  const std::size_t sign = pair.find('=');
  if (sign == std::string_view::npos) {
    throw QueryError("the query has " + shown(pair) + ", expected key=value");
  }
  const Key& key = key_named(pair.substr(0, sign));
  if (!seen.insert(key.name).second) {
    throw QueryError("the query has " + std::string(key.name) + " twice, expected once");
  }
  key.read(query, pair.substr(sign + 1));
}

// Meaning of the keys for an atlas; checked in the end, in any order of the keys.
void check_atlas(Query& query, bool has_size) {
  constexpr int kDefaultSize = 1024;
  const int edge = has_size ? query.size[0] : kDefaultSize;
  if (has_size && (query.size[1] != edge || query.size[2] != edge || edge > kMaxAtlas)) {
    const auto& [x, y, z] = query.size;
    refuse("size", std::to_string(x) + "x" + std::to_string(y) + "x" + std::to_string(z),
           "one number up to " + std::to_string(kMaxAtlas) + " for a mesh");
  }
  if (query.lod) refuse("lod", std::to_string(*query.lod), "none for a mesh, which has a mipmap");
  query.size = {edge, edge, 1};
}

}  // namespace

int last_lod(const std::array<int, 3>& size) {
  const int longest = *std::max_element(size.begin(), size.end());
  int lod = 0;
  while (lod < kMaxLod && 1 << lod < longest) ++lod;
  return lod;
}

Query parse_query(const std::string& name) {
  Query query;
  const std::size_t mark = name.find('?');
  query.model = name.substr(0, mark);
  if (mark == std::string::npos) return query;
  std::set<std::string_view> seen;
  for (const std::string_view pair : split(std::string_view(name).substr(mark + 1), '&')) {
    read_pair(query, pair, seen);
  }
  if (!query.mesh.empty()) {
    check_atlas(query, seen.contains("size"));
    return query;
  }
  if (query.lod && *query.lod > last_lod(query.size)) {
    refuse("lod", std::to_string(*query.lod),
           "0 to " + std::to_string(last_lod(query.size)) + " for this size");
  }
  return query;
}

}  // namespace solidtex::openimageio
