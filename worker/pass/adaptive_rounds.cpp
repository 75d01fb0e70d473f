#include "worker/pass/adaptive_rounds.h"

#include <algorithm>
#include <cmath>

namespace baton {

AdaptiveRounds::AdaptiveRounds(const JobSpec& job, const PixelRect& rect)
    : rect_(rect),
      rounds_(job.quality.rounds),
      threshold_(job.quality.adaptive_threshold),
      blocks_(rect) {}

RoundPixels AdaptiveRounds::pixels(Round round) const {
  const auto num_pixels = static_cast<std::size_t>(rect_.area());
  if (round < Round(limits::kJudgingRounds) || rounds_of_block_.empty())
    return RoundPixels::all(num_pixels);
  RoundPixels taken;
  for (std::size_t pixel = 0; pixel < num_pixels; ++pixel) {
    const std::int32_t count = rounds_of_block_[blocks_.of(pixel)];
    if (round - Round(limits::kJudgingRounds) < count)
      taken.add(pixel, static_cast<double>(rounds_ - limits::kJudgingRounds) / count);
  }
  return taken;
}

void AdaptiveRounds::judge(const RoundMean& film) {
  if (!threshold_) return;
  const auto num_pixels = static_cast<std::size_t>(rect_.area());
  const std::size_t num_blocks = blocks_.count();
  std::vector<double> squares(num_blocks), counts(num_blocks);
  for (std::size_t pixel = 0; pixel < num_pixels; ++pixel) {
    squares[blocks_.of(pixel)] += film.squared_noise(pixel);
    ++counts[blocks_.of(pixel)];
  }
  const std::int32_t most = rounds_ - limits::kJudgingRounds;
  rounds_of_block_.resize(num_blocks);
  for (std::size_t block = 0; block < num_blocks; ++block) {
    const double share = std::sqrt(squares[block] / counts[block]) / double{*threshold_};
    // Not a number, where a pixel is none: all.
    const double wanted = share < 1 ? std::ceil(share * most) : most;
    rounds_of_block_[block] = std::max(1, static_cast<std::int32_t>(wanted));
  }
}

}  // namespace baton
