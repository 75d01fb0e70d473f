#pragma once

#include <map>
#include <memory>

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
    const RoundLight& light;
    const PresampledLight& presampled;  ///< the set of `light` that the pixel reads
    RngKey key;
    bool starts_afresh = false;  ///< not from what the pixel carries
  };

  /// The radiance, mean over the sites. input: what the method is given of the pixel itself, whose
  /// state stays as it is. method: lasts as long as the object.
  Rgb sample(const PixelMethod& method, const PixelInput& input, const Aside& aside,
             const PixelState& pixel);

 private:
  std::map<const PixelMethod*, std::unique_ptr<TileSampler>> samplers_;
  SampleState state_;  ///< a state of one pixel
  RayBatch rays_;
};

}  // namespace baton
