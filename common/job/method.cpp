#include "common/job/method.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/job/sequence.h"

namespace baton {
namespace {

std::int64_t as_many_as_samples(const SamplingSpec& s) { return most_particles(s); }
LightUse no_light(const SamplingSpec&) { return {}; }
LightUse by_candidates(const SamplingSpec& s) { return {.num_taken = s.num_candidates}; }

LightUse of_sequential(const SamplingSpec& s) {
  LightUse use = traits(s.start_method).light(s);
  use.with_before = true;
  return use;
}

/// Pixels choose their number.
std::int64_t rays_of_pool(const SamplingSpec& s) {
  return std::min<std::int64_t>(limits::kMostPoolRays * s.num_particles, limits::kMaxParticles);
}

/// In the order of the enumeration.
constexpr std::array<MethodTraits, kNumMethods> kTraits{{
    {.name = kMethodNames[0],
     .no_second_pass = "which keeps no samples",
     .light = no_light,
     // A sample is a pair, one from the environment and one from the BRDF.
     .most_rays = [](const SamplingSpec& s) { return std::int64_t{2} * s.reference_samples; }},
    {.name = kMethodNames[1],
     .keeps_samples = true,
     .draws_anew = true,
     .light = [](const SamplingSpec& s) { return LightUse{.num_taken = s.num_particles}; },
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[2],
     .keeps_samples = true,
     .draws_anew = true,
     .light = no_light,
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[3],
     .keeps_samples = true,
     .draws_anew = true,
     .light =
         [](const SamplingSpec& s) {
           return LightUse{.num_taken =
                               s.num_particles - num_from_brdf(s.num_particles, s.brdf_fraction)};
         },
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[4],
     .keeps_samples = true,
     .draws_anew = true,
     .light = by_candidates,
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[5],
     .carried = Carried::samples,
     .keeps_samples = true,
     .light = of_sequential,
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[6],
     .carried = Carried::memory,
     .no_second_pass = "whose rays are not its samples",
     .light = [](const SamplingSpec&) { return LightUse{.one_run = true}; },
     .most_rays = rays_of_pool},
    {.name = kMethodNames[7],
     .no_second_pass = "whose rays are not its samples",
     .light = by_candidates,
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[8],
     .carried = Carried::weighed_samples,
     .keeps_samples = true,
     .asks_neighbors = true,
     .no_second_pass = "whose samples are carried as one set",
     .light = by_candidates,
     .most_rays = as_many_as_samples},
    {.name = kMethodNames[9],
     .keeps_samples = true,
     .light = no_light,
     .most_rays = as_many_as_samples},
}};

}  // namespace

const MethodTraits& traits(Method method) { return kTraits[static_cast<std::size_t>(method)]; }

Method method_of(std::string_view name) {
  const auto* const found = std::find(kMethodNames.begin(), kMethodNames.end(), name);
  BATON_CHECK(found != kMethodNames.end());
  return static_cast<Method>(found - kMethodNames.begin());
}

std::int32_t num_from_brdf(std::int32_t total, float brdf_fraction) {
  return static_cast<std::int32_t>(std::lround(static_cast<float>(total) * brdf_fraction));
}

}  // namespace baton
