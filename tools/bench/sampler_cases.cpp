// The sampler family: points.
#include "tools/bench/cost.h"
#include "tools/bench/points.h"

namespace solidtex::tools {
namespace {

// Each unit has a value and three derivatives: four times the arithmetic.
Case sampler_case(const solidtex::texture& texture, const PointQuery& query) {
  Case made = point_case(texture, query);
  made.multiply_adds_per_unit =
      direct_multiply_adds(nlohmann::json::parse(texture.metadata_json())) *
      (query.with_gradients ? 4 : 1);
  return made;
}

PointQuery one_by_one(const CaseSettings& settings) {
  return {.fill = scatter, .count = settings.quick ? 8 : 512, .per_call = 1};
}

PointQuery with_gradients(PointQuery query) {
  query.with_gradients = true;
  return query;
}

}  // namespace

std::vector<CaseInfo> sampler_cases() {
  using S = CaseSettings;
  return {
      {.name = "sampler.batch",
       .about = "4096 points scattered in a cube of 256^3 texels",
       .parallel = true,
       .make = [](Models& m,
                  const S& s) { return sampler_case(m.sampler(), batch_of(s, scatter)); }},
      {.name = "sampler.batch.gradients",
       .about = "the points of sampler.batch with gradients",
       .parallel = true,
       .make =
           [](Models& m, const S& s) {
             return sampler_case(m.sampler(), with_gradients(batch_of(s, scatter)));
           }},
      {.name = "sampler.fast",
       .about = "the points of sampler.batch in fast precision",
       .parallel = true,
       .make = [](Models& m,
                  const S& s) { return sampler_case(m.fast_sampler(), batch_of(s, scatter)); }},
      {.name = "sampler.coherent",
       .about = "4096 points side by side on a plane",
       .parallel = true,
       .make = [](Models& m,
                  const S& s) { return sampler_case(m.sampler(), batch_of(s, lay_on_plane)); }},
      {.name = "sampler.point",
       .about = "one point a call, scattered in a cube of 256^3 texels",
       .make = [](Models& m, const S& s) { return sampler_case(m.sampler(), one_by_one(s)); }},
      {.name = "sampler.point.gradients",
       .about = "the points of sampler.point with gradients",
       .make = [](Models& m,
                  const S& s) { return sampler_case(m.sampler(), with_gradients(one_by_one(s))); }},
  };
}

}  // namespace solidtex::tools
