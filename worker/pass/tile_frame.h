#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "worker/pass/catcher.h"
#include "worker/pass/first_pass_collector.h"
#include "worker/pass/pixel_starts.h"
#include "worker/pass/round_mean.h"
#include "worker/pass/tile_round.h"

namespace baton {

/// Renders the rounds of one tile. What the method does is its own affair (PixelMethod).
class TileFrameRenderer {
 public:
  /// geometry: of the frames that are rendered; must outlive the object.
  TileFrameRenderer(const RenderContext& context, const FrameGeometry& geometry);

  /// The next round is the first one of a frame.
  void begin_frame() { frame_sampling_ = {}; }
  /// Before the pixels of a round. state, goes_on: as in the round's TileRound.
  void begin_round(const SampleState& state, bool goes_on);
  /// Each pixel of a round must be in one part. state: what the previous round or frame left, else
  /// only its sizes matter; becomes this round's. film: takes the pixels.
  void render(const TileRound& at, SampleState& state, RoundMean& film);

  /// What the second pass needs of the frame that was rendered last; once, and only if the job has
  /// a second pass.
  FirstPassSamples take_first_pass(const SampleState& state) {
    return collector_.finish(state, state.step);
  }
  const RenderStats& stats() const { return stats_; }
  /// Statistics of the frame that was rendered last, over its rounds.
  const SamplingStats& frame_sampling() const { return frame_sampling_; }

 private:
  /// The stages of a batch in their order; each reads what those before it have left there.
  void sample(RoundWork& work, PixelStarts& starts, SampleState& state, PixelBatch& batch);
  void trace(RoundWork& work, PixelBatch& batch);
  void bounce(RoundWork& work, PixelBatch& batch);
  void shade(RoundWork& work, SampleState& state, PixelBatch& batch);
  void show(RoundWork& work, PixelBatch& batch, RoundMean& film);

  /// The parts of `sample`. i: number of the pixel in its batch.
  void see_nothing(const RoundWork& work, std::size_t slot, SampleState& state);
  void sample_pixel(RoundWork& work, const PixelInput& input, std::size_t i,
                    const PixelState& pixel, PixelBatch& batch);
  void sample_again(RoundWork& work, const PixelInput& input, std::size_t i,
                    const PixelState& pixel, const SiteOrigins& origins, PixelBatch& batch);

  bool is_drawn_again(const RoundWork& work, std::size_t index) const {
    return work.probe_light && (draws_twice_ || work.is_probe(index));
  }
  void note_again(const RoundWork& work, PixelBatch& batch) const;
  void start_bounces(const RoundWork& work, BounceStart start, std::size_t number,
                     std::size_t index, bool on_catchers);
  void start_bounces_again(const RoundWork& work, const PixelInput& input, std::size_t i,
                           std::size_t index, const PixelBatch& batch);

  /// The method of a slot's first surface: its material's own, or the job's.
  const PixelMethod& method_of(const TileSurfaces& surfaces, std::size_t slot) const;
  TileSampler& sampler_of(const TileSurfaces& surfaces, std::size_t slot) const;

  const RenderContext& context_;
  const FrameGeometry& geometry_;
  const bool draws_twice_, wants_unshadowed_;
  std::unique_ptr<TileSampler> sampler_;                    ///< of the job's method
  std::vector<std::unique_ptr<TileSampler>> own_samplers_;  ///< (materials); null: `sampler_`
  std::optional<BounceWalk> bounces_;                       ///< none: light meets no second surface
  NoiseProbe probe_;
  CatcherEdge edge_;
  FirstPassCollector collector_;
  RenderStats stats_;
  SamplingStats frame_sampling_;
};

}  // namespace baton
