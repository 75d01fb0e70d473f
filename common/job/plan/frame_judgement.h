#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/job/task.h"

namespace baton {

/// A frame that differs from those around it.
struct OddFrame {
  FrameNumber frame{};
  bool by_noise = false;  ///< else by its mean radiance
  float ratio = 1;        ///< to the median of the frames around
};

/// What a person should know of the frames of a job that are written.
struct Judgement {
  std::uint64_t frames = 0;
  std::uint64_t frames_told = 0;  ///< whose noise is told
  NoiseSource noise_source = NoiseSource::none;
  float noise = 0;        ///< rms over these frames
  float noise_shown = 0;  ///< the same as shown
  float noise_least = 0, noise_most = 0;
  FrameNumber noisiest{};  ///< the frame of noise_most
  std::vector<OddFrame> odd;
  std::uint64_t frames_below_zero = 0, pixels_below_zero = 0;
  float lowest = 0;
  float light_below_zero = 0;  ///< over the light of all frames
  bool clamped = false;        ///< it was set to 0
  std::uint64_t frames_beyond_half = 0, pixels_beyond_half = 0;
  std::uint64_t pixels_not_finite = 0;
  /// Pixels after the first frame that could have carried something, and those of them that had to
  /// start afresh; refreshes on schedule are not counted. carries: some pixels carried.
  bool carries = false;
  std::uint64_t pixels_afresh = 0, pixels_after_first = 0;
};

/// frames: in the order of their numbers, with those that are not written.
///
/// A frame is odd when its noise is above the median of the three frames on each side by more than
/// half of that and five times their median absolute deviation, or its mean radiance as far outside
/// of the medians of either side. Cuts and steady changes thus are not; a flash of one frame is.
Judgement judge_frames(std::span<const FrameReport> frames);

}  // namespace baton
