#include "engine/model/model.h"

#include "engine/model/readers.h"

namespace solidtex::engine {
namespace {

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
  const Container container = parse_container(bytes, label, model_file);
  Model model;
  model.metadata_json = container.document;
  const JsonDocument json(label, "__metadata__.solidtex", model.metadata_json);
  const Fields document(label, "", json.root());
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
