#pragma once

#include <array>
#include <span>

#include "common/math/philox.h"
#include "worker/accel/accel.h"
#include "worker/method/pixel_method.h"

namespace baton {

/// Brute-force estimate of one pixel with its own error.
struct ReferenceEstimate {
  Rgb radiance;   ///< mean over the sites of the reflected, shadowed radiance
  float lns = 0;  ///< the same without shadows, mean over RGB
  float visibility =
      0;  ///< share of the unshadowed light that arrives, mean over RGB; 0 without light
  float mean_variance = 0;  ///< squared standard error of mean(radiance)
};

/// `reference`, brute force: `num_samples` independent pairs of one environment and one BRDF sample
/// under the balance heuristic, each pair at a site drawn uniformly, plain random numbers, scalar
/// code and exact directions throughout; it shares nothing with the SIMD kernels but the ray
/// tracer. surfaces: the pixel's sites (1 to 16), some may see nothing.
class ReferenceRenderer {
 public:
  ReferenceRenderer(const Accel& accel, std::span<const Material> materials)
      : accel_(accel), materials_(materials) {}
  /// rays: scratch, reused. Returns the number of shadow rays in rays_traced.
  ReferenceEstimate render(std::span<const SurfaceHit> surfaces, const Environment& environment,
                           std::int32_t num_samples, const RngKey& key, ShadowRays& rays,
                           std::uint64_t& rays_traced) const;

 private:
  const Accel& accel_;
  std::span<const Material> materials_;
};

/// ReferenceRenderer as a method: it traces its rays itself, so its constant is the whole pixel.
class ReferenceMethod final : public PixelMethod {
 public:
  ReferenceMethod(std::int32_t num_samples, std::span<const Material> materials)
      : num_samples_(num_samples), materials_(materials) {}
  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel, SamplerScratch& scratch,
                          RayWriter& rays) const override;

 private:
  std::int32_t num_samples_;
  std::span<const Material> materials_;
};

}  // namespace baton
