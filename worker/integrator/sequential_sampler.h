#pragma once

#include "worker/integrator/candidate_samplers.h"

namespace baton {

/// The sequential Monte Carlo sampler [Ghosh, Doucet & Heidrich 2006] for pixels whose surfaces
/// stay. Starts with BidirectionalSampler; carries the particles from then on; starts again when
/// all weights die, and once in `refresh_every` frames (0: never). The errors of a carried Lns
/// multiply from frame to frame; a refresh on a schedule that looks at no sample ends them without
/// bias. Pixels without a glossy surface make independent moves only: the map's proposals fit them
/// up to the cosine, and a local move costs three times as much.
class SequentialSampler final : public PixelSampler {
 public:
  SequentialSampler(const SequentialSettings& settings, const BidirectionalSampler& start,
                    std::int32_t refresh_every)
      : settings_(settings), start_(start), refresh_every_(refresh_every) {}
  PixelDiagnostics sample(const PixelInput& input, kernels::CandidateSet& scratch,
                          const PixelSamples& samples) const override;

 private:
  SequentialSettings settings_;
  BidirectionalSampler start_;
  std::int32_t refresh_every_;
};

}  // namespace baton
