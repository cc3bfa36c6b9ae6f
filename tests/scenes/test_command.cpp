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
    "materials": {"grey": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
    "objects": [{"mesh": "cube.ply", "material": "grey"}],
    "environment": {"color": [1, 1, 1]}
  })");
}

std::size_t file_count(const TemporaryFolder& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder.path()), {}));
}

}  // namespace

TEST_CASE("solidtex-render writes pictures and overwrites only when told to") {
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
  CHECK(file_count(folder) == 6);  // nothing temporary is left
}

TEST_CASE("solidtex-render refuses what it cannot do, without leaving files") {
  const TemporaryFolder folder;
  write_scene(folder);
  const std::pair<const char*, const char*> failures[] = {
      {"scene.json -o a.jpg", "*.png or *.exr"},
      {"scene.json -o nowhere/a.png", "nowhere"},
      {"missing.json -o a.png", "missing.json"},
      {"cube.ply -o a.png", "not JSON"}};
  for (const auto& [arguments, words] : failures) {
    CAPTURE(arguments);
    CHECK(run_render(arguments, folder) == 1);
    CHECK(read_text(folder / "err.txt").find(words) != std::string::npos);
  }
  for (const char* arguments : {"", "scene.json", "scene.json -o a.png --spp 0",
                                "scene.json -o a.png --size 3", "scene.json -o a.png --size 0,3",
                                "scene.json -o a.png --bogus", "scene.json -o a.png --threads x"}) {
    CAPTURE(arguments);
    CHECK(run_render(arguments, folder) == 2);
  }
  CHECK(file_count(folder) == 4);
  CHECK(run_render("--help", folder) == 0);
  CHECK(read_text(folder / "out.txt").find("Examples:") != std::string::npos);
  CHECK(run_render("--version", folder) == 0);
}

TEST_CASE("Ctrl-C ends solidtex-render with 130 and leaves nothing behind") {
  const TemporaryFolder folder;
  write_scene(folder);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    if (!freopen((folder / "err.txt").c_str(), "w", stderr)) _exit(99);
    if (!freopen((folder / "out.txt").c_str(), "w", stdout)) _exit(99);
    execl(SOLIDTEX_RENDER, "solidtex-render", (folder / "scene.json").c_str(), "--spp", "1000000",
          "-o", (folder / "a.png").c_str(), static_cast<char*>(nullptr));
    _exit(99);
  }
  // What it says about the mesh comes right before the rendering.
  for (int i = 0; i < 600 && read_text(folder / "out.txt").empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  kill(child, SIGINT);
  int status = 0;
  waitpid(child, &status, 0);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 130);
  CHECK(file_count(folder) == 4);
}
