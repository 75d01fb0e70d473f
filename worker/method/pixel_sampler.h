#pragma once

#include <array>
#include <memory>
#include <span>

#include "common/job/job_spec.h"
#include "common/state/sample_state.h"
#include "worker/accel/geometry_sequence.h"
#include "worker/light/candidates.h"
#include "worker/light/carried_light.h"
#include "worker/light/frame_light.h"
#include "worker/method/carried_set.h"
#include "worker/method/pool/pool_kernels.h"
#include "worker/method/restir/restir_kernels.h"
#include "worker/sampling/sequential.h"
#include "worker/surface/old_surfaces.h"

namespace baton {

/// What every method is given for one pixel.
struct PixelInput {
  const SiteBlock& sites;  ///< at least one of them sees a surface
  const FrameLight& light;
  /// The set of light.presampled that the pixel reads.
  const PresampledLight& presampled;
  const EnvironmentView& now;  ///< views of light.now and light.before
  const EnvironmentView& before;
  RngKey key;
  /// Rounds of the sequence before this one; to a method each is a frame. Negative before those
  /// that are seen.
  std::int32_t rounds_before = 0;
  /// The samples are the previous frame's properly weighted set.
  bool has_history = false;
  /// (N) p~ of the previous frame at those samples, where it is known; else empty.
  std::span<const float> target_before{};
  /// The surfaces of the carried set, where they are not `sites`.
  const OldSurfaces* old = nullptr;
  /// (populations) That set in the maps, where it was looked up ahead; else empty.
  std::span<const kernels::LocatedDirections> located{};
  /// (N) out: p~ at this frame's samples; may be target_before.
  std::span<float> target{};
  /// What the neighbours that the pixel asks had in the frame before; at most kMaxNeighbors.
  std::span<const CarriedSet> neighbors{};
  /// (S) what the sites were made of, for a method that traces itself.
  std::span<const SurfaceHit> hits{};
  const FrameGeometry* geometry = nullptr;  ///< geometry of the frame
  /// KnownLight::unshadowed is wanted of methods that can say it.
  bool wants_unshadowed = false;
};

/// The light of the pixel's two frames.
inline kernels::CarriedLight carried_light(const PixelInput& input) {
  return {.before = input.before,
          .now = input.now,
          .still = input.light.still,
          .presampled = input.presampled,
          .turn = input.light.turn ? &*input.light.turn : nullptr};
}

/// What its fresh candidates are drawn from.
inline kernels::CandidateSource candidate_source(const PixelInput& input,
                                                 const kernels::CandidateCounts& counts) {
  return {input.sites, input.now, input.presampled, counts,
          Rng(input.key, PassId::candidates).bits(0, 0)};
}

/// The samples of one pixel, in and out: a properly weighted set for p~(site, w) = p~_site(w) / S
/// with contributions u_j = lns * weight_j, so that E[sum u_j h(w_j)] = integral of p~ h. lns 0:
/// every weight is 0.
struct PixelSamples {
  std::span<OctDirection> direction;  ///< (N)
  std::span<std::uint8_t> site;       ///< (N)
  std::span<float> weight;            ///< (N) sum 1, or all 0
  std::span<float> r, g, b;           ///< (N) out: (f cos L)_rgb at the samples
  float& lns;
  float& lns_fresh;
  PixelSource& source;
  std::uint16_t* confidence = nullptr;  ///< SampleState::confidence; null: none
};

/// What a method says about its work on a pixel.
struct PixelDiagnostics {
  float ess = 0;                 ///< [1, N], 0 without light
  std::int32_t num_samples = 1;  ///< N
  std::int32_t target_evaluations = 0;
  MoveCounts local = {}, independent = {};
  bool resampled = false;
  bool refreshed_by_ratio = false;
  std::uint64_t rays_traced = 0;  ///< by the method itself
};

/// Work space of one thread, reused from pixel to pixel.
struct SamplerScratch {
  kernels::CandidateSet candidates;
  kernels::ChoiceScratch choice;
  kernels::PoolScratch pool;
  kernels::RestirPoints restir;
  /// Rays of the pixel, where the method chooses them apart from its samples.
  PixelRays rays;
};

/// Draws one properly weighted set, the contract of PixelSamples. Stateless; any number of threads
/// may use one.
class PixelSampler {
 public:
  virtual ~PixelSampler() = default;
  /// scratch: the caller's, reused from pixel to pixel.
  virtual PixelDiagnostics sample(const PixelInput& input, SamplerScratch& scratch,
                                  const PixelSamples& samples) const = 0;
};

/// The sampler of a method that keeps samples; null for the others.
std::unique_ptr<const PixelSampler> make_pixel_sampler(const SamplingSpec& spec);

}  // namespace baton
