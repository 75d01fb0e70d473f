#pragma once

#include "common/job/task.h"
#include "worker/pass/film_writer.h"
#include "worker/pass/first_pass_collector.h"
#include "worker/pass/primary.h"
#include "worker/pass/reproject.h"

namespace baton {

/// Renders one frame of one tile through the passes sample -> visibility -> shade -> film, a batch
/// of pixels at a time so that a batch stays in the cache.
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

  FilmTile render_batches(const FrameSpec& frame, const FrameLight& light, SampleState& state);
  PixelHistory find_history(std::size_t pixel_of_batch, std::size_t index, SampleState& state);
  void sample(Batch& batch, const FrameLight& light, SampleState& state);
  std::array<Vec3, SiteBlock::kMaxSites> origins(std::size_t index) const;
  void cast_samples(Batch& batch, std::size_t i, const SiteBlock& sites, const EnvironmentView& now,
                    const SampleState& state);
  void cast_rays(Batch& batch, std::size_t i, const PixelRays& rays);
  void trace(Batch& batch);
  void shade(Batch& batch, SampleState& state);
  void render_reference(Batch& batch, const FrameLight& light, SampleState& state);
  void finish(Batch& batch, const FrameLight& light, FilmWriter& film);

  const RenderContext& context_;
  const FrameGeometry& geometry_;
  const TileSurfaces& surfaces_;
  Reprojection* reprojection_ = nullptr;  ///< of the frame in work; null where surfaces stay
  bool has_history_ = false;              ///< of the frame in work, where surfaces stay
  OldSurfaces old_;
  std::unique_ptr<SamplerScratch> scratch_;
  FirstPassCollector collector_;
  std::vector<float> picture_scale_;  ///< (populations)
  RenderStats stats_;
  SamplingStats frame_sampling_;
};

}  // namespace baton
