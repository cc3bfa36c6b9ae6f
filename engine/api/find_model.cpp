#include <dlfcn.h>
#include <strings.h>

#include <cstdlib>
#include <set>
#include <sstream>
#include <vector>

#include "engine/api/handle.h"
#include "engine/common/error.h"

namespace solidtex::engine {
namespace {

namespace fs = std::filesystem;

// Capitals are accepted too.
bool has_extension(const fs::path& path, const char* extension) {
  return strcasecmp(path.extension().c_str(), extension) == 0;
}

// Returns the folder of the library or program that contains this code.
fs::path library_folder() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&find_model), &info) == 0 || !info.dli_fname) return {};
  std::error_code ignored;
  return fs::canonical(info.dli_fname, ignored).parent_path();
}

std::vector<fs::path> model_folders() {
  std::vector<fs::path> folders;
  const auto add = [&](const fs::path& folder) {
    for (const fs::path& known : folders) {
      if (known == folder) return;
    }
    folders.push_back(folder);
  };
  if (const char* variable = std::getenv("SOLIDTEX_MODEL_PATH")) {
    std::istringstream paths(variable);
    for (std::string path; std::getline(paths, path, ':');) {
      if (!path.empty()) add(path);
    }
  }
  // Folders relative to the library come first, so that an installation can be moved. The build
  // tree has the layout of an installation.
  if (const fs::path library = library_folder(); !library.empty()) {
    add((library / SOLIDTEX_MODELS_FROM_LIBRARY).lexically_normal());
    add((library / "../share/solidtex/models").lexically_normal());
  }
  add(SOLIDTEX_INSTALLED_MODELS);
  return folders;
}

std::set<std::string> names_in(const std::vector<fs::path>& folders, const char* extension) {
  std::set<std::string> names;
  for (const fs::path& folder : folders) {
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
      if (entry->path().extension() == extension) names.insert(entry->path().stem());
    }
  }
  return names;
}

template <class List>
std::string joined(const List& list) {
  std::string text;
  for (const auto& item : list) text += (text.empty() ? "" : ", ") + std::string(item);
  return text.empty() ? "none" : text;
}

// Says which of the names differs from `given` in capitals only, if one does.
std::string in_other_letters(const std::string& given, const std::set<std::string>& names) {
  for (const std::string& name : names)
    if (strcasecmp(name.c_str(), given.c_str()) == 0) return ", but one \"" + name + '"';
  return {};
}

// Returns the path of a file that is given by path, or by name in the model folders.
fs::path find_file(const std::string& given, const char* extension, const std::string& what) {
  if (given.empty()) throw Error(SOLIDTEX_INVALID_ARGUMENT, "the " + what + " name is empty");
  fs::path path(given);  // moved to the caller
  if (path.has_parent_path() || has_extension(path, extension)) return path;
  const std::vector<fs::path> folders = model_folders();
  for (const fs::path& folder : folders) {
    fs::path candidate = folder / (given + extension);
    std::error_code ignored;
    if (fs::is_regular_file(candidate, ignored)) return candidate;
  }
  const std::string missing = "no " + what + " is named \"" + given + "\"";
  std::error_code ignored;
  if (const std::string file = given + extension; fs::is_regular_file(file, ignored))
    throw Error(SOLIDTEX_IO_ERROR, missing + "; " + file + " is a file: name it so");
  const std::set<std::string> names = names_in(folders, extension);
  throw Error(SOLIDTEX_IO_ERROR,
              missing + in_other_letters(given, names) + " (a path needs a slash or the ending " +
                  extension + "); there are: " + joined(names) + "; searched: " + joined(folders));
}

}  // namespace

fs::path find_model(const std::string& model) { return find_file(model, ".solidtex", "model"); }

std::set<std::string> model_names() { return names_in(model_folders(), ".solidtex"); }

fs::path find_space(const std::string& space) {
  return find_file(space, ".solidtex-space", "texture space");
}

}  // namespace solidtex::engine
