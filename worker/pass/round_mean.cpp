#include "worker/pass/round_mean.h"

#include <algorithm>

#include "common/base/limits.h"
#include "common/image/noise.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

void add_to(std::array<double, 3>& sum, const Vec3& v, double weight = 1) {
  sum[0] += weight * double{v.x};
  sum[1] += weight * double{v.y};
  sum[2] += weight * double{v.z};
}
Vec3 scaled(const std::array<double, 3>& sum, double factor) {
  return {static_cast<float>(sum[0] * factor), static_cast<float>(sum[1] * factor),
          static_cast<float>(sum[2] * factor)};
}

}  // namespace

RoundMean::RoundMean(const JobSpec& job, const PixelRect& rect)
    : num_rounds_(job.quality.rounds),
      rounds_are_uncorrelated_(rounds_have_own_sites(job)),
      some_judge_(job.quality.adaptive_threshold.has_value()),
      film_(rect, job) {
  if (num_rounds_ > 1) sums_.resize(static_cast<std::size_t>(rect.area()));
}

void RoundMean::add(std::size_t index, const PixelResult& pixel, double weight) {
  if (sums_.empty()) return film_.write(index, pixel);
  PixelSum& sum = sums_[index];
  const double seen = double{baton::mean(pixel.radiance)} + double{baton::mean(pixel.shadow)};
  const bool is_first = sum.num_rounds < (some_judge_ ? limits::kJudgingRounds : num_rounds_ / 2);
  (is_first ? sum.scatter.first : sum.scatter.rest).add(pixel.radiance, weight);
  ++sum.num_rounds;
  sum.seen += seen;
  sum.seen_squares += seen * seen;
  add_to(sum.radiance, pixel.radiance, weight);
  sum.alpha += weight * double{pixel.alpha};
  add_to(sum.shadow, pixel.shadow, weight);
  add_to(sum.blocked, pixel.blocked, weight);
  add_to(sum.indirect, pixel.indirect, weight);
  sum.catcher += weight * double{pixel.catcher};
  if (!(pixel.coverage > 0)) return;
  if (sum.weight_seen == 0) sum.material = pixel.material;
  sum.weight_seen += weight;
  sum.coverage += weight * double{pixel.coverage};
  sum.depth += weight * double{pixel.coverage} * double{pixel.depth};
  add_to(sum.normal, pixel.normal, weight * double{pixel.coverage});
  add_to(sum.source, pixel.source_color, weight);
  sum.lns += weight * double{pixel.lns};
  sum.arrived += weight * double{pixel.lns} * double{pixel.visibility};
  sum.ess_ratio += weight * double{pixel.ess_ratio};
  sum.acceptance += weight * double{pixel.acceptance};
  sum.acceptance_local += weight * double{pixel.acceptance_local};
  sum.acceptance_independent += weight * double{pixel.acceptance_independent};
  sum.resampled += weight * double{pixel.resampled};
  sum.mask += weight * double{pixel.mask};
}

double RoundMean::squared_noise(std::size_t index) const {
  const PixelSum& sum = sums_[index];
  const double n = sum.num_rounds, mean = sum.seen / n;
  const double variance = std::max(sum.seen_squares / n - mean * mean, 0.0) * n / (n - 1);
  return cycles_noise_squared(variance / num_rounds_, mean);
}

PixelResult RoundMean::mean(const PixelSum& sum) const {
  const double k = num_rounds_;
  PixelResult pixel;
  pixel.radiance = scaled(sum.radiance, 1 / k);
  pixel.alpha = static_cast<float>(sum.alpha / k);
  pixel.blocked = scaled(sum.blocked, 1 / k);
  pixel.indirect = scaled(sum.indirect, 1 / k);
  pixel.shadow = scaled(sum.shadow, 1 / k);
  pixel.catcher = static_cast<float>(sum.catcher / k);
  pixel.rounds = static_cast<float>(sum.num_rounds);
  PixelVariance told{.grey = kErrorUnknown};
  if (rounds_are_uncorrelated_)
    told = some_judge_ ? sum.scatter.of_judged() : sum.scatter.of_halves();
  pixel.variance = told.color;
  if (sum.weight_seen == 0) return pixel;
  pixel.error = told.grey;
  const double seen = 1.0 / sum.weight_seen;
  pixel.coverage = static_cast<float>(sum.coverage / k);
  pixel.depth = static_cast<float>(sum.depth / sum.coverage);
  pixel.normal = normalize(scaled(sum.normal, 1 / sum.coverage));
  pixel.material = sum.material;
  pixel.source_color = scaled(sum.source, seen);
  pixel.lns = static_cast<float>(sum.lns / k);
  pixel.visibility = sum.lns > 0 ? static_cast<float>(sum.arrived / sum.lns) : 0.0f;
  pixel.ess_ratio = static_cast<float>(sum.ess_ratio * seen);
  pixel.acceptance = static_cast<float>(sum.acceptance * seen);
  pixel.acceptance_local = static_cast<float>(sum.acceptance_local * seen);
  pixel.acceptance_independent = static_cast<float>(sum.acceptance_independent * seen);
  pixel.resampled = static_cast<float>(sum.resampled * seen);
  pixel.mask = static_cast<float>(sum.mask * seen);
  return pixel;
}

const FilmTile& RoundMean::finish() {
  for (std::size_t i = 0; i < sums_.size(); ++i) film_.write(i, mean(sums_[i]));
  return film_.film();
}

}  // namespace baton
