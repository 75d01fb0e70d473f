#pragma once

#include <functional>
#include <memory>
#include <span>

#include "common/job/job_spec.h"
#include "common/job/task.h"
#include "common/state/state_format.h"
#include "worker/accel/geometry_sequence.h"
#include "worker/light/candidates.h"
#include "worker/light/frame_light.h"
#include "worker/method/ray_batch.h"
#include "worker/sampling/sequential.h"

namespace baton {

struct CarriedSet;
struct OldSurfaces;

/// The light of a round as its pixels see it.
struct RoundLight {
  const FrameLight& frame;
  EnvironmentView now = view_of(frame.now);
  EnvironmentView before = view_of(frame.before);
};

/// What a pixel starts from, beside what its state holds.
struct PixelStart {
  /// Its state is what the round or frame before left.
  bool has_history = false;
  /// The surfaces of the carried set, where they are not those that the pixel sees now.
  const OldSurfaces* old = nullptr;
  /// What the neighbours that the pixel asks had in the frame before; at most kMaxNeighbors.
  std::span<const CarriedSet> neighbors{};
};

/// What every method is given for one pixel.
struct PixelInput {
  const SiteBlock& sites;  ///< at least one of them sees a surface
  const RoundLight& light;
  /// The set of light.frame.presampled that the pixel reads.
  const PresampledLight& presampled;
  RngKey key;
  /// Rounds of the sequence before this one; to a method each is a frame. Negative before those
  /// that are seen.
  std::int32_t rounds_before = 0;
  PixelStart start{};
  /// (S) what the sites were made of, for a method that traces itself.
  std::span<const SurfaceHit> hits{};
  const FrameGeometry* geometry = nullptr;  ///< geometry of the frame
  /// KnownLight::unshadowed is wanted of methods that can say it.
  bool wants_unshadowed = false;
};

/// What its fresh candidates are drawn from.
inline kernels::CandidateSource candidate_source(const PixelInput& input,
                                                 const kernels::CandidateCounts& counts) {
  return {input.sites, input.light.now, input.presampled, counts,
          Rng(input.key, PassId::candidates).bits(0, 0)};
}

/// One pixel of a tile's state, in and out.
struct PixelState {
  SampleState& tile;
  std::size_t index;
  bool sees_catcher = false;  ///< a catcher of shadows
};

/// What a method says about its work on a pixel. The state has the pixel's source.
struct PixelDiagnostics {
  /// Estimate of the unshadowed radiance, mean over RGB.
  float lns = 0;
  float ess = 0;                 ///< [1, N], 0 without light
  std::int32_t num_samples = 1;  ///< N
  std::int32_t target_evaluations = 0;
  MoveCounts local = {}, independent = {};
  bool resampled = false;
  bool refreshed_by_ratio = false;
  std::uint64_t rays_traced = 0;  ///< by the method itself
};

/// A method at work on the pixels of one tile, round by round: sample, then trace, then learn.
/// Every pixel is a constant plus the values of its free rays, and a method gives both. It keeps
/// work space of its own, and from round to round what is not worth handing on; one thread uses it.
class TileSampler {
 public:
  virtual ~TileSampler() = default;

  /// Before the pixels of a round. goes_on: `state` is what the round before left, and pixels stay.
  virtual void begin_round(const SampleState& /*state*/, bool /*goes_on*/) {}
  /// Asks memory for what sampling a pixel will read, while another one is in work: at most one
  /// pixel ahead.
  virtual void look_ahead(const RoundLight& /*light*/, bool /*has_history*/,
                          const PixelState& /*pixel*/) {}
  /// Writes the pixel's rays. `pixel` has what the frame before left where
  /// input.start.has_history, and becomes this frame's.
  virtual PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel,
                                  RayWriter& rays) = 0;
  /// Remembers what the rays found.
  virtual void learn(const FoundRays& /*found*/, const PixelState& /*pixel*/) {}
};

/// A sampling method as the renderer sees it.
struct PixelMethod {
  const StateFormat* format = nullptr;  ///< format of its states
  /// Puts it to work on a tile. Any number of threads may call it.
  std::function<std::unique_ptr<TileSampler>()> start{};
};

/// The method of a job.
PixelMethod make_pixel_method(const JobSpec& job);
/// The method of one material that has a setting of its own.
PixelMethod make_material_method(const MaterialSampling& material);

}  // namespace baton
