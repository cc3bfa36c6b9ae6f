#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <utility>

#include "catch.hpp"
#include "tools/common/cli.h"
#include "tools/common/limits.h"
#include "tools/common/output_file.h"
#include "tools/common/progress.h"

using namespace solidtex::tools;
namespace fs = std::filesystem;

namespace {

// A folder of its own for every test, removed afterwards.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "solidtex-tools-XXXXXX").string();
    REQUIRE(mkdtemp(pattern.data()) != nullptr);
    path_ = pattern;
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }
  std::ptrdiff_t entry_count() const {
    return std::distance(fs::directory_iterator(path_), fs::directory_iterator());
  }

 private:
  fs::path path_;
};

void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

std::string read(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

int run(std::vector<const char*> arguments, const std::function<void()>& work) {
  CLI::App app("A test.", "a-tool");
  std::string output;
  std::vector<int> size;
  app.add_option("-o", output)->required();
  app.add_option("--size", size)->delimiter(',')->expected(2)->option_text("W,H");
  arguments.insert(arguments.begin(), "a-tool");
  return run_tool(app, static_cast<int>(arguments.size()), const_cast<char**>(arguments.data()),
                  work);
}

// The first line that the tool prints, and its exit code.
std::pair<std::string, int> answer(const std::vector<const char*>& arguments) {
  std::ostringstream text;
  std::streambuf* const out = std::cout.rdbuf(text.rdbuf());
  std::streambuf* const err = std::cerr.rdbuf(text.rdbuf());
  const int code = run(arguments, [] {});
  std::cout.rdbuf(out);
  std::cerr.rdbuf(err);
  return {text.str().substr(0, text.str().find('\n')), code};
}

}  // namespace

TEST_CASE("A file appears when it is committed, and not before") {
  const Folder folder;
  const fs::path target = folder / "out.npy";
  write(target, "old");
  {
    AtomicFile file(target);
    CHECK(file.temporary_path().extension() == ".npy");
    CHECK(file.temporary_path().parent_path() == target.parent_path());
    write(file.temporary_path(), "new");
    CHECK(read(target) == "old");
    file.commit();
  }
  CHECK(read(target) == "new");
  CHECK(folder.entry_count() == 1);
}

TEST_CASE("A file that another program writes meanwhile stays") {
  const Folder folder;
  const fs::path target = folder / "out.npy";
  {
    AtomicFile file(target);
    write(file.temporary_path(), "new");
    write(target, "theirs");
    CHECK_THROWS_WITH(file.commit(),
                      target.string() +
                          ": another program has written it "
                          "meanwhile, and it stays: choose another name, or --force");
  }
  CHECK(read(target) == "theirs");
  CHECK(folder.entry_count() == 1);
}

TEST_CASE("A file that is not committed leaves nothing") {
  const Folder folder;
  const fs::path target = folder / "out.npy";
  write(target, "old");
  {
    AtomicFile file(target);
    write(file.temporary_path(), "new");
  }
  CHECK(read(target) == "old");
  CHECK(folder.entry_count() == 1);
}

TEST_CASE("What a killed process has left of a file is removed by the next write of it") {
  const Folder folder;
  const fs::path target = folder / "out.npy";
  const pid_t child = fork();
  if (child == 0) {  // a process that ends without cleaning up
    const AtomicFile file(target);
    write(file.temporary_path(), "half");
    const AtomicFile slices(folder / "slices");
    fs::create_directory(slices.temporary_path());
    _exit(0);
  }
  REQUIRE(waitpid(child, nullptr, 0) == child);
  CHECK(folder.entry_count() == 2);
  const AtomicFile other(folder / "outside.npy"), slices(folder / "slices");
  CHECK(folder.entry_count() == 1);
  const AtomicFile file(target);
  CHECK(folder.entry_count() == 0);
  write(file.temporary_path(), "mine");
  const AtomicFile another(folder / "another.npy");
  CHECK(read(file.temporary_path()) == "mine");
}

