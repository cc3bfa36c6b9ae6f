// Mixtures of materials of one texture space. Materials are given by name: models of the space, and
// its training photographs.
#pragma once

#include <nlohmann/json.hpp>
#include <solidtex/solidtex.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace solidtex::spaces {

// Materials that cannot be mixed. what() names the input, what was found and what was expected.
struct MixtureError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Name of a training photograph, SPACE:PHOTOGRAPH. `space` is empty for the name of a model.
struct Name {
  std::string space, photograph;
};
Name split_name(const std::string& name);

// Whether a model's document (docs/file-format.md) has a code of a space that describes the model:
// it records its space and was not fine-tuned.
bool has_code(const nlohmann::ordered_json& document);

// Opens a material by name: a model, or a training photograph of a space.
solidtex::texture open_material(const std::string& name, const solidtex::options& options);

class Mixture {
 public:
  // Opens at least two materials: each a model, by path or name, or a training photograph. The
  // space is `space`, a path or a name, or the one that the first input names. Throws MixtureError
  // for models of other spaces, other versions of the space, fine-tuned models and unknown
  // photographs. Messages call `space` by its `option`.
  explicit Mixture(const std::vector<std::string>& names, const std::string& space = "",
                   const std::string& option = "--space");

  const solidtex::space& space() const { return space_; }
  std::size_t size() const { return inputs_.size(); }

  // Returns the material of `weights`, one for each input: at least 0, with a positive sum. Where
  // one weight only is positive, this is exactly that input.
  solidtex::material blend(std::span<const double> weights) const;

  // Returns `details` of solidtex_space_write_model: the inputs' licenses and photographs.
  std::string details(const std::string& model_name, std::span<const double> weights) const;

 private:
  struct Input {
    std::string name;
    solidtex::material material;
    nlohmann::ordered_json exemplars = nlohmann::ordered_json::array();
    std::string license{};
  };

  Input photograph(const std::string& given, const std::string& photograph) const;
  Input model(const std::string& given, const nlohmann::ordered_json& document) const;
  void check_space(const std::string& given, const nlohmann::ordered_json& recorded) const;
  std::string shown_space() const;

  solidtex::space space_;
  std::string wanted_;  // space, for messages
  std::vector<Input> inputs_;
};

// Returns the weights of `count` inputs at a position from 0 to 1 on the walk from the first input
// through all others, in equal steps, to the last.
std::vector<double> weights_at(double position, std::size_t count);

}  // namespace solidtex::spaces
