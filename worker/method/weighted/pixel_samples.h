#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "worker/method/pixel_method.h"

namespace baton {

/// The samples of one population of a pixel, in and out: a properly weighted set for
/// p~(site, w) = p~_site(w) / S with contributions u_j = lns * weight_j, so that
/// E[sum u_j h(w_j)] = integral of p~ h. lns 0: every weight is 0.
struct PixelSamples {
  std::span<OctDirection> direction;  ///< (N)
  std::span<std::uint8_t> site;       ///< (N)
  std::span<float> weight;            ///< (N) sum 1, or all 0
  std::span<float> r, g, b;           ///< (N) out: (f cos L)_rgb at the samples
  float& lns;
  float& lns_fresh;
  PixelSource& source;
};

/// Draws properly weighted sets that start from nothing, the contract of PixelSamples. It keeps
/// work space; one thread uses it.
class FreshSampler {
 public:
  virtual ~FreshSampler() = default;
  virtual PixelDiagnostics sample(const PixelInput& input, const PixelSamples& samples) = 0;
};

/// The sampler of a method that draws all samples anew in each frame; of others that keep samples,
/// the one that they start with.
std::unique_ptr<FreshSampler> make_fresh_sampler(const SamplingSpec& spec);

}  // namespace baton
