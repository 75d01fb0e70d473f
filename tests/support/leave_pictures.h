#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "tests/support/small_scene.h"

namespace baton::test {

/// Grey values as a PNG in the folder of the test. scale: what is white.
inline void leave_picture(const std::string& name, int width, const std::vector<double>& values,
                          double scale) {
  RgbImage image{width, static_cast<int>(values.size()) / width, {}};
  for (const double value : values) image.rgb.insert(image.rgb.end(), 3, float(value / scale));
  EXPECT_TRUE(write_png(test_folder() / name, image).ok());
}

/// What a test that fails leaves of an image and its reference, (height, width): both, and the size
/// of their difference, each as bright as it can be. Says where.
inline void leave_pictures(int width, const std::vector<double>& seen,
                           const std::vector<double>& expected) {
  std::vector<double> apart(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) apart[i] = std::fabs(seen[i] - expected[i]);
  const auto largest = [](const std::vector<double>& values) {
    return std::max(*std::max_element(values.begin(), values.end()), 1e-30);
  };
  leave_picture("seen.png", width, seen, largest(expected));
  leave_picture("expected.png", width, expected, largest(expected));
  leave_picture("difference.png", width, apart, largest(apart));
  ADD_FAILURE() << "seen.png, expected.png and difference.png are in " << test_folder();
}

}  // namespace baton::test
