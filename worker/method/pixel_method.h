#pragma once

#include <array>
#include <memory>
#include <span>

#include "worker/light/carried_light.h"
#include "worker/method/pixel_sampler.h"
#include "worker/method/ray_batch.h"

namespace baton {

/// One pixel of a tile's state, in and out.
struct PixelState {
  SampleState& tile;
  std::size_t index;

  PixelMemory* memory() const { return tile.memory_of(index); }
};

/// Where carried directions lie in the maps, by population, looked up one pixel ahead.
using LocatedPopulations = std::array<kernels::LocatedDirections, limits::kMaxPopulations>;

/// A sampling method as the renderer sees it: sample, then trace, then learn. Every pixel is a
/// constant plus the values of its free rays, and a method gives both. Stateless; any number of
/// threads may use one.
class PixelMethod {
 public:
  virtual ~PixelMethod() = default;

  /// Looks carried directions up in the maps while another pixel is in work, so that memory is not
  /// waited for; false: there is nothing to look up. knows_targets: p~ of the frame before is
  /// known.
  virtual bool look_ahead(const kernels::CarriedLight& /*light*/, bool /*knows_targets*/,
                          const PixelState& /*pixel*/, LocatedPopulations& /*located*/) const {
    return false;
  }
  /// Writes the pixel's rays. `pixel` has what the frame before left where input.has_history, and
  /// becomes this frame's. scratch: the caller's, reused from pixel to pixel.
  virtual PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel,
                                  SamplerScratch& scratch, RayWriter& rays) const = 0;
  /// Remembers what the rays found.
  virtual void learn(const FoundRays& /*found*/, const PixelState& /*pixel*/) const {}
};

/// The method of a job.
std::unique_ptr<const PixelMethod> make_pixel_method(const JobSpec& job);
/// The method of one material that has a setting of its own.
std::unique_ptr<const PixelMethod> make_material_method(const MaterialSampling& material);

}  // namespace baton
