#include "space.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

using nb::literals::operator""_a;

namespace {

using Pixels = nb::ndarray<const float, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// Runs a call without the interpreter's lock.
template <class Call>
void run(const Call& call) {
  solidtex_clear_error();
  solidtex_status status;
  {
    const nb::gil_scoped_release unlocked;
    status = call();
  }
  check(status);
}

Material room(const Space& space) {
  return {std::vector<float>(solidtex_space_code_size(space.get())),
          std::vector<float>(solidtex_space_has_colors(space.get()) ? 12 : 0)};
}

Material photograph(const Space& space, std::size_t index) {
  Material result = room(space);
  run([&] {
    return solidtex_space_photograph(space.get(), index, result.code.data(), result.colors.data());
  });
  return result;
}

Material encode(const Space& space, const Pixels& pixels, bool medoid) {
  Material result = room(space);
  const auto patches = medoid ? SOLIDTEX_PATCHES_MEDOID : SOLIDTEX_PATCHES_AVERAGE;
  run([&] {
    return solidtex_space_encode(space.get(), pixels.data(), pixels.shape(1), pixels.shape(0),
                                 patches, result.code.data(), result.colors.data());
  });
  return result;
}

Material blend(const Space& space, const std::vector<Material>& materials,
               const std::vector<double>& weights) {
  std::vector<float> codes, colors;
  for (const Material& one : materials) {
    codes.insert(codes.end(), one.code.begin(), one.code.end());
    colors.insert(colors.end(), one.colors.begin(), one.colors.end());
  }
  Material result = room(space);
  run([&] {
    return solidtex_space_blend(space.get(), materials.size(), weights.data(), codes.data(),
                                colors.data(), result.code.data(), result.colors.data());
  });
  return result;
}

void write_model(const Space& space, const Material& material, const nb::bytes& details,
                 const nb::bytes& path) {
  run([&] {
    return solidtex_space_write_model(space.get(), material.code.data(), material.colors.data(),
                                      details.c_str(), path.c_str());
  });
}

std::vector<std::string> photographs(const Space& space) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < solidtex_space_photograph_count(space.get()); ++i)
    names.push_back(text(solidtex_space_photograph_name(space.get(), i)));
  return names;
}

std::string family(const Space& space) {
  switch (solidtex_space_family(space.get())) {
    case SOLIDTEX_FAMILY_LATTICE: return "lattice";
    case SOLIDTEX_FAMILY_SAMPLER: return "sampler";
    case SOLIDTEX_FAMILY_NONE: break;
  }
  return "none";
}

}  // namespace

Space::Space(const nb::bytes& space) {
  solidtex_clear_error();
  handle_.reset(solidtex_space_open(space.c_str()), solidtex_space_release);
  if (!handle_) check(solidtex_error_status());
}

void bind_space(nb::module_& m) {
  nb::class_<Material>(m, "Material", "Material of a space.")
      .def(nb::init<std::vector<float>, std::vector<float>>(), "code"_a, "colors"_a)
      .def_ro("code", &Material::code)
      .def_ro("colors", &Material::colors);
  nb::class_<Space>(m, "Space", "An open texture space.")
      .def(nb::init<const nb::bytes&>(), "space"_a)
      .def_prop_ro("name", [](const Space& s) { return text(solidtex_space_name(s.get())); })
      .def_prop_ro("path", [](const Space& s) { return nb::bytes(solidtex_space_path(s.get())); })
      .def_prop_ro("sha256", [](const Space& s) { return text(solidtex_space_sha256(s.get())); })
      .def_prop_ro("metadata_json",
                   [](const Space& s) { return text(solidtex_space_metadata_json(s.get())); })
      .def_prop_ro("family", &family)
      .def_prop_ro("code_size", [](const Space& s) { return solidtex_space_code_size(s.get()); })
      .def_prop_ro("has_colors",
                   [](const Space& s) { return solidtex_space_has_colors(s.get()) != 0; })
      .def_prop_ro("patch_size", [](const Space& s) { return solidtex_space_patch_size(s.get()); })
      .def_prop_ro("resolution", [](const Space& s) { return solidtex_space_resolution(s.get()); })
      .def_prop_ro("photographs", &photographs)
      .def("photograph", &photograph, "index"_a)
      .def("encode", &encode, "pixels"_a, "medoid"_a,
           nb::sig("def encode(self, pixels: object, medoid: bool) -> Material"))
      .def("blend", &blend, "materials"_a, "weights"_a)
      .def("write_model", &write_model, "material"_a, "details"_a, "path"_a);
}
