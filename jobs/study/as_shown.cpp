#include "jobs/study/as_shown.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/image/as_shown.h"
#include "common/image/noise.h"
#include "jobs/study/intervals.h"

namespace baton {
namespace {

constexpr float kWhole = 0.999f;  ///< coverage above which a pixel counts

struct Mean {
  double sum = 0;
  std::size_t count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

}  // namespace

ReferenceAsShown::ReferenceAsShown(const RgbImage& a, const RgbImage& b,
                                   const std::vector<float>& coverage) {
  BATON_CHECK(a.rgb.size() == b.rgb.size() && a.rgb.size() == 3 * coverage.size());
  const NoiseBlocks blocks({0, 0, a.width, a.height});
  num_blocks_ = blocks.count();
  std::vector<float> mean;
  for (std::size_t i = 0; i < coverage.size(); ++i) {
    if (!(coverage[i] > kWhole)) continue;
    pixels_.push_back(i);
    block_.push_back(blocks.of(i));
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) mean.push_back(0.5f * (a.rgb[k] + b.rgb[k]));
  }
  exposure_ = exposure_as_shown(mean);

  // Both halves, and how bright their mean is.
  std::vector<double> brightness;
  Mean own;
  for (std::size_t p = 0; p < pixels_.size(); ++p) {
    double sum = 0;
    bool is_black = true;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t k = 3 * pixels_[p] + c;
      const float of_a = encode_srgb(static_cast<float>(exposure_ * a.rgb[k]));
      const float of_b = encode_srgb(static_cast<float>(exposure_ * b.rgb[k]));
      half_[0].push_back(of_a);
      half_[1].push_back(of_b);
      own.add(0.25 * (double{of_a} - of_b) * (double{of_a} - of_b));
      sum += encode_srgb(static_cast<float>(exposure_ * mean[3 * p + c]));
      is_black = is_black && !(mean[3 * p + c] > 0);
    }
    brightness.push_back(sum);
    is_black_.push_back(is_black ? 1 : 0);
  }
  own_mse_ = own.value();
  const double dark = quantile(brightness, 0.25);
  for (const double sum : brightness) is_dark_.push_back(sum <= dark ? 1 : 0);
}

ErrorAsShown ReferenceAsShown::error_of(const RgbImage& test) const {
  Mean all, darkest, black;
  std::vector<Mean> blocks(num_blocks_);
  std::vector<double> deviation;
  for (std::size_t p = 0; p < pixels_.size(); ++p) {
    double squared = 0, against_mean = 0;
    bool is_black = true;
    for (std::size_t c = 0; c < 3; ++c) {
      const float linear = test.rgb[3 * pixels_[p] + c];
      const double shown = encode_srgb(static_cast<float>(exposure_ * linear));
      const double a = half_[0][3 * p + c], b = half_[1][3 * p + c];
      squared += (shown - a) * (shown - b) / 3;
      against_mean += (shown - 0.5 * (a + b)) * (shown - 0.5 * (a + b)) / 3;
      is_black = is_black && !(linear > 0);
    }
    all.add(squared);
    blocks[block_[p]].add(squared);
    if (is_dark_[p] != 0) darkest.add(squared);
    deviation.push_back(std::sqrt(against_mean));
    black.add(is_black && is_black_[p] == 0 ? 1 : 0);
  }
  ErrorAsShown error{.mse = all.value(),
                     .darkest_mse = darkest.value(),
                     .worst_block_mse = 0,
                     .percentile_99_9 = quantile(std::move(deviation), 0.999),
                     .black = black.value()};
  for (const Mean& block : blocks) {
    if (block.count >= kFewestInNoiseBlock)
      error.worst_block_mse = std::max(error.worst_block_mse, block.value());
  }
  return error;
}

}  // namespace baton
