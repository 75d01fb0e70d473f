#pragma once

#include <memory>

#include "worker/exchange/second_pass_work.h"
#include "worker/method/weighted/pixel_samples.h"

namespace baton {

/// The baseline of the exchange: in each masked pixel `partitions` more draws of the job's own
/// sampler, started afresh, each with as many samples as a population has; their mean with the
/// first pass's.
class ExtraSampler {
 public:
  /// work must outlive the object.
  explicit ExtraSampler(const SecondPassWork& work);

  /// Share of a fold in the radiance of a pixel that is in some fold's mask.
  Rgb radiance(std::int32_t x, std::int32_t y, std::size_t fold);

  std::uint64_t rays_traced() const { return rays_traced_; }
  double seconds_rays() const { return seconds_rays_; }

 private:
  Rgb first_pass(const SampleRegion::Place& pixel, std::size_t fold);
  void draw(std::int32_t x, std::int32_t y, std::size_t fold, std::span<const SurfaceHit> hits);
  Rgb trace();

  const SecondPassWork& work_;
  const RoundLight light_;
  const std::size_t num_samples_;  ///< of a population
  const std::unique_ptr<FreshSampler> sampler_;
  SiteBlock sites_;
  RayBatch rays_;
  std::uint64_t rays_traced_ = 0;
  double seconds_rays_ = 0;
};

}  // namespace baton
