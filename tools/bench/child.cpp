#include "tools/bench/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <chrono>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "tools/common/cli.h"

extern char** environ;

namespace solidtex::tools {
namespace {

constexpr auto poll_interval = std::chrono::milliseconds(20);
constexpr std::uint64_t bytes_per_maxrss = 1024;

pid_t start(const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& argument : command)
    arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int problem = posix_spawn(&child, arguments[0], &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (problem != 0)
    throw std::runtime_error(command[0] + ": cannot be started: " + std::strerror(problem));
  return child;
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}

// Polls, so that a signal to this program alone also reaches the child.
int wait(pid_t child, rusage& usage) {
  int status = 0;
  bool is_stopped = false;
  while (wait4(child, &status, WNOHANG, &usage) == 0) {
    if (interrupted() && !is_stopped) kill(child, SIGTERM);
    is_stopped = interrupted();
    std::this_thread::sleep_for(poll_interval);
  }
  return status;
}

}  // namespace

ChildUsage run_child(const std::vector<std::string>& command) {
  const auto begin = std::chrono::steady_clock::now();
  rusage usage = {};
  const int status = wait(start(command), usage);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  throw_if_interrupted();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(fmt::format(
        "{} failed ({} {})", fmt::join(command, " "), WIFEXITED(status) ? "exit code" : "signal",
        WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status)));
  return {wall.count(), seconds(usage.ru_utime) + seconds(usage.ru_stime),
          static_cast<std::uint64_t>(usage.ru_maxrss) * bytes_per_maxrss};
}

std::filesystem::path sibling_program(const std::string& name) {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
}

}  // namespace solidtex::tools
