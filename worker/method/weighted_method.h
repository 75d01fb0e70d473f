#pragma once

#include <vector>

#include "worker/light/carried_light.h"
#include "worker/method/pixel_method.h"

namespace baton {

/// A method whose rays are its N weighted samples, which are in the state: each of the pixel's
/// populations draws its own set.
class WeightedMethod : public PixelMethod {
 public:
  /// With the sampler that the job's method names, or with another one.
  explicit WeightedMethod(const JobSpec& job);
  WeightedMethod(const JobSpec& job, std::unique_ptr<const PixelSampler> sampler);

  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel, SamplerScratch& scratch,
                          RayWriter& rays) const override;

 private:
  std::unique_ptr<const PixelSampler> sampler_;
  std::size_t num_particles_;         ///< N, over all populations
  std::vector<float> picture_scale_;  ///< (populations)
};

/// `sequential` evaluates carried directions, so it pays to look them up ahead.
class SequentialMethod final : public WeightedMethod {
 public:
  using WeightedMethod::WeightedMethod;
  bool look_ahead(const kernels::CarriedLight& light, bool knows_targets, const PixelState& pixel,
                  LocatedPopulations& located) const override;
};

/// `restir`: with SamplingSpec::reuse_visibility blocked samples are forgotten.
class RestirMethod final : public WeightedMethod {
 public:
  explicit RestirMethod(const JobSpec& job)
      : WeightedMethod(job), reuse_visibility_(job.sampling.reuse_visibility) {}
  void learn(const FoundRays& found, const PixelState& pixel) const override;

 private:
  bool reuse_visibility_;
};

/// Factor of population k's contributions in the image of the first pass: 1, but where one half
/// only decides.
float picture_scale(const JobSpec& job, std::int32_t population);

}  // namespace baton
