#pragma once

#include "common/job/task.h"
#include "worker/pass/film_writer.h"
#include "worker/pass/primary.h"

namespace baton {

/// Renders one frame of one tile through the passes sample -> visibility -> shade -> film, a batch of pixels at a time so
/// that a batch stays in the cache.
class TileFrameRenderer {
 public:
  /// surfaces must outlive the object.
  TileFrameRenderer(const RenderContext& context, const TileSurfaces& surfaces);

  /// state: the samples of the previous frame when has_history, else only its sizes matter; becomes this frame's.
  FilmTile render(const FrameSpec& frame, const FrameLight& light, bool has_history, SampleState& state);

  const RenderStats& stats() const { return stats_; }
  /// Of the frame that was rendered last.
  const SamplingStats& frame_sampling() const { return frame_sampling_; }

 private:
  static constexpr std::size_t kBatchPixels = 64;
  struct Batch;

  void sample(Batch& batch, const FrameLight& light, bool has_history, SampleState& state);
  void trace(Batch& batch);
  void shade(Batch& batch, const SampleState& state);
  void render_reference(Batch& batch, const FrameLight& light, SampleState& state);
  void finish(Batch& batch, const FrameLight& light, FilmWriter& film);

  const RenderContext& context_;
  const TileSurfaces& surfaces_;
  std::unique_ptr<kernels::CandidateSet> scratch_;
  RenderStats stats_;
  SamplingStats frame_sampling_;
};

}  // namespace baton
