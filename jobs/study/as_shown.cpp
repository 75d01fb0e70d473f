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

/// What errors of pixels come to.
class Tally {
 public:
  explicit Tally(std::size_t num_blocks) : blocks_(num_blocks) {}

  struct Pixel {
    double squared = 0;    ///< its error; may be below zero
    double deviation = 0;  ///< its size
    double black = 0;      ///< 1: it is 0 and should not be
  };
  void add(const Pixel& pixel, std::size_t block, bool is_dark) {
    all_.add(pixel.squared);
    blocks_[block].add(pixel.squared);
    if (is_dark) darkest_.add(pixel.squared);
    deviations_.push_back(pixel.deviation);
    black_.add(pixel.black);
  }
  ErrorAsShown total() {
    ErrorAsShown error{.mse = all_.value(),
                       .darkest_mse = darkest_.value(),
                       .worst_block_mse = 0,
                       .percentile_99_9 = quantile(std::move(deviations_), 0.999),
                       .black = black_.value()};
    for (const Mean& block : blocks_) {
      if (block.count >= kFewestInNoiseBlock)
        error.worst_block_mse = std::max(error.worst_block_mse, block.value());
    }
    return error;
  }

 private:
  Mean all_, darkest_, black_;
  std::vector<Mean> blocks_;
  std::vector<double> deviations_;
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

ErrorAsShown ReferenceAsShown::noise_of_half() const {
  Tally tally(num_blocks_);
  for (std::size_t p = 0; p < pixels_.size(); ++p) {
    double squared = 0;
    std::array<bool, 2> is_black{true, true};
    for (std::size_t k = 3 * p; k < 3 * p + 3; ++k) {
      const double apart = double{half_[0][k]} - half_[1][k];
      squared += 0.5 * apart * apart / 3;
      for (std::size_t half = 0; half < 2; ++half)
        is_black[half] = is_black[half] && !(half_[half][k] > 0);
    }
    tally.add({squared, std::sqrt(squared), is_black[0] != is_black[1] ? 0.5 : 0}, block_[p],
              is_dark_[p] != 0);
  }
  return tally.total();
}

ErrorAsShown ReferenceAsShown::error_of(const RgbImage& test) const {
  Tally tally(num_blocks_);
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
    const double black = is_black && is_black_[p] == 0 ? 1 : 0;
    tally.add({squared, std::sqrt(against_mean), black}, block_[p], is_dark_[p] != 0);
  }
  return tally.total();
}

}  // namespace baton
