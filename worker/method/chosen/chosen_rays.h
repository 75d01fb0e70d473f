#pragma once

#include "worker/method/pixel_method.h"

namespace baton {

/// A method that chooses N rays apart from samples, among M candidates; its states have no samples.
class ChosenRaysSampler : public TileSampler {
 public:
  explicit ChosenRaysSampler(const SamplingSpec& spec)
      : num_candidates_(spec.num_candidates),
        lobe_fraction_(spec.brdf_fraction),
        num_rays_(spec.num_particles) {}

 protected:
  /// Writes what was chosen, `rays_`, into the state and to the renderer. total: sum of the
  /// candidates' weights, Lns where it is positive and finite.
  PixelDiagnostics write_chosen(float total, const kernels::CandidateSource& candidates,
                                PixelSource source, const PixelInput& input,
                                const PixelState& pixel, RayWriter& rays);

  std::int32_t num_candidates_;
  float lobe_fraction_;
  std::int32_t num_rays_;
  PixelRays rays_;  ///< rays of the pixel in work

 private:
  kernels::CandidateSet unshadowed_;  ///< work space
};

}  // namespace baton
