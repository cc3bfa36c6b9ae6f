// The program solidtex-render: exit codes, files, Ctrl-C.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "catch.hpp"
#include "plugins/pathtracer/reader/image_reader.h"
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
      {"out.txt -o a.png", "not JSON"},
      {"cube.ply -o a.png", "--model"},
      {"cube.fbx --model noise.solidtex -o a.png", "found .fbx, expected a mesh"}};
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
        "scene.json -o a.png --threads x", "scene.json -o a.png --seed=-1",
        "scene.json -o a.png --seed 99999999999999999999",
        "cube.ply --model granite-grey --variant=-1 -o a.png"}) {
    CAPTURE(arguments);
    CHECK(run_render(arguments, folder) == 2);
  }
  for (const char* size : {"640x480", "512", "0,480"}) {
    CHECK(run_render(std::string("scene.json -o a.png --size ") + size, folder) == 2);
    CHECK_THAT(read_text(folder / "err.txt"),
               ContainsSubstring("expected W,H, for example 640,480"));
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
  CHECK(interrupt_render({"scene.json", "--spp", "1000000", "-o", "a.png"}, folder, "err.txt") ==
        130);
  CHECK(file_count(folder) == 4);
}

TEST_CASE("Ctrl-C in a sequence says how many images were written") {
  const TemporaryFolder folder;
  write_scene(folder);
  CHECK(interrupt_render({"cube.ply", "--model", "granite-grey", "--turntable", "1000", "--size",
                          "24,16", "--spp", "1", "-o", "a.####.png"},
                         folder, "a.0001.png") == 130);
  const std::string message = read_text(folder / "err.txt");
  CHECK(message.find("of 1000 images were written: --resume goes on") != std::string::npos);
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

TEST_CASE("solidtex-render shows a mesh in a model without a scene file") {
  const TemporaryFolder folder;
  write_ply(folder / "cube.ply", make_cube());
  write_noise_model(folder / "noise.solidtex", 5);
  const std::string command = "cube.ply --model noise.solidtex --size 32,24 --spp 4 ";
  REQUIRE(run_render(command + "-o a.png", folder) == 0);
  const std::string talk = read_text(folder / "err.txt");
  CHECK(talk.find("no light, lit by the default studio") != std::string::npos);
  CHECK(talk.find("cube.ply: --texels-per-unit 256\n") != std::string::npos);
  CHECK(run_render(command + "--texels-per-unit 256 -o b.png", folder) == 0);
  CHECK(read_text(folder / "a.png") == read_text(folder / "b.png"));  // 512 along the side of 2
  CHECK(run_render(command + "--variant 3 -o c.png", folder) == 0);
  CHECK(read_text(folder / "a.png") != read_text(folder / "c.png"));
  CHECK(run_render(command + "--turntable 2 -o turn#.png", folder) == 0);
  CHECK(read_text(folder / "turn0.png") == read_text(folder / "a.png"));
  CHECK(fs::exists(folder / "turn1.png"));
  CHECK(run_render("cube.ply --up z -o d.png", folder) == 2);
  write_noise_model(folder / "phases.solidtex", 5, {"phase.pore", "phase.grain"});
  CHECK(run_render("cube.ply --model phases.solidtex -o d.png", folder) == 1);
  CHECK(read_text(folder / "err.txt").find("--model: found phases.solidtex") != std::string::npos);
  const std::vector<std::pair<std::string, std::string>> unfit = {
      {"8e6 8e6 8e6\n8000001 8e6 8e6\n8e6 8000001 8e6", "4.096e+09 texels in the material"},
      {"0 0 1e30\n0 0 0\n0 1 0", "whose longest side is 1e+30 units"},
      {"1 2 3\n1 2 3\n1 2 3", "found all vertices at one point"}};
  for (const auto& [vertices, words] : unfit) {
    write_text(folder / "unfit.off", "OFF\n3 1 0\n" + vertices + "\n3 0 1 2\n");
    CHECK(run_render("unfit.off --model noise.solidtex -o d.png", folder) == 1);
    const std::string message = read_text(folder / "err.txt");
    CHECK(message.find("unfit.off: ") != std::string::npos);
    CHECK(message.find(words) != std::string::npos);
  }
  write_scene(folder);
  CHECK(run_render("scene.json --model noise.solidtex -o d.png", folder) == 1);
}

TEST_CASE("A scene without light is lit by a studio that a turntable does not move") {
  const TemporaryFolder folder;
  write_scene(folder);
  json scene = json::parse(read_text(folder / "scene.json"));
  scene.erase("environment");
  write_text(folder / "dark.json", scene.dump());
  pt::Sequence sequence(folder / "dark.json");
  sequence.set_turntable(2);
  const pt::Scene& first = sequence.frame(0);
  CHECK(pt::notes_of(first).back().find("studio") != std::string::npos);
  CHECK(mean_color(pt::render(first, pt::settings_of(first))).x > 0.1f);
  const glm::vec3 corner = first.lights.at(0).corner;
  CHECK(sequence.frame(1).lights.at(0).corner == corner);

  scene["materials"]["gray"]["emission"] = {1, 1, 1};  // a light of its own
  write_text(folder / "bright.json", scene.dump());
  CHECK(pt::load_scene(folder / "bright.json")->lights.empty());
}

TEST_CASE("A solid texture without a scale has 512 texels along the longest side of its object") {
  const TemporaryFolder folder;
  write_scene(folder);
  write_noise_model(folder / "noise.solidtex", 2);
  json scene = json::parse(read_text(folder / "scene.json"));
  json& color = scene["materials"]["gray"]["color"];
  scene["objects"].push_back(scene["objects"][0]);
  scene["objects"][0]["transform"] = {{{"scale", {3, 1, 1}}}, {{"translate", {5, 0, 0}}}};
  const auto scale_of = [&](std::size_t object) {
    write_text(folder / "scale.json", scene.dump());
    const auto loaded = pt::load_scene(folder / "scale.json");
    const pt::Material& material = loaded->materials[loaded->objects[object].material];
    return std::get<pt::SolidColor>(material.color).to_texels[0][0];
  };
  color = {{"solid", "noise.solidtex"}};
  CHECK(scale_of(0) == 256);
  CHECK(scale_of(1) == 256);
  color["space"] = "world";  // one scale for both, from -1 to 8
  CHECK(scale_of(0) == Approx(512.0 / 9));
  CHECK(scale_of(1) == Approx(512.0 / 9));
  color["transform"] = {{{"scale", 7}}};
  CHECK(scale_of(0) == 7);
  color["transform"] = {{{"rotate", {{"axis", {0, 1, 0}}, {"degrees", 180}}}}};
  CHECK(scale_of(0) == Approx(-512.0 / 9));
  color["texels_per_unit"] = 1;
  CHECK(scale_of(0) == Approx(-1));
  if (!built_with_cgal()) return;
  color = {{"solid", "noise.solidtex"}};
  scene["objects"][1]["cuts"] = {{{"clip", {{"point", {0, 0, 0}}, {"normal", {1, 1, 1}}}}},
                                 {{"subtract", {{"box", 1.9}}}}};
  CHECK(scale_of(1) == 256);  // of the whole mesh
}

TEST_CASE("solidtex-render --denoise needs Open Image Denoise and says where it looked") {
  const TemporaryFolder folder;
  write_scene(folder);
  const char* library = std::getenv("SOLIDTEX_OPENIMAGEDENOISE");
  const std::string kept = library ? library : "";
  setenv("SOLIDTEX_OPENIMAGEDENOISE", "/none/libOpenImageDenoise.so.2", 1);
  CHECK(run_render("scene.json --denoise -o a.png", folder) == 1);
  const std::string error = read_text(folder / "err.txt");
  CHECK(error.find("/none/libOpenImageDenoise.so.2") != std::string::npos);
  CHECK(error.find("pyoidn") != std::string::npos);
  CHECK_FALSE(fs::exists(folder / "a.png"));
  if (kept.empty()) {
    unsetenv("SOLIDTEX_OPENIMAGEDENOISE");
    WARN("skipped: SOLIDTEX_OPENIMAGEDENOISE names no library to denoise with");
    return;
  }
  setenv("SOLIDTEX_OPENIMAGEDENOISE", kept.c_str(), 1);
  CHECK(run_render("scene.json --denoise --aovs albedo -o a.exr", folder) == 1);
  CHECK(read_text(folder / "err.txt").find("found --aovs without beauty") != std::string::npos);
  // Ambient occlusion is noisy where the cube stands on another one.
  write_text(folder / "scene.json", R"({
    "version": 1,
    "camera": {"position": [2, 3, 6], "look_at": [0, 0, 0], "fov": 40},
    "materials": {"stone": {"type": "diffuse", "color": {
      "solid": ")" SOLIDTEX_SOURCE R"(/models/granite-speckled.solidtex",
      "texels_per_unit": 40}}},
    "objects": [
      {"mesh": "cube.ply", "material": "stone"},
      {"mesh": "cube.ply", "material": "stone",
       "transform": [{"scale": 8}, {"translate": [0, -9, 0]}]}],
    "environment": {"color": [1, 1, 1]}
  })");
  const std::string size = "scene.json --size 96,64 ";
  REQUIRE(run_render(size + "--spp 4 --denoise -o denoised.exr", folder) == 0);
  REQUIRE(run_render(size + "--spp 4 --aovs beauty,albedo,normal -o noisy.exr", folder) == 0);
  REQUIRE(run_render(size + "--spp 512 -o exact.exr", folder) == 0);
  std::vector<std::string> notes;
  const auto read = [&](const char* name) {
    return pt::read_image(folder / name, pt::ImageEncoding::linear, pt::ImageRange::radiance, notes)
        .pixels;
  };
  const auto exact = read("exact.exr"), noisy = read("noisy.exr"), denoised = read("denoised.exr");
  double noise = 0, rest = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    noise += glm::length(noisy[i] - exact[i]);
    rest += glm::length(denoised[i] - exact[i]);
  }
  CHECK(rest < 0.7 * noise);
}
