#pragma once

#include <memory>

#include "common/state/sample_state.h"
#include "worker/integrator/ray_batch.h"
#include "worker/pass/masked_surfaces.h"
#include "worker/pass/sample_region.h"

namespace baton {

/// The rival of the exchange: in each masked pixel `partitions` more draws of the job's own
/// sampler, started afresh, each with as many samples as a population has; their mean with the
/// first pass's.
class ExtraSampler {
 public:
  /// All arguments must outlive the object. mask: the pixels of `surfaces`.
  ExtraSampler(const RenderContext& context, const FrameGeometry& geometry, const FrameSpec& frame,
               const FrameLight& light, const SampleRegion& samples, const MaskedSurfaces& surfaces,
               const PixelMask& mask);

  /// Share of a fold in the radiance of a pixel of the mask; `extra`: the fold's mask holds it.
  Rgb radiance(std::int32_t x, std::int32_t y, std::size_t fold, bool extra);

  std::uint64_t rays_traced() const { return rays_traced_; }
  double seconds_rays() const { return seconds_rays_; }

 private:
  void gather_sites(std::span<const SurfaceHit> hits);
  Rgb first_pass(const SampleRegion::Place& pixel, std::size_t fold);
  void draw(std::int32_t x, std::int32_t y, std::size_t fold, std::span<const SurfaceHit> hits);
  Rgb trace();

  const RenderContext& context_;
  const FrameGeometry& geometry_;
  const FrameSpec& frame_;
  const FrameLight& light_;
  const SampleRegion& samples_;
  const MaskedSurfaces& surfaces_;
  const PixelMask& mask_;
  const EnvironmentView now_, before_;
  std::unique_ptr<SamplerScratch> scratch_;
  SampleState drawn_;  ///< one population of one pixel
  SiteBlock sites_;
  RayBatch rays_;
  std::uint64_t rays_traced_ = 0;
  double seconds_rays_ = 0;
};

}  // namespace baton