TEST_CASE("A killed process's file is removed although another process has its number") {
  const Folder folder;
  const fs::path target = folder / "out.npy";
  fs::path left;
  {
    const AtomicFile file(target);
    left = file.temporary_path();
  }
  std::string name = left.filename().string();
  const std::size_t end = name.rfind(".tmp"), start = name.rfind('-', end) + 1;
  REQUIRE(start < end);
  name.replace(start, end - start, "1");  // the first clock tick of the machine
  write(folder / name, "half");
  CHECK(folder.entry_count() == 1);
  const AtomicFile file(target);
  CHECK(folder.entry_count() == 0);
}

TEST_CASE("A folder of files is committed as a whole") {
  const Folder folder;
  AtomicFile slices(folder / "slices/");
  fs::create_directory(slices.temporary_path());
  write(slices.temporary_path() / "0.png", "x");
  slices.commit();
  CHECK(read(folder / "slices" / "0.png") == "x");
}

TEST_CASE("A folder that is not empty is never replaced") {
  const Folder folder;
  fs::create_directory(folder / "precious");
  write(folder / "precious" / "photo", "x");
  AtomicFile file(folder / "precious");
  write(file.temporary_path(), "new");
  CHECK_THROWS_WITH(file.commit(), ContainsSubstring("precious: cannot be replaced"));
  CHECK(read(folder / "precious" / "photo") == "x");
}

TEST_CASE("An output in a folder that does not exist is refused at once") {
  const Folder folder;
  CHECK_THROWS_WITH(AtomicFile(folder / "no" / "out.npy"), ContainsSubstring("there is no folder"));
}

TEST_CASE("An existing output is only overwritten by force") {
  const Folder folder;
  CHECK_NOTHROW(refuse_overwrite(folder / "out", false));
  write(folder / "out", "x");
  CHECK_THROWS_WITH(refuse_overwrite(folder / "out", false), ContainsSubstring("exists already"));
  CHECK_NOTHROW(refuse_overwrite(folder / "out", true));
  fs::create_directory(folder / "folder");
  CHECK_THROWS_WITH(refuse_overwrite(folder / "folder", true),
                    ContainsSubstring("a folder, which is never replaced"));
}

TEST_CASE("An output is never the file of an input") {
  const Folder folder;
  const std::vector<fs::path> inputs{folder / "first", folder / "in"};
  CHECK_NOTHROW(check_output(folder / "out", inputs, false));
  write(folder / "in", "x");
  CHECK_NOTHROW(check_output(folder / "out", inputs, false));
  fs::create_symlink(folder / "in", folder / "link");
  for (const char* name : {"in", "link"})
    CHECK_THROWS_WITH(check_output(folder / name, inputs, true),
                      ContainsSubstring("expected another name"));
}

TEST_CASE("An output is checked before there is anything to write") {
  const Folder folder;
  write(folder / "out", "x");
  CHECK_THROWS_WITH(check_output(folder / "out", {}, false), ContainsSubstring("exists already"));
  CHECK_NOTHROW(check_output(folder / "out", {}, true));
  CHECK(read(folder / "out") == "x");
  CHECK_THROWS_WITH(check_output(folder / "no" / "out", {}, false),
                    ContainsSubstring("there is no folder"));
}

TEST_CASE("Error messages name the target, not the temporary file") {
  const Folder folder;
  const fs::path target = folder / "out.npy";
  CHECK_THROWS_WITH(write_completely(target,
                                     [](const fs::path& file) {
                                       write(file, "half");
                                       throw WriteError(file, "a reason");
                                     }),
                    target.string() + ": cannot write: a reason");
  CHECK(folder.entry_count() == 0);
  CHECK_THROWS_AS(write_completely(target, [](const fs::path&) { throw Interrupted(); }),
                  Interrupted);
  CHECK(folder.entry_count() == 0);
}

TEST_CASE("Extensions are compared in lower case") {
  CHECK(lower_extension("a.b/PICTURE.Exr") == ".exr");
  CHECK(lower_extension("folder") == "");
}

