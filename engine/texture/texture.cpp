#include "engine/texture/texture.h"

#include <utility>

#include "engine/texture/family.h"
#include "engine/texture/parallel.h"

namespace solidtex::engine {
namespace {

std::unique_ptr<Family> make_family(Model& model, std::uint64_t seed,
                                    std::uint64_t cache_limit_bytes, Precision precision) {
  LightChannels light(model.channels, model.color_space);
  if (auto* field = std::get_if<FieldModel>(&model.architecture)) {
    return make_field_family(Field(std::move(*field), model.noise_scheme, seed), std::move(light),
                             cache_limit_bytes);
  }
  return make_sampler_family(Sampler(std::move(std::get<SamplerModel>(model.architecture)),
                                     model.noise_scheme, seed, precision),
                             std::move(light));
}

}  // namespace

struct Texture::Impl {
  Model model;
  std::uint64_t seed;
  Precision precision;
  std::unique_ptr<Family> family;

  std::size_t channels() const { return model.channels.size(); }
};

Texture::Texture(Model model, std::uint64_t seed, std::uint64_t cache_limit_bytes,
                 Precision precision)
    : impl_(std::make_unique<Impl>(Impl{std::move(model), seed, precision, nullptr})) {
  const DefaultFloatMode mode;
  impl_->family = make_family(impl_->model, seed, cache_limit_bytes, precision);
}

Texture::~Texture() = default;

const Model& Texture::model() const { return impl_->model; }

std::uint64_t Texture::seed() const { return impl_->seed; }

Precision Texture::precision() const { return impl_->precision; }

void Texture::eval_points(const double origin[3], const float* points, std::size_t count,
                          const Answers& answers) const {
  const DefaultFloatMode mode;
  const PointBatch batch{{origin[0], origin[1], origin[2]}, points, count};
  check_points(batch, impl_->channels() * (answers.gradients ? 3 : 1));
  impl_->family->eval_points(batch, answers);
}

void Texture::eval_filtered(const double origin[3], const float* points, const float* radii,
                            std::size_t count, const Answers& answers) const {
  const DefaultFloatMode mode;
  const PointBatch batch{{origin[0], origin[1], origin[2]}, points, count};
  check_points(batch, impl_->channels() * (answers.gradients ? 3 : 1));
  check_radii(radii, count);
  impl_->family->eval_filtered(batch, radii, answers);
}

void Texture::eval_footprints(const double origin[3], const float* points, const float* axes,
                              std::size_t count, const Answers& answers) const {
  const DefaultFloatMode mode;
  const PointBatch batch{{origin[0], origin[1], origin[2]}, points, count};
  check_points(batch, impl_->channels() * (answers.gradients ? 3 : 1));
  check_axes(axes, count);
  impl_->family->eval_footprints(batch, axes, answers);
}

void Texture::eval_box(const std::int64_t origin[3], const std::int64_t size[3],
                       float* values) const {
  const DefaultFloatMode mode;
  const Box box = checked_box(origin, size, impl_->channels());
  if (!box.empty()) impl_->family->eval_box(box, values);
}

CacheStats Texture::cache_stats() const { return impl_->family->cache_stats(); }

}  // namespace solidtex::engine
