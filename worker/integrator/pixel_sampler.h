#pragma once

#include <array>
#include <memory>
#include <span>

#include "common/job/job_spec.h"
#include "common/state/sample_state.h"
#include "worker/integrator/carried_set.h"
#include "worker/integrator/frame_light.h"
#include "worker/integrator/kernels.h"
#include "worker/integrator/old_surfaces.h"
#include "worker/integrator/pool_kernels.h"
#include "worker/integrator/restir_kernels.h"

namespace baton {

/// What every method is given for one pixel.
struct PixelInput {
  const SiteBlock& sites;  ///< at least one of them sees a surface
  const FrameLight& light;
  const EnvironmentView& now;  ///< views of light.now and light.before
  const EnvironmentView& before;
  RngKey key;
  std::int32_t frame_index = 0;  ///< 0-based position in the sequence
  bool has_history = false;      ///< the samples hold the previous frame's properly weighted set
  /// (N) p~ of the previous frame at those samples, where it is known; else empty.
  std::span<const float> target_before{};
  const OldSurfaces* old = nullptr;  ///< the surfaces of that set, where they are not `sites`
  /// (populations) That set in the maps, where it was looked up ahead; else empty.
  std::span<const kernels::LocatedDirections> located{};
  /// (kVisibilityCells) of the frames before, or empty; see keeps_memory()
  std::span<const VisibilityCell> memory{};
  /// What the neighbours that the pixel asks held in the frame before; at most kMaxNeighbors.
  std::span<const CarriedSet> neighbors{};
};

/// The light of the pixel's two frames.
inline kernels::CarriedLight carried_light(const PixelInput& input) {
  return {.before = input.before,
          .now = input.now,
          .still = input.light.still,
          .pool = input.light.pool,
          .turn = input.light.turn ? &*input.light.turn : nullptr};
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
  std::uint16_t* confidence = nullptr;  ///< SampleState::confidence; null where nobody asks
};

/// What a method says about its work on a pixel.
struct PixelDiagnostics {
  float ess = 0;  ///< [1, N], 0 without light
  std::int32_t target_evaluations = 0;
  MoveCounts local = {}, independent = {};
  bool resampled = false;
  bool refreshed_by_ratio = false;
};

/// Work space of one thread, reused from pixel to pixel.
struct SamplerScratch {
  kernels::CandidateSet candidates;
  kernels::ChoiceScratch choice;
  kernels::PoolScratch pool;
  kernels::RestirPoints restir;
  PixelRays rays;  ///< of the pixel, where the method chooses them apart from its samples
};

/// A sampling method: the plug-in over the contract of PixelSamples. Stateless; any number of
/// threads may use one.
class PixelSampler {
 public:
  virtual ~PixelSampler() = default;
  /// scratch: the caller's, reused from pixel to pixel.
  virtual PixelDiagnostics sample(const PixelInput& input, SamplerScratch& scratch,
                                  const PixelSamples& samples) const = 0;
  /// Whether sample() evaluates carried directions, so that it pays to look them up ahead
  /// (PixelInput::located).
  virtual bool evaluates_carried() const { return false; }
  /// Whether the method chooses its rays apart from its samples, which sample() then leaves in
  /// SamplerScratch::rays. Else its samples are its rays.
  virtual bool chooses_rays() const { return false; }
  /// Whether a method that chooses its rays is told in later frames what they found
  /// (PixelInput::memory).
  virtual bool keeps_memory() const { return false; }
  /// Whether the method weighs sets by their confidence (PixelSamples::confidence).
  virtual bool asks_confidence() const { return false; }
  /// Whether a sample whose ray was blocked is to be forgotten once it is traced.
  virtual bool forgets_blocked() const { return false; }
};

/// The sampler of a job; null for Method::reference, which is no sampler of this kind
/// (reference.h); Method::automatic is in no job that reaches a worker.
std::unique_ptr<const PixelSampler> make_pixel_sampler(const SamplingSpec& spec);
/// The sampler of one material that has a setting of its own.
std::unique_ptr<const PixelSampler> make_material_sampler(const MaterialSampling& material);

}  // namespace baton
