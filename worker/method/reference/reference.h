#pragma once

#include <array>
#include <span>

#include "common/math/philox.h"
#include "worker/accel/geometry_sequence.h"
#include "worker/method/pixel_method.h"

namespace baton {

/// Brute-force estimate of one pixel with its own error.
struct ReferenceEstimate {
  /// Mean over the sites of the reflected, shadowed radiance.
  Rgb radiance;
  Rgb unshadowed;  ///< radiance without shadows
  float lns = 0;   ///< mean of `unshadowed` over RGB
  /// Share of the unshadowed light that arrives, mean over RGB; 0 without light.
  float visibility = 0;
  Rgb variance;  ///< squared standard errors of `radiance`
};

/// `reference`, brute force: `num_samples` independent pairs of one environment and one BRDF sample
/// under the balance heuristic, each pair at a site drawn uniformly, plain random numbers, scalar
/// code and exact directions throughout; it shares nothing with the SIMD kernels but the ray
/// tracer, the textures and the albedo of catchers. hits: the pixel's sites (1 to 16), some may see
/// nothing; sites: of the hits, asked for catchers alone.
class ReferenceRenderer {
 public:
  explicit ReferenceRenderer(const FrameGeometry& geometry) : geometry_(geometry) {}
  /// rays: scratch, reused. Returns the number of shadow rays in rays_traced.
  ReferenceEstimate render(std::span<const SurfaceHit> hits, const SiteBlock& sites,
                           const Environment& environment, std::int32_t num_samples,
                           const RngKey& key, ShadowRays& rays, std::uint64_t& rays_traced) const;

 private:
  const FrameGeometry& geometry_;
};

/// ReferenceRenderer as a method: it traces its rays itself, so its constant is the whole pixel.
PixelMethod make_reference_method(const JobSpec& job);

}  // namespace baton
