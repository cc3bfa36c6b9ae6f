#include <csignal>
#include <fstream>
#include <iterator>

#include "catch.hpp"
#include "tools/common/atomic_file.h"
#include "tools/common/cli.h"
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
  app.add_option("-o", output)->required();
  arguments.insert(arguments.begin(), "a-tool");
  return run_tool(app, static_cast<int>(arguments.size()), const_cast<char**>(arguments.data()),
                  work);
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

TEST_CASE("A folder of files is committed as a whole") {
  const Folder folder;
  AtomicFile slices(folder / "slices/");
  fs::create_directory(slices.temporary_path());
  write(slices.temporary_path() / "0.png", "x");
  slices.commit();
  CHECK(read(folder / "slices" / "0.png") == "x");
}

TEST_CASE("A folder that holds something is never replaced") {
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
}

TEST_CASE("Durations read like a clock") {
  CHECK(format_duration(0) == "0:00");
  CHECK(format_duration(59.6) == "1:00");
  CHECK(format_duration(3723) == "1:02:03");
  CHECK(format_duration(1e300) == "277777:46:40");
}

TEST_CASE("The exit code says how a tool ended") {
  bool worked = false;
  CHECK(run({"-o", "x"}, [&] { worked = true; }) == exit_success);
  CHECK(worked);
  CHECK(run({"--help"}, [] { FAIL("work on --help"); }) == exit_success);
  CHECK(run({}, [] { FAIL("work without an output"); }) == exit_usage);
  CHECK(run({"-o", "x"}, [] { throw std::runtime_error("broken"); }) == exit_failure);
  CHECK(run({"-o", "x"}, [] { throw Interrupted(); }) == exit_interrupted);
}

TEST_CASE("Ctrl-C raises a flag, and the work stops where it looks") {
  CHECK_FALSE(interrupted());
  CHECK_NOTHROW(throw_if_interrupted());
  install_interrupt_handler();
  std::raise(SIGINT);
  CHECK(interrupted());
  CHECK_THROWS_AS(throw_if_interrupted(), Interrupted);
}
