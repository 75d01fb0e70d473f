#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/job/task.h"
#include "worker/light/carried_light.h"
#include "worker/method/pixel_method.h"
#include "worker/pass/film_writer.h"
#include "worker/pass/first_pass_collector.h"
#include "worker/pass/primary.h"
#include "worker/pass/reproject.h"

namespace baton {

/// Renders one frame of one tile: look ahead, sample, trace, learn, film, a batch of pixels at a
/// time so that a batch stays in the cache. What the method does is its own affair (PixelMethod).
class TileFrameRenderer {
 public:
  /// geometry and surfaces: of the frames that are rendered; must outlive the object.
  TileFrameRenderer(const RenderContext& context, const FrameGeometry& geometry,
                    const TileSurfaces& surfaces);

  /// Where surfaces stay. state: the samples of the previous frame when has_history, else only its
  /// sizes matter; becomes this frame's.
  FilmTile render(const FrameSpec& frame, const FrameLight& light, bool has_history,
                  SampleState& state);
  /// Where they move: the samples of the previous frame come from `history`. state: sized, all
  /// zero.
  FilmTile render(const FrameSpec& frame, const FrameLight& light, Reprojection& history,
                  SampleState& state);

  /// What the second pass needs of the frame that was rendered last; once, and only if the job has
  /// a second pass.
  FirstPassSamples take_first_pass(const SampleState& state) {
    return collector_.finish(state, state.frame_index);
  }

  const RenderStats& stats() const { return stats_; }
  /// Of the frame that was rendered last.
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
  /// Wall seconds of the frame in work.
  struct Stages {
    double reproject = 0, sample = 0, visibility = 0, shade = 0;
  };

  FilmTile render_batches(const FrameSpec& frame, const FrameLight& light, SampleState& state);
  void keep_targets(std::int32_t frame_index, std::size_t num_samples);
  std::span<float> targets_of(std::size_t index, const SampleState& state) {
    const auto n = static_cast<std::size_t>(state.num_particles);
    return std::span(targets_).subspan(index * n, n);
  }
  void sample(Batch& batch, const FrameLight& light, SampleState& state);
  const PixelMethod& method_of(std::size_t index) const;
  void look_ahead(std::size_t pixel_of_batch, std::size_t index, const kernels::CarriedLight& light,
                  SampleState& state);
  SiteOrigins origins(std::size_t index) const;
  void trace(Batch& batch);
  void learn(Batch& batch, SampleState& state);
  void collect(const FoundRays& found, std::size_t index, const SampleState& state);
  void finish(Batch& batch, const FrameLight& light, FilmWriter& film);

  const RenderContext& context_;
  const FrameGeometry& geometry_;
  const TileSurfaces& surfaces_;
  Reprojection* reprojection_ = nullptr;  ///< of the frame in work; null where surfaces stay
  bool has_history_ = false;              ///< of the frame in work, where surfaces stay
  std::array<Ahead, 2> ahead_;            ///< of odd and even pixels
  /// (pixels, N) p~ at the samples of frame targets_frame_: where surfaces stay, the next frame
  /// need not evaluate it again.
  std::vector<float> targets_;
  std::int32_t targets_frame_ = 0;
  bool knows_targets_ = false;  ///< targets_ are those of the frame before the one in work
  std::unique_ptr<SamplerScratch> scratch_;
  FirstPassCollector collector_;
  RenderStats stats_;
  Stages stages_;
  SamplingStats frame_sampling_;
};

}  // namespace baton
