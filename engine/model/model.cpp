#include "engine/model/model.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

constexpr const char* metadata_key = "solidtex";

Error unreadable(const std::filesystem::path& path, const std::string& why) {
  return Error(SOLIDTEX_IO_ERROR, path.string() + ": cannot read: " + why);
}

std::vector<std::byte> read_bytes(const std::filesystem::path& path) {
  std::error_code problem;
  const auto status = std::filesystem::status(path, problem);
  if (problem) throw unreadable(path, problem.message());
  if (!std::filesystem::is_regular_file(status)) throw unreadable(path, "not a regular file");
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem) throw unreadable(path, problem.message());
  if (size > max_file_bytes)
    throw invalid(path.string(), "file size", std::to_string(size) + " bytes",
                  "at most " + std::to_string(max_file_bytes));
  std::ifstream file(path, std::ios::binary);
  if (!file) throw unreadable(path, std::strerror(errno));
  std::vector<std::byte> bytes(size);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw unreadable(path, "it ended after " + std::to_string(file.gcount()) + " of " +
                               std::to_string(size) + " bytes");
  return bytes;
}

void read_architecture(const Fields& document, TensorSource& tensors, Model& model) {
  const std::string family = document.choice("family", {"field", "sampler"});
  const std::string other = family == "field" ? "sampler" : "field";
  if (document.contains(other))
    throw invalid(document.label(), other, "this key",
                  "only " + family + ", the key of the family");
  if (family == "field")
    model.architecture = read_lattice(document.child(family), model, tensors);
  else
    model.architecture = read_sampler(document.child(family), model, tensors);
}

}  // namespace

Model parse_model(std::span<const std::byte> bytes, const std::string& label) {
  const Container container = parse_container(bytes, label);
  const std::string where = std::string("__metadata__.") + metadata_key;
  const auto metadata = container.metadata.find(metadata_key);
  if (metadata == container.metadata.end())
    throw invalid(label, where, "nothing", "the model's JSON document");

  Model model;
  model.metadata_json = metadata->second;
  const nlohmann::json json = parse_json(label, where, model.metadata_json);
  const Fields document(label, "", json);
  read_document(document, model);
  TensorSource tensors(label, container.tensors);
  read_architecture(document, tensors, model);
  tensors.expect_all_taken();
  for (const auto& [name, view] : container.tensors)
    model.parameter_count += view.bytes.size() / sizeof(float);
  return model;
}

Model read_model(const std::filesystem::path& path) {
  return parse_model(read_bytes(path), path.string());
}

}  // namespace solidtex::engine
