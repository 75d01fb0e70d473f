// How each method is made.
#include <algorithm>
#include <iterator>

#include "common/base/check.h"
#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/pool/pool_method.h"
#include "worker/method/ratio/ratio_method.h"
#include "worker/method/reference/reference.h"
#include "worker/method/restir/restir_sampler.h"
#include "worker/method/sequential/sequential_sampler.h"

namespace baton {
namespace {

using FreshSamplerPtr = std::unique_ptr<FreshSampler>;

PixelMethod make_pool(const JobSpec& job) { return make_pool_method(job); }

FreshSamplerPtr make_environment(const SamplingSpec& s) {
  return std::make_unique<DirectSampler>(CandidateCounts{.from_light = s.num_particles});
}
FreshSamplerPtr make_brdf(const SamplingSpec& s) {
  return std::make_unique<DirectSampler>(CandidateCounts{.from_bsdf = s.num_particles});
}
FreshSamplerPtr make_mis(const SamplingSpec& s) {
  return std::make_unique<DirectSampler>(split_candidates(s.num_particles, s.brdf_fraction));
}
FreshSamplerPtr make_bidirectional(const SamplingSpec& s) {
  return std::make_unique<BidirectionalSampler>(s.num_candidates, s.brdf_fraction);
}
FreshSamplerPtr make_start(const SamplingSpec& s) {
  SamplingSpec start = s;
  start.method = s.start_method;
  return make_fresh_sampler(start);
}

struct Maker {
  Method name;
  PixelMethod (*method)(const JobSpec&);
  FreshSamplerPtr (*fresh)(const SamplingSpec&);  ///< null for methods that keep no samples
};
/// In the order of the enumeration.
constexpr Maker kMakers[] = {
    {Method::reference, make_reference_method, nullptr},
    {Method::environment, make_fresh_method, make_environment},
    {Method::brdf, make_fresh_method, make_brdf},
    {Method::mis, make_fresh_method, make_mis},
    {Method::bidirectional, make_fresh_method, make_bidirectional},
    {Method::sequential, make_sequential_method, make_start},
    {Method::pool, make_pool, nullptr},
    {Method::ratio, make_ratio_method, nullptr},
    {Method::restir, make_restir_method, make_bidirectional},
};
static_assert(std::size(kMakers) == static_cast<std::size_t>(Method::automatic));
static_assert(std::ranges::is_sorted(kMakers, {}, &Maker::name));

const Maker& maker(Method method) { return kMakers[static_cast<std::size_t>(method)]; }

}  // namespace

PixelMethod make_pixel_method(const JobSpec& job) {
  BATON_CHECK(job.sampling.method != Method::automatic);
  return maker(job.sampling.method).method(job);
}

PixelMethod make_material_method(const MaterialSampling& material) {
  JobSpec job;
  job.sampling = as_sampling(material);
  return make_fresh_method(job);
}

FreshSamplerPtr make_fresh_sampler(const SamplingSpec& spec) {
  const auto make = maker(spec.method).fresh;
  return make != nullptr ? make(spec) : nullptr;
}

}  // namespace baton
