#pragma once

#include <cstdint>
#include <vector>

#include "common/base/limits.h"
#include "common/job/job_spec.h"
#include "common/math/pixel_blocks.h"
#include "common/math/pixel_rect.h"
#include "worker/pass/round_mean.h"
#include "worker/pass/round_pixels.h"

namespace baton {

/// Which pixels take part in which rounds of a frame (quality.adaptiveThreshold, T). The first
/// kJudgingRounds of K are for all. From what these found follows how many of the others a block of
/// kAdaptiveBlock x kAdaptiveBlock pixels gets: all of them if its noise after K rounds would be T
/// or more, else in proportion to it, and one at least. In proportion to the standard deviation is
/// the least squared error for a given number of rounds.
///
/// No bias: the two parts of a pixel weigh kJudgingRounds / K and the rest, whatever was found. The
/// first part is unbiased, and so is the second given the first. (The mean of all its rounds, which
/// weighs the first part by what that found, would be biased.)
///
/// A block, since two rounds of one pixel say nothing of its noise: pixels that were clean by
/// chance would stand out later. Blocks are those of the picture, and tiles are whole numbers of
/// them, so that no tiling shows.
class AdaptiveRounds {
 public:
  /// Plans the rounds of a tile. rect: its pixels.
  AdaptiveRounds(const JobSpec& job, const PixelRect& rect);

  /// The pixels of a round of the step, [0, K); later rounds have
  /// no others than earlier ones. After the judging rounds only once judge() was called.
  RoundPixels pixels(Round round) const;
  /// film: the sums of the judging rounds. Does nothing where all pixels get all rounds.
  void judge(const RoundMean& film);

 private:
  const PixelRect rect_;
  const std::int32_t rounds_;             ///< K
  const std::optional<float> threshold_;  ///< T
  const PixelBlocksOf<limits::kAdaptiveBlock> blocks_;
  std::vector<std::int32_t> rounds_of_block_;  ///< after the judging ones; empty: all
};

}  // namespace baton
