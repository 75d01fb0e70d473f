#include "common/job/plan/frame_judgement.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace baton {
namespace {

constexpr std::size_t kAround = 3;   ///< frames on each side
constexpr std::size_t kFewest = 3;   ///< frames to compare with
constexpr float kLeastShare = 0.5f;  ///< least deviation, over the median
constexpr float kDeviations = 5;     ///< median absolute ones
/// Noise that is higher by so many of its own standard errors is odd: it is told by few pixels.
constexpr float kErrors = 4;
/// Less noise than this is never worth a word.
constexpr float kNoNoise = 0.002f;

float median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

float deviation(const std::vector<float>& values, float from) {
  std::vector<float> deviations(values.size());
  std::transform(values.begin(), values.end(), deviations.begin(),
                 [&](float v) { return std::abs(v - from); });
  return median(std::move(deviations));
}

/// A frame's neighbours by one of its numbers.
struct Around {
  std::vector<float> before, after, both;

  Around(std::span<const FrameReport* const> written, std::size_t at, float FrameQuality::*number) {
    const std::size_t end = std::min(at + kAround + 1, written.size());
    for (std::size_t k = at - std::min(at, kAround); k < end; ++k) {
      if (k == at) continue;
      const float value = written[k]->quality.*number;
      (k < at ? before : after).push_back(value);
      both.push_back(value);
    }
  }
};

/// The ratio of a value to `usual`, if it lies far off.
std::optional<float> odd_ratio(float value, float usual, const std::vector<float>& around) {
  const float allowed =
      std::max(kLeastShare * usual, kDeviations * deviation(around, median(around)));
  if (!(usual > 0) || std::abs(value - usual) <= allowed) return std::nullopt;
  return value / usual;
}

/// Light that grows or falls is no fault of a frame: it must be outside of what is before and after
/// it.
std::optional<float> odd_mean(float value, const Around& around) {
  if (around.before.empty() || around.after.empty()) return std::nullopt;
  const auto [low, high] = std::minmax({median(around.before), median(around.after)});
  if (value >= low && value <= high) return std::nullopt;
  return odd_ratio(value, value > high ? high : low, around.both);
}

void find_odd_frames(std::span<const FrameReport* const> written, Judgement& judgement) {
  for (std::size_t i = 0; i < written.size(); ++i) {
    const Around mean(written, i, &FrameQuality::mean), noise(written, i, &FrameQuality::noise);
    if (noise.both.size() < kFewest) continue;
    const FrameQuality& quality = written[i]->quality;
    if (const auto ratio = odd_mean(quality.mean, mean))
      judgement.odd.push_back({written[i]->frame, false, *ratio});
    const float usual = median(noise.both);
    const auto ratio = odd_ratio(quality.noise, usual, noise.both);
    const bool is_sure = quality.noise - usual > kErrors * quality.noise_error * quality.noise;
    if (ratio && *ratio > 1 && is_sure && quality.noise > kNoNoise)
      judgement.odd.push_back({written[i]->frame, true, *ratio});
  }
}

/// Earlier programs had other measures.
bool is_told(NoiseSource source) {
  return source == NoiseSource::probes || source == NoiseSource::scatter;
}

/// Enters the noise of a frame that tells it. squares, squares_shown: sums over these frames.
void add_noise(const FrameReport& frame, double& squares, double& squares_shown,
               Judgement& judgement) {
  const float noise = frame.quality.noise, shown = frame.quality.noise_shown;
  squares_shown += double{shown} * shown;
  const bool is_first = judgement.frames_told == 0;
  squares += double{noise} * noise;
  judgement.noise_least = is_first ? noise : std::min(judgement.noise_least, noise);
  if (is_first || noise > judgement.noise_most) {
    judgement.noise_most = noise;
    judgement.noisiest = frame.frame;
  }
  judgement.noise_source = frame.quality.noise_source;
  ++judgement.frames_told;
}

}  // namespace

Judgement judge_frames(std::span<const FrameReport> frames) {
  Judgement judgement;
  std::vector<const FrameReport*> written;
  double squares = 0, squares_shown = 0, light = 0, below = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const SamplingStats& sampling = frames[i].sampling;
    judgement.carries |= sampling.pixels_carried > 0;
    if (i > 0) {
      judgement.pixels_after_first += sampling.pixels();
      judgement.pixels_afresh += sampling.pixels_fresh + sampling.pixels_restarted;
    }
    const FrameQuality& quality = frames[i].quality;
    if (quality.pixels == 0) continue;
    written.push_back(&frames[i]);
    if (is_told(quality.noise_source)) add_noise(frames[i], squares, squares_shown, judgement);
    const double frame_light = double{quality.mean} * static_cast<double>(quality.pixels);
    light += frame_light;
    below += quality.light_below_zero * frame_light;
    judgement.clamped |= quality.clamped;
    judgement.frames_below_zero += quality.pixels_below_zero > 0 ? 1 : 0;
    judgement.pixels_below_zero += quality.pixels_below_zero;
    judgement.lowest = std::min(judgement.lowest, quality.lowest);
    judgement.frames_beyond_half += quality.pixels_beyond_half > 0 ? 1 : 0;
    judgement.pixels_beyond_half += quality.pixels_beyond_half;
    judgement.pixels_not_finite += quality.pixels_not_finite;
  }
  judgement.frames = written.size();
  if (written.empty()) return judgement;
  if (judgement.frames_told > 0) {
    judgement.noise =
        static_cast<float>(std::sqrt(squares / static_cast<double>(judgement.frames_told)));
    judgement.noise_shown =
        static_cast<float>(std::sqrt(squares_shown / static_cast<double>(judgement.frames_told)));
  }
  judgement.light_below_zero = light > 0 ? static_cast<float>(below / light) : 0.0f;
  find_odd_frames(written, judgement);
  return judgement;
}

}  // namespace baton