TEST_CASE("Available memory is the minimum of all limits") {
  const Folder folder;
  const auto put = [&](const fs::path& file, const std::string& text) {
    fs::create_directories((folder / "x").parent_path() / file.parent_path());
    write((folder / "x").parent_path() / file, text);
  };
  const auto available = [&] { return available_memory((folder / "x").parent_path()); };
  constexpr std::uint64_t mib = 1 << 20;
  put("proc/meminfo", "MemTotal: 900000 kB\nMemAvailable: 204800 kB\nSwapFree: 1024 kB\n");
  CHECK(available() == 201 * mib);
  put("proc/self/cgroup", "3:cpu,cpuacct:/a/b\n2:memory:/a/b\n1:pids:/\n0::/c/d\n");
  CHECK(available() == 201 * mib);

  // Version 2: the group has no limit, the one around it has.
  const auto number = [](std::uint64_t bytes) { return std::to_string(bytes) + "\n"; };
  put("sys/fs/cgroup/c/d/memory.max", "max\n");
  put("sys/fs/cgroup/c/d/memory.current", number(100 * mib));
  put("sys/fs/cgroup/c/memory.max", number(150 * mib));
  put("sys/fs/cgroup/c/memory.current", number(140 * mib));
  CHECK(available() == 10 * mib);
  // Pages of files can be taken back.
  put("sys/fs/cgroup/c/memory.stat",
      "anon 5\ninactive_file " + number(20 * mib) + "active_file " + number(30 * mib));
  CHECK(available() == 60 * mib);

  // Version 1.
  put("sys/fs/cgroup/memory/a/b/memory.limit_in_bytes", number(100 * mib));
  put("sys/fs/cgroup/memory/a/b/memory.usage_in_bytes", number(95 * mib));
  put("sys/fs/cgroup/memory/a/b/memory.stat", "total_inactive_file " + number(mib));
  CHECK(available() == 6 * mib);
  put("sys/fs/cgroup/memory/a/b/memory.usage_in_bytes", number(110 * mib));
  CHECK(available() == 0);
}

TEST_CASE("Bytes are printed in a suitable unit") {
  CHECK(format_bytes(0) == "0 bytes");
  CHECK(format_bytes(1023) == "1023 bytes");
  CHECK(format_bytes(1536) == "1.5 KiB");
  CHECK(format_bytes(92.0 * 0x1p40) == "92.0 TiB");
  CHECK(format_bytes(0x1p80) == "1048576.0 EiB");
}

