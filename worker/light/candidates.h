#pragma once

#include <cstdint>
#include <span>

#include "common/base/limits.h"
#include "common/math/octahedral.h"
#include "common/math/padded_array.h"
#include "common/math/philox.h"
#include "worker/light/presampled_light.h"
#include "worker/sampling/pool.h"
#include "worker/surface/environment_view.h"
#include "worker/surface/site_block.h"

/// Candidates of a pixel, in SIMD with run-time dispatch. Work space is read and written in whole
/// vectors (PaddedArray), what spans refer to is not.
namespace baton::kernels {

/// How many candidates come from where: M_t of each technique.
struct CandidateCounts {
  std::int32_t from_light = 0;
  std::int32_t from_bsdf = 0;
  /// BRDF candidates come from the lobes of the glossy sites alone; what diffuse reflectance sees
  /// is left to the light, whose weights it only scales by the cosine. Needs from_light > 0: lobes
  /// may not reach everywhere.
  bool lobe_only = false;

  std::int32_t total() const { return from_light + from_bsdf; }
};

/// What the candidates of a pixel are drawn from.
struct CandidateSource {
  const SiteBlock& sites;  ///< at least one sees a surface
  const EnvironmentView& environment;
  const PresampledLight& presampled;
  CandidateCounts counts;
  Philox4x32::Counter random;  ///< Rng::bits(0, 0) of the pixel
};

/// Checks preconditions: counts.total() in [1, kMaxCandidates], and sites that the candidates can
/// go to.
void check_source(const CandidateSource& from);

/// Candidates of one pixel: a properly weighted set for p~(site, w) = p~_site(w) / S. E[sum weight]
/// = Lns.
struct CandidateSet {
  template <class T>
  using Column = PaddedArray<T, limits::kMaxCandidates>;
  Column<OctDirection> code;
  Column<std::int32_t> site;
  Column<float> weight;
  Column<float> r, g, b;  ///< (f cos L)_rgb
  std::int32_t count = 0;
  float total = 0;  ///< sum of the weights
};

/// Draws candidates from the presampled light and from the BRDF, weighted by the balance heuristic
/// [Veach & Guibas 1995]: p~(y) / sum_t M_t q_t(y). The sites that see a surface (lobe_only: that
/// have a lobe) share them evenly. counts.total() is in [1, kMaxCandidates]; a black map gives
/// count 0. sites.num_hits must be positive, with lobe_only and from_bsdf > 0 also num_lobes.
void draw_candidates(const CandidateSource& from, CandidateSet& out);

/// Work space of choose_candidates.
struct ChoiceScratch {
  CandidateLine running_sums;
  CandidateSet from_bsdf;
};

/// Samples (N) that a method fills: directions, sites and (f cos L)_rgb.
struct SampleSpan {
  std::span<OctDirection> code;
  std::span<std::uint8_t> site;
  std::span<float> r, g, b;
};

/// Draws candidates like draw_candidates and keeps N of them, each with probability proportional to
/// its weight: systematically with offset u in [0, 1) (sampling/systematic-inl.h). Only weights
/// are kept of candidates from the presampled light; what is chosen is evaluated again. Returns the
/// sum of the weights, an unbiased estimate of Lns; when it is not positive and finite, out is left
/// as it was.
float choose_candidates(const CandidateSource& from, float u, ChoiceScratch& scratch,
                        const SampleSpan& out);

/// What the candidates of draw_candidates reflect together, sum over w (f cos L)_rgb / p~: the
/// pixel's radiance if none were blocked, without bias. scratch: work space.
Rgb reflected_light(const CandidateSource& from, CandidateSet& scratch);

/// What is left to do for a sample once its visibility is known: colour[j] = (f cos L)_rgb / p~ at
/// (site, w), 0 where p~ is 0. directions: unit vectors for the shadow rays.
struct ShadedSamples {
  using Column = PaddedArray<float, limits::kMaxParticles>;
  Column x, y, z;
  Column r, g, b;
};
void shade_samples(const SiteBlock& sites, const EnvironmentView& environment,
                   std::span<const OctDirection> code, std::span<const std::uint8_t> site,
                   ShadedSamples& out);

}  // namespace baton::kernels
