#include "tools/render/frames.h"

#include <fmt/format.h>

#include <charconv>

namespace solidtex::tools {
namespace {

namespace fs = std::filesystem;

struct Range {
  int first = 0, last = 0;
};

// "12" or "0-47"
Range parse_range(const std::string& text, int frame_count) {
  Range range;
  const char* end = text.data() + text.size();
  auto parsed = std::from_chars(text.data(), end, range.first);
  range.last = range.first;
  if (parsed.ec == std::errc() && parsed.ptr != end && *parsed.ptr == '-') {
    parsed = std::from_chars(parsed.ptr + 1, end, range.last);
  }
  if (parsed.ec != std::errc() || parsed.ptr != end || range.first < 0 ||
      range.last < range.first || range.last >= frame_count) {
    throw std::runtime_error(
        fmt::format("--frames: found {}, expected FRAME or FIRST-LAST, from 0 "
                    "to {}",
                    text, frame_count - 1));
  }
  return range;
}

// The run of # in a name becomes the number with so many digits at least.
fs::path numbered(const fs::path& output, int number) {
  std::string name = output.filename().string();
  const std::size_t start = name.find('#');
  const std::size_t end = name.find_first_not_of('#', start);
  name.replace(start, end - start, fmt::format("{:0{}}", number, end - start));
  return output.parent_path() / name;
}

}  // namespace

std::vector<Frame> frames_to_render(const Options& options, int frame_count) {
  const bool has_number = options.output.filename().string().find('#') != std::string::npos;
  Range range{0, has_number || options.turntable > 0 ? frame_count - 1 : 0};
  if (options.frames) range = parse_range(*options.frames, frame_count);
  if (!has_number && range.last > range.first) {
    throw std::runtime_error(
        fmt::format("{}: found one name for {} frames, expected one with the place of the number, "
                    "{}.####{}",
                    options.output.string(), range.last - range.first + 1,
                    options.output.stem().string(), options.output.extension().string()));
  }
  std::vector<Frame> frames;
  for (int number = range.first; number <= range.last; ++number) {
    const fs::path output = has_number ? numbered(options.output, number) : options.output;
    if (!options.resume || !fs::exists(output)) frames.push_back({number, output});
  }
  return frames;
}

}  // namespace solidtex::tools
