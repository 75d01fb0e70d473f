#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "worker/method/fresh/candidate_samplers.h"

namespace baton {

/// The sequential Monte Carlo sampler [Ghosh, Doucet & Heidrich 2006] for pixels whose surfaces
/// stay. Starts with any other sampler; carries the particles from then on; starts again when all
/// weights die, and once in `refresh_every` frames (0: never). The errors of a carried Lns multiply
/// from frame to frame; a refresh on a schedule that depends on no sample ends them without bias.
/// The paper's rule [section 7], a refresh when Lns has changed by more than `refresh_ratio`, does
/// depend on samples: it cuts estimates that wandered off, which is a small bias. Pixels without a
/// glossy surface make independent moves only: the map's proposals fit them up to the cosine, and a
/// local move costs three times as much.
class SequentialSampler final : public PixelSampler {
 public:
  /// start: of fresh and restarted pixels and of those whose turn it is. by_ratio: of those whose
  /// Lns has changed too much.
  SequentialSampler(const SequentialSettings& settings, std::unique_ptr<const PixelSampler> start,
                    std::int32_t refresh_every, std::optional<float> refresh_ratio,
                    const BidirectionalSampler& by_ratio)
      : settings_(settings),
        start_(std::move(start)),
        refresh_every_(refresh_every),
        refresh_ratio_(refresh_ratio),
        by_ratio_(by_ratio) {}
  PixelDiagnostics sample(const PixelInput& input, SamplerScratch& scratch,
                          const PixelSamples& samples) const override;

 private:
  bool has_wandered(float lns, float lns_fresh) const;

  SequentialSettings settings_;
  std::unique_ptr<const PixelSampler> start_;
  std::int32_t refresh_every_;
  std::optional<float> refresh_ratio_;
  BidirectionalSampler by_ratio_;
};

}  // namespace baton
