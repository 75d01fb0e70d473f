#pragma once

#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/restir/restir_kernels.h"
#include "worker/method/weighted/weighted_sampler.h"

namespace baton {

/// ReSTIR DI [Bitterli et al. 2020], N reservoirs a pixel, with the generalised balance heuristic
/// (sampling/restir.h). Each frame:
///  - a fresh set, the N samples of `bidirectional`: one stratified choice from M candidates
///    instead of N independent streams, which is the stronger form;
///  - the set that the pixel carries, shifted by keeping its texel, as real-time ReSTIR keeps the
///    light that it has chosen: where the map only turned (FrameLight::turn), directions turn with
///    it, and where its texels changed, they stay;
///  - the sets of neighbours, of the frame before as in the spatiotemporal pass of Wyman &
///    Panteleev [2021]: tiles of one frame need not wait for each other;
///  - N samples chosen systematically from all of them, along a curve of directions; all their
///    rays are traced.
/// Unbiased, as targets carry no visibility: fresh samples reach wherever light does. With
/// `reuse_visibility` blocked samples are forgotten, so a carried set stands for p~ V. While V
/// stays that of the pixel, this is unbiased too: at a free direction the shares of all sets sum to
/// 1 as before, and at a blocked one what is missing from Lns is not seen. A set from other
/// surfaces, by motion or from a neighbour, or one that turned with the map, lacks directions that
/// were blocked there and are free here: a bias, that of RTXDI's basic correction, which traces no
/// rays for its weights, too.
class RestirSampler final : public WeightedSampler {
 public:
  explicit RestirSampler(const JobSpec& job);
  void learn(const FoundRays& found, const PixelState& pixel) override;

 protected:
  PixelDiagnostics draw(const PixelInput& input, const SetPlace& at,
                        const PixelSamples& samples) override;

 private:
  BidirectionalSampler fresh_;
  std::int32_t history_limit_;
  bool reuse_visibility_;
  kernels::RestirPoints points_;
};

PixelMethod make_restir_method(const JobSpec& job);

}  // namespace baton