TEST_CASE("Counts are printed with the plural of their noun") {
  CHECK(count_of(1, "sample") == "1 sample");
  CHECK(count_of(0, "ray") == "0 rays");
  CHECK(count_of(99'999, "ray") == "99999 rays");
  CHECK(count_of(1'730'000, "texture point") == "1.7 million texture points");
}

TEST_CASE("A need beyond the limit is refused with both numbers") {
  CHECK_NOTHROW(check_memory("a.vdb", 1, ""));
  CHECK_THROWS_WITH(check_memory("a.vdb", 0x1p70, "use .npy"),
                    ContainsSubstring("a.vdb: needs 1024.0 EiB of memory, ") &&
                        ContainsSubstring("iB are available; use .npy"));
  const Folder folder;
  CHECK_NOTHROW(check_disk(folder / "a.npy", 1, ""));
  CHECK_THROWS_WITH(check_disk(folder / "a.npy", 0x1p70, ""),
                    ContainsSubstring("a.npy: needs 1024.0 EiB on the disk, "));
}

TEST_CASE("Durations are printed like a clock") {
  CHECK(format_duration(0) == "0:00");
  CHECK(format_duration(59.6) == "1:00");
  CHECK(format_duration(3723) == "1:02:03");
  CHECK(format_duration(1e300) == "277777:46:40");
}

TEST_CASE("A refused value of an option is named, with what is allowed in words") {
  CLI::App app("tests options", "tool");
  int count = 0, mode = 0;
  double seconds = 0;
  const std::map<std::string, int> modes{{"fast", 2}, {"good", 3}, {"slow", 5}};
  app.add_option("--count", count)->check(in_range(1, 1 << 20));
  app.add_option("--seconds", seconds)->check(in_range(0.5, 60.0));
  app.add_option("--axis")->check(one_of({"y", "z"}));
  app.add_option("--mode", mode)->transform(one_of(modes));
  const auto message = [&](const std::string& line) -> std::string {
    try {
      app.parse(line);
      return "";
    } catch (const CLI::ParseError& error) {
      return error.what();
    }
  };
  CHECK(message("--count 0") == "--count: found 0, expected a whole number from 1 to 1048576");
  CHECK(message("--count 2x") == "--count: found 2x, expected a whole number from 1 to 1048576");
  CHECK(message("--seconds nan") == "--seconds: found nan, expected a number from 0.5 to 60");
  CHECK(message("--axis q") == "--axis: found q, expected y or z");
  CHECK(message("--mode 2") == "--mode: found 2, expected fast, good or slow");
  CHECK(message("--count 1048576 --seconds 0.5 --axis z --mode slow").empty());
  CHECK((count == 1048576 && seconds == 0.5 && mode == 5));
  CHECK(app.help().find("FLOAT:0.5..60") != std::string::npos);
}

TEST_CASE("The exit code says how a tool ended") {
  bool worked = false;
  CHECK(run({"-o", "x"}, [&] { worked = true; }) == exit_success);
  CHECK(worked);
  CHECK(run({"--help"}, [] { FAIL("work on --help"); }) == exit_success);
  CHECK(run({}, [] { FAIL("work without an output"); }) == exit_usage);
  CHECK(run({"-o", "x"}, [] { throw std::runtime_error("broken"); }) == exit_failure);
  CHECK(run({"-o", "x"}, [] { throw std::bad_alloc(); }) == exit_failure);
  CHECK(run({"-o", "x"}, [] { throw Interrupted(); }) == exit_interrupted);
}

TEST_CASE("Wrong usage is named as the user wrote it, and help wins over it") {
  const auto wrong = [](const std::string& text) {
    return std::pair("a-tool: " + text, static_cast<int>(exit_usage));
  };
  CHECK(answer({"-o", "x", "--size", "10"}) == wrong("--size: found 10, expected W,H"));
  CHECK(answer({"-o", "x", "--size", "1,2,3"}) == wrong("--size: found 1,2,3, expected W,H"));
  CHECK(answer({"-o", "x", "--size"}) == wrong("--size: found nothing, expected W,H"));
  CHECK(answer({"--nonsense"}) == wrong("found an unknown option --nonsense"));
  CHECK(answer({"--sise=3"}) == wrong("found an unknown option --sise=3; did you mean --size?"));
  CHECK(answer({"--ver"}) ==
        wrong("found an unknown option --ver; did you mean --verbose or --version?"));
  CHECK(answer({"more", "--size", "10", "--x"}) == wrong("found an argument too many, more"));
  CHECK(answer({"--size", "10", "--nonsense", "--help"}) ==
        std::pair(std::string("A test."), exit_success));
  CHECK(answer({"--size", "10", "--version"}).first.starts_with("a-tool 0."));
}

TEST_CASE("An unknown option in the file of --config is named with the file") {
  const Folder folder;
  const std::string file = folder / "c.toml";
  write(file, "x = 1\n");
  CHECK(answer({"-o", "y", "--config", file.c_str()}).first ==
        "a-tool: --config: " + file +
            ": found an unknown option x, expected one that --help lists");
  CHECK(answer({"--config", file.c_str(), "--help"}).second == exit_success);
  write(file, "[part]\no = 1\n");
  CHECK_THAT(answer({"--config", file.c_str()}).first,
             ContainsSubstring("found an unknown option [part]"));
  CHECK(answer({"--config", (file + "x").c_str()}).first ==
        "a-tool: --config: " + file +
            "x: found no file that can be read, expected one of options "
            "in TOML");
  write(file, "o = \"y\"\nsize = [3, 4]\n");
  CHECK(answer({"--config", file.c_str()}) == std::pair(std::string(), exit_success));
}

TEST_CASE("Ctrl-C sets a flag, and the work stops where it checks it") {
  CHECK_FALSE(interrupted());
  CHECK_NOTHROW(throw_if_interrupted());
  install_interrupt_handler();
  std::raise(SIGINT);
  CHECK(interrupted());
  CHECK_THROWS_AS(throw_if_interrupted(), Interrupted);
}
