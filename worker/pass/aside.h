#pragma once

#include <vector>

#include "worker/method/pixel_method.h"

namespace baton {

/// Samples a pixel beside the image: with a method, random numbers, sites and light of one's
/// choice, in a state of its own, so that nothing of it enters what the pixel carries.
class AsideSampler {
 public:
  /// What differs from the pixel itself.
  struct Aside {
    const SiteBlock& sites;
    std::span<const SurfaceHit> hits;  ///< (S) of the sites
    const SiteOrigins& origins;        ///< where the sites' rays start
    const FrameLight& light;
    const PresampledLight& presampled;  ///< the set of `light` that the pixel reads
    RngKey key;
    const PixelMemory* memory = nullptr;  ///< what it starts from; null: afresh
  };

  /// The radiance, mean over the sites. pixel: what the method is given of the pixel itself. like:
  /// a state of the job.
  Rgb sample(const PixelMethod& method, const PixelInput& pixel, const Aside& aside,
             const SampleState& like, SamplerScratch& scratch);

 private:
  SampleState state_;  ///< a state of one pixel
  std::vector<float> target_;
  RayBatch rays_;
};

}  // namespace baton
