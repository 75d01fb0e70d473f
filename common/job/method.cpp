#include "common/job/method.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/job/job_facts.h"

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
constexpr MethodTraits kTraits[] = {
    {.name = "reference",
     .tells_variance = true,
     .no_second_pass = "which keeps no samples",
     .light = no_light,
     // A sample is a pair, one from the environment and one from the BRDF.
     .most_rays = [](const SamplingSpec& s) { return std::int64_t{2} * s.reference_samples; }},
    {.name = "environment",
     .keeps_samples = true,
     .draws_anew = true,
     .light = [](const SamplingSpec& s) { return LightUse{.num_taken = s.num_particles}; },
     .most_rays = as_many_as_samples},
    {.name = "brdf",
     .keeps_samples = true,
     .draws_anew = true,
     .light = no_light,
     .most_rays = as_many_as_samples},
    {.name = "mis",
     .keeps_samples = true,
     .draws_anew = true,
     .compensates = true,
     .light =
         [](const SamplingSpec& s) {
           return LightUse{.num_taken =
                               s.num_particles - num_from_brdf(s.num_particles, s.brdf_fraction)};
         },
     .most_rays = as_many_as_samples},
    {.name = "bidirectional",
     .keeps_samples = true,
     .draws_anew = true,
     .equal_weights = true,
     .light = by_candidates,
     .most_rays = as_many_as_samples},
    {.name = "sequential",
     .carried = Carried::samples,
     .keeps_samples = true,
     .moves_samples = true,
     .light = of_sequential,
     .most_rays = as_many_as_samples},
    {.name = "pool",
     .carried = Carried::memory,
     .most_bytes_beside_samples = 12,
     .most_block_bytes = 1024 + 64,
     .capped_light = 0.1f,
     .no_second_pass = "whose rays are not its samples",
     .light = [](const SamplingSpec&) { return LightUse{.one_run = true}; },
     .most_rays = rays_of_pool},
    {.name = "ratio",
     .no_second_pass = "whose rays are not its samples",
     .light = by_candidates,
     .most_rays = as_many_as_samples},
    {.name = "restir",
     .carried = Carried::weighed_samples,
     .most_bytes_beside_samples = 2,
     .keeps_samples = true,
     .asks_neighbors = true,
     .no_second_pass = "whose samples are carried as one set",
     .light = by_candidates,
     .most_rays = as_many_as_samples},
    // Settled before anything is rendered; until then its numbers are those of the usual methods.
    {.name = "auto",
     .keeps_samples = true,
     .compensates = true,
     .light = no_light,
     .most_rays = as_many_as_samples},
};
static_assert(std::size(kTraits) == static_cast<std::size_t>(Method::automatic) + 1);

constexpr auto kNames = [] {
  std::array<std::string_view, std::size(kTraits)> names;
  std::transform(std::begin(kTraits), std::end(kTraits), names.begin(),
                 [](const MethodTraits& row) { return row.name; });
  return names;
}();

}  // namespace

const MethodTraits& traits(Method method) { return kTraits[static_cast<std::size_t>(method)]; }

std::span<const std::string_view> method_names() { return kNames; }

Method method_of(std::string_view name) {
  const auto* const found = std::find(kNames.begin(), kNames.end(), name);
  BATON_CHECK(found != kNames.end());
  return static_cast<Method>(found - kNames.begin());
}

std::int32_t num_from_brdf(std::int32_t total, float brdf_fraction) {
  return static_cast<std::int32_t>(std::lround(static_cast<float>(total) * brdf_fraction));
}

}  // namespace baton
