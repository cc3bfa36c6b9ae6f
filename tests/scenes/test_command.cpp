// The program solidtex-render: exit codes, files, Ctrl-C.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "catch.hpp"
#include "tests/scenes/support.h"

using namespace scene_tests;
using nlohmann::json;
namespace fs = std::filesystem;

namespace {

int run_render(const std::string& arguments, const TemporaryFolder& folder) {
  const std::string command = "cd '" + folder.path().string() + "' && '" SOLIDTEX_RENDER "' " +
                              arguments + " > out.txt 2> err.txt";
  const int status = std::system(command.c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void write_scene(const TemporaryFolder& folder) {
  write_ply(folder / "cube.ply", make_cube());
  write_text(folder / "scene.json", R"({
    "version": 1,
    "render": {"size": [24, 16], "spp": 4},
    "camera": {"position": [2, 3, 6], "look_at": [0, 0, 0], "fov": 40},
    "materials": {"gray": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
    "objects": [{"mesh": "cube.ply", "material": "gray"}],
    "environment": {"color": [1, 1, 1]}
  })");
}

std::size_t file_count(const TemporaryFolder& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder.path()), {}));
}

}  // namespace

TEST_CASE("solidtex-render writes images and overwrites only with --force") {
  const TemporaryFolder folder;
  write_scene(folder);
  CHECK(run_render("scene.json -o a.png", folder) == 0);
  const std::string first = read_text(folder / "a.png");
  CHECK(first.substr(1, 3) == "PNG");
  CHECK(run_render("scene.json --seed 1 -o a.png", folder) == 1);
  CHECK(read_text(folder / "err.txt").find("a.png") != std::string::npos);
  CHECK(read_text(folder / "a.png") == first);
  CHECK(run_render("scene.json --seed 1 -o a.png --force", folder) == 0);
  CHECK(read_text(folder / "a.png") != first);
  CHECK(run_render("scene.json --seed 0 --threads 1 -o a.png --force", folder) == 0);
  CHECK(read_text(folder / "a.png") == first);

  CHECK(run_render("scene.json --size 5,7 --spp 1 -o b.exr --quiet", folder) == 0);
  CHECK(read_text(folder / "b.exr").substr(0, 4) == "\x76\x2f\x31\x01");
  CHECK(read_text(folder / "out.txt").empty());
  CHECK(read_text(folder / "err.txt").empty());
  CHECK(file_count(folder) == 6);  // no temporary file is left
}

TEST_CASE("solidtex-render refuses invalid commands without leaving files") {
  const TemporaryFolder folder;
  write_scene(folder);
  const std::pair<const char*, const char*> failures[] = {
      {"scene.json -o a.jpg", "*.png or *.exr"},
      {"scene.json -o nowhere/a.png", "nowhere"},
      {"scene.json -o /proc/a.png", "/proc"},
      {"scene.json -o a.png --layers albedo", "--layers"},
      {"scene.json -o a.png --crop 3,3,25,4", "24 x 16"},
      {"scene.json -o a.png --crop 3,3,3,4", "x0 < x1"},
      {"scene.json -o a.exr --size 32768,32768 --layers all", "memory"},
      {"scene.json -o a.png --checkpoint nowhere/state", "nowhere"},
      {"scene.json -o a.png --checkpoint cube.ply", "checkpoint"},
      {"scene.json -o a.png --turntable 3", "a.####.png"},
      {"scene.json -o a.#.png --frames 1", "0 to 0"},
      {"missing.json -o a.png", "missing.json"},
      {"cube.ply -o a.png", "not JSON"}};
  for (const auto& [arguments, words] : failures) {
    CAPTURE(arguments);
    CHECK(run_render(arguments, folder) == 1);
    CHECK(read_text(folder / "err.txt").find(words) != std::string::npos);
  }
  for (const char* arguments :
       {"", "scene.json", "scene.json -o a.png --spp 0", "scene.json -o a.png --size 3",
        "scene.json -o a.png --size 0,3", "scene.json -o a.png --bogus",
        "scene.json -o a.exr --spp 1000000000", "scene.json -o a.exr --layers gloss",
        "scene.json -o a.png --view x", "scene.json -o a.exr --view depth --layers depth",
        "scene.json -o a.png --threads x"}) {
    CAPTURE(arguments);
    CHECK(run_render(arguments, folder) == 2);
  }
  CHECK(file_count(folder) == 4);
  CHECK(run_render("--help", folder) == 0);
  CHECK(read_text(folder / "out.txt").find("Examples:") != std::string::npos);
  CHECK(run_render("--version", folder) == 0);
}

TEST_CASE("The option --noise overrides the scene's noise target") {
  const TemporaryFolder folder;
  write_scene(folder);
  json scene = json::parse(read_text(folder / "scene.json"));
  scene["render"]["spp"] = 64;
  write_text(folder / "scene.json", scene.dump());
  CHECK(run_render("scene.json --layers all --noise 0.5 -o option.exr", folder) == 0);
  CHECK(run_render("scene.json --layers all -o none.exr", folder) == 0);
  scene["render"]["noise"] = 0.5;
  write_text(folder / "scene.json", scene.dump());
  CHECK(run_render("scene.json --layers all -o key.exr", folder) == 0);
  CHECK(read_text(folder / "out.txt").find("at most 64 samples") != std::string::npos);
  CHECK(run_render("scene.json --layers all --noise 0 -o off.exr", folder) == 0);
  CHECK(read_text(folder / "key.exr") == read_text(folder / "option.exr"));
  CHECK(read_text(folder / "off.exr") == read_text(folder / "none.exr"));
  CHECK(read_text(folder / "key.exr") != read_text(folder / "none.exr"));
}

