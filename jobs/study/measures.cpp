#include "jobs/study/measures.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/image/contact_sheet.h"
#include "jobs/study/flip.h"
#include "jobs/study/intervals.h"

namespace baton {
namespace {

double mean_over(const std::vector<float>& values, const std::vector<std::size_t>& pixels) {
  if (values.empty() || pixels.empty()) return 0;
  double sum = 0;
  for (const std::size_t i : pixels) sum += values[i];
  return sum / static_cast<double>(pixels.size());
}

}  // namespace

FrameMeasures measure_frame(const MeasuredFrame& test, const Reference& reference) {
  const auto& a = reference.half[0];
  const auto& b = reference.half[1];
  BATON_CHECK(test.image.rgb.size() == reference.mean.rgb.size());
  FrameMeasures m;
  if (reference.lit_pixels.empty()) return m;

  // Errors of colour.
  std::vector<double> deviation, lns_ratio;
  double sum = 0, sum_relative = 0, sum_signed = 0, sum_lns = 0;
  m.block_mse.resize(reference.num_blocks);
  for (std::size_t lit = 0; lit < reference.lit_pixels.size(); ++lit) {
    const std::size_t i = reference.lit_pixels[lit];
    double pixel = 0, pixel_squared = 0;
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
      const double value = test.image.rgb[k];
      const double r = reference.mean.rgb[k];
      const double squared = (value - a.image.rgb[k]) * (value - b.image.rgb[k]);
      pixel_squared += squared;
      sum_relative += squared / ((r + kRelativeFloor) * (r + kRelativeFloor));
      sum_signed += value - r;
      pixel += std::abs(value - r) / 3;
    }
    sum += pixel_squared;
    m.block_mse[reference.block[lit]] += pixel_squared;
    deviation.push_back(pixel);
    const double lns = 0.5 * (double{a.lns[i]} + b.lns[i]);
    sum_lns += test.lns[i];
    if (lns > 0) lns_ratio.push_back(test.lns[i] / lns);
  }
  const auto count = static_cast<double>(reference.lit_pixels.size());
  m.mse = sum / (3 * count);
  for (double& share : m.block_mse) share /= 3 * count;
  m.rel_mse = sum_relative / (3 * count);
  m.bias = sum_signed / (3 * count);
  m.percentile_99_9 = quantile(std::move(deviation), 0.999);

  // The eye's.
  const RgbImage displayed = tone_map(test.image, reference.exposure);
  m.shown = reference.shown.error_of(test.image);
  m.flip = mean_over(flip_difference(reference.displayed, displayed), reference.lit_pixels);

  // The sampler's own numbers.
  m.lns_mean = reference.lns_mean > 0 ? sum_lns / count / reference.lns_mean : 0;
  m.lns_median = quantile(std::move(lns_ratio), 0.5);
  m.ess = mean_over(test.ess, reference.lit_pixels);
  m.acceptance = mean_over(test.acceptance, reference.lit_pixels);
  return m;
}

double measure_flicker(const MeasuredFrame& before, const Reference& reference_before,
                       const MeasuredFrame& now, const Reference& reference_now) {
  double change = 0, error = 0;
  for (const std::size_t i : reference_now.lit_pixels) {
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
      // Errors against either half, before and now.
      const auto against = [k](const MeasuredFrame& test, const Reference& reference, int half) {
        return double{test.image.rgb[k]} - reference.half[half].image.rgb[k];
      };
      const double before_a = against(before, reference_before, 0);
      const double before_b = against(before, reference_before, 1);
      const double now_a = against(now, reference_now, 0);
      const double now_b = against(now, reference_now, 1);
      change += (now_a - before_a) * (now_b - before_b);
      error += now_a * now_b + before_a * before_b;
    }
  }
  return error > 0 ? change / error : kNotMeasured;
}

}  // namespace baton
