#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/image/image_io.h"

namespace baton {

/// Errors of a picture as people see it: at one exposure, as sRGB, clamped to [0, 1], so that a
/// highlight counts no more than white and dark places count as the eye has them.
struct ErrorAsShown {
  double mse = 0;              ///< over pixels and R, G, B
  double darkest_mse = 0;      ///< of the reference's darkest quarter
  double worst_block_mse = 0;  ///< of squares with 64 such pixels
  /// 99.9th percentile over pixels of the root of a pixel's squared error.
  double percentile_99_9 = 0;
  double black = 0;  ///< share that is 0 and should not be
};

/// The truth as people see it, in two halves of independent noise.
class ReferenceAsShown {
 public:
  ReferenceAsShown() = default;
  /// a, b: of one size. coverage: (pixels); those above .999 count, beside them is what is no part
  /// of the sampling, such as the edge of a transparent background.
  ReferenceAsShown(const RgbImage& a, const RgbImage& b, const std::vector<float>& coverage);

  /// Squared errors are (I - A)(I - B), as those in linear radiance (FrameMeasures).
  ErrorAsShown error_of(const RgbImage& test) const;
  /// Of either half alone, as far as it is noise: half the squared difference of both, which has no
  /// part that both have. black: where the other half is not.
  ErrorAsShown noise_of_half() const;
  /// Mean squared error of the mean of the halves: what cannot be resolved.
  double own_mse() const { return own_mse_; }

 private:
  double exposure_ = 1, own_mse_ = 0;
  std::vector<std::size_t> pixels_;               ///< those that count
  std::vector<std::size_t> block_;                ///< of each of them
  std::vector<std::uint8_t> is_dark_, is_black_;  ///< each of them, in the reference
  std::size_t num_blocks_ = 0;
  /// (counted pixels, R G B) of either half.
  std::array<std::vector<float>, 2> half_;
};

}  // namespace baton
