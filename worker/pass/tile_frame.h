#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/job/task.h"
#include "worker/light/carried_light.h"
#include "worker/method/pixel_method.h"
#include "worker/pass/catcher.h"
#include "worker/pass/first_pass_collector.h"
#include "worker/pass/noise_probe.h"
#include "worker/pass/primary.h"
#include "worker/pass/reproject.h"
#include "worker/pass/round_mean.h"

namespace baton {

/// One pass over some pixels of a tile.
struct TileRound {
  const FrameSpec& frame;
  Round round{};
  const FrameLight& light;
  const TileSurfaces& surfaces;  ///< what its sites see
  /// The light that probes are sampled again with; null: there are none.
  const FrameLight* probe_light = nullptr;

  /// How many rounds of the sequence come before it, of num_rounds a step; less than 0 before those
  /// that are seen. To a method a round is a frame of standing light.
  std::int32_t rounds_before(std::int32_t num_rounds) const {
    return frame.step.value() * num_rounds + round.value();
  }
};

/// Renders a round of one tile: look ahead, sample, trace, learn, film, a batch of pixels at a time
/// so that a batch stays in the cache. What the method does is its own affair (PixelMethod).
class TileFrameRenderer {
 public:
  /// geometry: of the frames that are rendered; must outlive the object.
  TileFrameRenderer(const RenderContext& context, const FrameGeometry& geometry);

  /// Before the pixels of a round. state: what the previous round or frame left when has_history or
  /// history, else only its sizes matter. history: of the first round where surfaces move, what the
  /// previous frame left, and `state` is all zero; else null. Both must last until the round ends.
  void begin_round(const SampleState& state, Reprojection* history, bool has_history);
  /// Each pixel of a round must be in one part. state: becomes this round's. film: takes the
  /// pixels.
  void render(const TileRound& at, SampleState& state, RoundMean& film);

  /// What the second pass needs of the frame that was rendered last; once, and only if the job has
  /// a second pass.
  FirstPassSamples take_first_pass(const SampleState& state) {
    return collector_.finish(state, state.step);
  }

  /// The next round is the first one of a frame.
  void begin_frame() { frame_sampling_ = {}; }
  const RenderStats& stats() const { return stats_; }
  /// Statistics of the frame that was rendered last, over its rounds.
  const SamplingStats& frame_sampling() const { return frame_sampling_; }

 private:
  static constexpr std::size_t kBatchPixels = 64;
  struct Batch;
  /// What is known of a pixel when the one before it is sampled.
  struct Ahead {
    PixelHistory history = PixelHistory::none;
    OldSurfaces old;  ///< for `moved`
    LocatedPopulations located;
    bool is_located = false;
  };
  /// Wall seconds of the round in work.
  struct Stages {
    double reproject = 0, sample = 0, visibility = 0, shade = 0;
  };

  std::span<float> targets_of(std::size_t index, const SampleState& state) {
    const auto n = static_cast<std::size_t>(state.num_particles);
    return std::span(targets_).subspan(index * n, n);
  }
  void sample(Batch& batch, const TileRound& at, SampleState& state);
  const PixelMethod& method_of(std::size_t slot) const;
  void look_ahead(std::size_t pixel_of_batch, std::size_t slot, const kernels::CarriedLight& light,
                  SampleState& state);
  bool is_catcher_new() const;
  PixelHistory give_old_albedo(std::span<const SurfaceHit> hits, OldSurfaces& old);
  Rgb sample_edge(const PixelInput& input, const FrameLight& light, const SampleState& state);
  SiteOrigins origins(std::size_t slot) const;
  void trace(Batch& batch);
  void learn(Batch& batch, SampleState& state);
  void collect(const FoundRays& found, std::size_t index, const SampleState& state);
  void finish(Batch& batch, const FrameLight& light, RoundMean& film);

  const RenderContext& context_;
  const FrameGeometry& geometry_;
  const bool draws_twice_, wants_unshadowed_;
  const TileSurfaces* surfaces_ = nullptr;  ///< surfaces of the pixels in work
  /// History for the round in work; null where pixels stay.
  Reprojection* reprojection_ = nullptr;
  /// The round in work has history, where pixels stay.
  bool has_history_ = false;
  std::array<Ahead, 2> ahead_;  ///< one for even slots, one for odd ones
  /// (pixels, N) p~ at the samples of the round before: where samples and surfaces stay, it need
  /// not be evaluated again.
  std::vector<float> targets_;
  bool knows_targets_ = false;  ///< for the round in work
  std::unique_ptr<SamplerScratch> scratch_;
  NoiseProbe probe_;
  CatcherEdge edge_;
  /// Albedo in the light of this frame, and in that of the frame before.
  CatcherAlbedo catchers_, catchers_before_;
  FirstPassCollector collector_;
  RenderStats stats_;
  Stages stages_;
  SamplingStats round_sampling_, frame_sampling_;
};

}  // namespace baton
