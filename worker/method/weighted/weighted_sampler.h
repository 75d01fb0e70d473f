#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "common/state/sample_planes.h"
#include "worker/method/weighted/pixel_samples.h"

namespace baton {

/// A method whose rays are its N weighted samples, which are in the state: each of the pixel's
/// populations draws its own set. They share nothing but the frame's presampled light.
class WeightedSampler : public TileSampler {
 public:
  void begin_round(const SampleState& state, bool goes_on) override;
  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel, RayWriter& rays) final;

 protected:
  /// The set that is to be drawn.
  struct SetPlace {
    PixelState pixel;
    std::size_t population;
    /// (N) p~ of the round before at those samples, where it is known; else empty.
    std::span<const float> target_before;
  };

  explicit WeightedSampler(const JobSpec& job);
  /// Draws one population's set. input: with the population's random numbers.
  virtual PixelDiagnostics draw(const PixelInput& input, const SetPlace& at,
                                const PixelSamples& samples) = 0;
  bool knows_targets() const { return knows_targets_; }

 private:
  /// (f cos L)_rgb at the samples of one pixel.
  struct SampleColors {
    std::array<float, limits::kMaxParticles> r, g, b;
  };

  std::size_t num_particles_;       ///< N, over all populations
  std::vector<float> image_scale_;  ///< (populations)
  SampleColors colors_;
  /// (pixels, N) p~ at the samples of the round before: where samples and surfaces stay, it need
  /// not be evaluated again.
  std::vector<float> targets_;
  bool knows_targets_ = false;  ///< for the round in work
};

/// The methods that draw all samples anew.
PixelMethod make_fresh_method(const JobSpec& job);

}  // namespace baton
