// How each method is made.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/base/check.h"
#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/pixel_method.h"
#include "worker/method/pool/pool_method.h"
#include "worker/method/ratio/ratio_method.h"
#include "worker/method/reference/reference.h"
#include "worker/method/restir/restir_sampler.h"
#include "worker/method/sequential/sequential_sampler.h"
#include "worker/method/weighted_method.h"

namespace baton {
namespace {

using SamplerPtr = std::unique_ptr<const PixelSampler>;
using MethodPtr = std::unique_ptr<const PixelMethod>;

template <class Of>
MethodPtr of_job(const JobSpec& job) {
  return std::make_unique<Of>(job);
}
template <class Of>
MethodPtr of_sampling(const JobSpec& job) {
  return std::make_unique<Of>(job.sampling);
}
MethodPtr make_reference(const JobSpec& job) {
  return std::make_unique<ReferenceMethod>(job.sampling.reference_samples);
}

SamplerPtr make_environment(const SamplingSpec& s) {
  return std::make_unique<DirectSampler>(CandidateCounts{.from_light = s.num_particles});
}
SamplerPtr make_brdf(const SamplingSpec& s) {
  return std::make_unique<DirectSampler>(CandidateCounts{.from_bsdf = s.num_particles});
}
SamplerPtr make_mis(const SamplingSpec& s) {
  return std::make_unique<DirectSampler>(split_candidates(s.num_particles, s.brdf_fraction));
}
SamplerPtr make_bidirectional(const SamplingSpec& s) {
  return std::make_unique<BidirectionalSampler>(s.num_candidates, s.brdf_fraction);
}
SamplerPtr make_restir(const SamplingSpec& s) { return std::make_unique<RestirSampler>(s); }
SamplerPtr make_sequential(const SamplingSpec& s) {
  const SequentialSettings settings{.num_particles = s.num_particles,
                                    .num_distributions = s.num_distributions,
                                    .num_moves = s.num_moves,
                                    .ess_ratio_min = s.ess_ratio_min,
                                    .resampling = s.resampling,
                                    .lns_update = s.lns_update,
                                    .local_move_cosine = std::cos(s.local_move_deg * kPi / 180),
                                    .local_move_fraction = s.local_move_fraction};
  SamplingSpec start = s;
  start.method = s.start_method;
  return std::make_unique<SequentialSampler>(
      settings, make_pixel_sampler(start), s.refresh_every, s.refresh_ratio,
      BidirectionalSampler(s.refresh_candidates, s.brdf_fraction));
}

struct Maker {
  Method name;
  MethodPtr (*method)(const JobSpec&);
  SamplerPtr (*sampler)(const SamplingSpec&);  ///< null for methods that keep no samples
};
/// In the order of the enumeration.
constexpr Maker kMakers[] = {
    {Method::reference, make_reference, nullptr},
    {Method::environment, of_job<WeightedMethod>, make_environment},
    {Method::brdf, of_job<WeightedMethod>, make_brdf},
    {Method::mis, of_job<WeightedMethod>, make_mis},
    {Method::bidirectional, of_job<WeightedMethod>, make_bidirectional},
    {Method::sequential, of_job<SequentialMethod>, make_sequential},
    {Method::pool, of_sampling<PoolMethod>, nullptr},
    {Method::ratio, of_sampling<RatioMethod>, nullptr},
    {Method::restir, of_job<RestirMethod>, make_restir},
};
static_assert(std::size(kMakers) == static_cast<std::size_t>(Method::automatic));
static_assert(std::ranges::is_sorted(kMakers, {}, &Maker::name));

const Maker& maker(Method method) { return kMakers[static_cast<std::size_t>(method)]; }

}  // namespace

MethodPtr make_pixel_method(const JobSpec& job) {
  BATON_CHECK(job.sampling.method != Method::automatic);
  return maker(job.sampling.method).method(job);
}

MethodPtr make_material_method(const MaterialSampling& material) {
  JobSpec job;
  job.sampling = as_sampling(material);
  return std::make_unique<WeightedMethod>(job);
}

SamplerPtr make_pixel_sampler(const SamplingSpec& spec) {
  const auto make = maker(spec.method).sampler;
  return make != nullptr ? make(spec) : nullptr;
}

}  // namespace baton
