#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "worker/method/carried/carried_light.h"
#include "worker/method/weighted/weighted_sampler.h"
#include "worker/sampling/sequential.h"

namespace baton {

/// The samples of a population where they lie in the maps, found one pixel ahead.
class LocatedAhead {
 public:
  /// Forgets all pixels.
  void clear();
  /// Finds what the populations of a pixel carry. before: the map of the frame before, or null
  /// where it is not asked.
  void locate(const EnvironmentView& now, const EnvironmentView* before, const PixelState& pixel);
  /// Null: the pixel was not located.
  const kernels::LocatedDirections* find(const PixelState& pixel, std::size_t population) const;

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};
  struct Slot {
    std::size_t pixel = kNone;
    std::array<kernels::LocatedDirections, limits::kMaxPopulations> populations;
  };
  std::array<Slot, 2> slots_;  ///< the pixel in work, and the one after it
  std::size_t next_ = 0;
};

/// The sequential Monte Carlo sampler [Ghosh, Doucet & Heidrich 2006] for pixels whose surfaces
/// stay. Starts with any other sampler; carries the particles from then on; starts again when all
/// weights die, and once in `refresh_every` frames (0: never). The errors of a carried Lns multiply
/// from frame to frame; a refresh on a schedule that depends on no sample ends them without bias.
/// The paper's rule [section 7], a refresh when Lns has changed by more than `refresh_ratio`, does
/// depend on samples: it cuts estimates that wandered off, which is a small bias. Pixels without a
/// glossy surface make independent moves only: the map's proposals fit them up to the cosine, and a
/// local move costs three times as much.
class SequentialSampler final : public WeightedSampler {
 public:
  explicit SequentialSampler(const JobSpec& job);
  void begin_round(const SampleState& state, bool goes_on) override;
  void look_ahead(const RoundLight& light, bool has_history, const PixelState& pixel) override;

 protected:
  PixelDiagnostics draw(const PixelInput& input, const SetPlace& at,
                        const PixelSamples& samples) override;

 private:
  bool has_wandered(float lns, float lns_fresh) const;

  SequentialSettings settings_;
  std::int32_t refresh_every_;
  std::optional<float> refresh_ratio_;
  /// Samples fresh and restarted pixels and those whose turn it is.
  std::unique_ptr<FreshSampler> start_;
  /// Samples pixels whose Lns has changed too much; null: there are none.
  std::unique_ptr<FreshSampler> by_ratio_;
  LocatedAhead located_;
};

PixelMethod make_sequential_method(const JobSpec& job);

}  // namespace baton