TEST_CASE("solidtex-render writes AOVs, crop windows and frames") {
  const TemporaryFolder folder;
  write_scene(folder);
  CHECK(run_render("scene.json --view normal -o normal.png", folder) == 0);
  CHECK(read_text(folder / "out.txt").find("from -1 to 1") != std::string::npos);
  CHECK(run_render("scene.json --layers all --crop 1,2,9,8 -o all.exr", folder) == 0);
  CHECK(read_text(folder / "all.exr").find("albedo.R") != std::string::npos);
  CHECK(run_render("scene.json -o srgb.png", folder) == 0);
  CHECK(run_render("scene.json --view-transform filmic -o filmic.png", folder) == 0);
  CHECK(read_text(folder / "filmic.png") != read_text(folder / "srgb.png"));

  CHECK(run_render("scene.json --turntable 4 -o turn.##.png", folder) == 0);
  CHECK(read_text(folder / "turn.00.png") == read_text(folder / "srgb.png"));
  const std::string third = read_text(folder / "turn.02.png");
  CHECK(third != read_text(folder / "turn.00.png"));
  CHECK(fs::exists(folder / "turn.03.png"));
  fs::remove(folder / "turn.02.png");
  write_text(folder / "turn.01.png", "not touched");
  CHECK(run_render("scene.json --turntable 4 -o turn.##.png", folder) == 1);
  CHECK(read_text(folder / "err.txt").find("turn.00.png") != std::string::npos);
  CHECK(!fs::exists(folder / "turn.02.png"));
  CHECK(run_render("scene.json --turntable 4 -o turn.##.png --resume", folder) == 0);
  CHECK(read_text(folder / "turn.02.png") == third);
  CHECK(read_text(folder / "turn.01.png") == "not touched");
  CHECK(run_render("scene.json --turntable 4 --frames 2-2 -o one.png", folder) == 0);
  CHECK(read_text(folder / "one.png") == third);
}

namespace {

// Starts solidtex-render, sends SIGINT once the awaited file has content, returns the exit code.
int interrupt_render(std::vector<std::string> arguments, const TemporaryFolder& folder,
                     const std::string& awaited) {
  fs::remove(folder / awaited);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    if (chdir(folder.path().c_str()) != 0) _exit(99);
    if (!freopen("err.txt", "w", stderr) || !freopen("out.txt", "w", stdout)) _exit(99);
    std::vector<char*> pointers{const_cast<char*>("solidtex-render")};
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    execv(SOLIDTEX_RENDER, pointers.data());
    _exit(99);
  }
  for (int i = 0; i < 6000 && read_text(folder / awaited).empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("Ctrl-C ends solidtex-render with exit code 130 and leaves no files") {
  const TemporaryFolder folder;
  write_scene(folder);
  // The mesh report is printed right before rendering.
  CHECK(interrupt_render({"scene.json", "--spp", "1000000", "-o", "a.png"}, folder, "out.txt") ==
        130);
  CHECK(file_count(folder) == 4);
}

TEST_CASE("A checkpoint keeps the samples after Ctrl-C and on a full disk") {
  const TemporaryFolder folder;
  write_scene(folder);
  const std::string render = "scene.json --spp 20000 --preview-every 0.1 -o a.exr";
  REQUIRE(run_render("scene.json --spp 20000 -o whole.exr", folder) == 0);
  CHECK(interrupt_render({"scene.json", "--spp", "20000", "--preview-every", "0.1", "-o", "a.exr",
                          "--checkpoint", "state"},
                         folder, "a.preview.png") == 130);
  CHECK(read_text(folder / "err.txt").find("state keeps") != std::string::npos);
  CHECK(!fs::exists(folder / "a.exr"));
  REQUIRE(fs::exists(folder / "state"));

  // With a file size limit of 0 every write fails.
  const std::string full = "cd '" + folder.path().string() +
                           "' && (trap '' XFSZ; ulimit -f 0; exec '" SOLIDTEX_RENDER "' " + render +
                           " --checkpoint state) 2>&1 | cat > full.txt";
  const std::string state = read_text(folder / "state");
  CHECK(std::system(full.c_str()) == 0);
  CHECK(read_text(folder / "full.txt").find("a.exr") != std::string::npos);
  CHECK(!fs::exists(folder / "a.exr"));
  CHECK(read_text(folder / "state") == state);

  CHECK(run_render(render + " --checkpoint state", folder) == 0);
  CHECK(read_text(folder / "a.exr") == read_text(folder / "whole.exr"));
  CHECK(!fs::exists(folder / "state"));
  CHECK(!fs::exists(folder / "a.preview.png"));
}
