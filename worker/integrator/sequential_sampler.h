#pragma once

#include "worker/integrator/candidate_samplers.h"

namespace baton {

/// The sequential Monte Carlo sampler [Ghosh, Doucet & Heidrich 2006] for pixels whose surfaces stay. Starts with
/// BidirectionalSampler; carries the particles from then on; starts again when all weights die.
class SequentialSampler final : public PixelSampler {
 public:
  SequentialSampler(const SequentialSettings& settings, CandidateCounts start_counts)
      : settings_(settings), start_(start_counts) {}
  PixelDiagnostics sample(const PixelInput& input, kernels::CandidateSet& scratch,
                          const PixelSamples& samples) const override;

 private:
  SequentialSettings settings_;
  BidirectionalSampler start_;
};

}  // namespace baton
