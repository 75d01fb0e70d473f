#pragma once

#include "worker/method/pixel_method.h"

namespace baton {

/// A method that chooses N rays apart from samples, among M candidates; its states have no samples.
class ChosenRaysMethod : public PixelMethod {
 protected:
  explicit ChosenRaysMethod(const SamplingSpec& spec)
      : num_candidates_(spec.num_candidates),
        lobe_fraction_(spec.brdf_fraction),
        num_rays_(spec.num_particles) {}

  /// Writes what was chosen, scratch.rays, into the state and to the renderer. total: sum of the
  /// candidates' weights, Lns where it is positive and finite.
  PixelDiagnostics settle(float total, const kernels::CandidateSource& candidates,
                          PixelSource source, const PixelInput& input, const PixelState& pixel,
                          SamplerScratch& scratch, RayWriter& rays) const;

  std::int32_t num_candidates_;
  float lobe_fraction_;
  std::int32_t num_rays_;
};

}  // namespace baton
