#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/base/limits.h"
#include "common/math/octahedral.h"
#include "common/math/padded_array.h"
#include "common/math/philox.h"
#include "worker/integrator/light_pool.h"
#include "worker/integrator/old_surfaces.h"
#include "worker/sampling/pool.h"
#include "worker/sampling/sequential.h"
#include "worker/scene/environment_view.h"
#include "worker/scene/site_block.h"

/// The inner loops, in SIMD with run-time dispatch. No vector type leaves kernels.cpp. Work space
/// is read and written in whole vectors (PaddedArray), what spans hold is not.
namespace baton::kernels {

/// Name of the instruction set in use, e.g. "AVX2".
std::string instruction_set();

/// Unit vectors of lattice directions; all spans of one length.
void decode_directions(std::span<const OctDirection> code, std::span<float> x, std::span<float> y,
                       std::span<float> z);

/// Radiance and table density (1/sr) along unit world directions; all spans of one length.
void evaluate_environment(const EnvironmentView& view, std::span<const float> x,
                          std::span<const float> y, std::span<const float> z, std::span<float> r,
                          std::span<float> g, std::span<float> b, std::span<float> density);

/// BRDF times cosine (RGB) and density of sample_bsdf for (site, direction) pairs; all spans of one
/// length.
void evaluate_bsdf(const SiteBlock& sites, std::span<const std::int32_t> site,
                   std::span<const float> x, std::span<const float> y, std::span<const float> z,
                   std::span<float> r, std::span<float> g, std::span<float> b,
                   std::span<float> pdf);

/// Directions drawn from the BRDF for uniforms u0, u1; all spans of one length.
void sample_bsdf(const SiteBlock& sites, std::span<const std::int32_t> site,
                 std::span<const float> u0, std::span<const float> u1, std::span<float> x,
                 std::span<float> y, std::span<float> z);

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

/// Checks what every caller owes: total() in [1, kMaxCandidates], sites that the candidates can go
/// to.
void check_counts(const SiteBlock& sites, const CandidateCounts& counts);

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

/// Draws candidates from the pool and from the BRDF, weighted by the balance heuristic [Veach &
/// Guibas 1995]: p~(y) / sum_t M_t q_t(y). The sites that see a surface (lobe_only: that have a
/// lobe) share them evenly. counts.total() is in [1, kMaxCandidates]; a black map gives count 0.
/// sites.num_hits must be positive, with lobe_only and from_bsdf > 0 also num_lobes.
void draw_candidates(const SiteBlock& sites, const EnvironmentView& environment,
                     const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                     CandidateSet& out);

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
/// are kept of candidates from the pool; what is chosen is evaluated again. Returns the sum of the
/// weights, an unbiased estimate of Lns; when it is not positive and finite, out is left as it was.
float choose_candidates(const SiteBlock& sites, const EnvironmentView& environment,
                        const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                        float u, ChoiceScratch& scratch, const SampleSpan& out);

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

/// Directions of one population that were decoded and found in the map ahead of their evaluation,
/// (N) each; the last vector is filled up with copies of the last one.
struct LocatedDirections {
  template <class T>
  using Column = PaddedArray<T, limits::kMaxParticles>;
  /// Where a direction lies in a map: the upper left texel, and how far right and down of it
  /// (bilinear maps).
  struct Place {
    Column<std::int32_t> texel;
    Column<float> right, down;
  };
  Column<float> x, y, z;  ///< unit world vectors
  Place now;
  Place before;  ///< where it was asked for
  bool has_before = false;
};
/// Finds lattice directions (at most kMaxParticles) in the map of now, and where it is not null in
/// that of the frame before, and asks the memory for the texels there: maps are larger than the
/// caches.
void locate_directions(const EnvironmentView& now, const EnvironmentView* before,
                       std::span<const OctDirection> code, LocatedDirections& out);

/// The light of two frames for a sampler that carries.
struct CarriedLight {
  const EnvironmentView& before;
  const EnvironmentView& now;
  bool still = false;  ///< both are the same
  const LightPool& pool;
  const Mat3* turn = nullptr;  ///< FrameLight::turn; `restir` alone asks
};

/// One frame of the sequential sampler for a pixel (sampling/sequential-inl.h). old: the surfaces
/// that the particles come from, by sites of this frame; null where they are `sites`. light.before:
/// the frame that the particles come from, of which the pool must have the radiance
/// (LightPool::has_before). located: the particles in its maps, or null. lns_before > 0.
SequentialOutcome sequential_step(const SiteBlock& sites, const OldSurfaces* old,
                                  const CarriedLight& light, const LocatedDirections* located,
                                  const SequentialSettings& settings, float lns_before,
                                  const RngKey& key, ParticleSpan particles);

}  // namespace baton::kernels
