#include "jobs/study/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/math/philox.h"

namespace baton {
namespace {

constexpr int kWidth = 16, kHeight = 8;
constexpr std::size_t kPixels = kWidth * kHeight;

MeasuredFrame flat(float value) {
  MeasuredFrame frame;
  frame.image = {kWidth, kHeight, std::vector<float>(3 * kPixels, value)};
  frame.coverage.assign(kPixels, 1);
  frame.lns.assign(kPixels, 2);
  frame.variance.assign(kPixels, 0);
  return frame;
}

/// Uniform noise of variance sigma^2 on every value.
MeasuredFrame noisy(float value, float sigma, std::uint64_t seed) {
  MeasuredFrame frame = flat(value);
  for (std::uint32_t i = 0; i < frame.image.rgb.size(); ++i) {
    const float u = uniform_float(Philox4x32::block({i, 0, 0, 0}, seed)[0]);
    frame.image.rgb[i] += sigma * std::sqrt(12.0f) * (u - 0.5f);
  }
  return frame;
}

TEST(Measures, EqualPicturesHaveNoError) {
  const Reference reference = make_reference(flat(0.5f), flat(0.5f));
  const FrameMeasures m = measure_frame(flat(0.5f), reference);
  EXPECT_EQ(m.mse, 0);
  EXPECT_EQ(m.rel_mse, 0);
  EXPECT_EQ(m.flip, 0);
  EXPECT_EQ(m.bias, 0);
  EXPECT_EQ(m.percentile_99_9, 0);
  EXPECT_EQ(m.lns_mean, 1);
  EXPECT_EQ(m.lns_median, 1);
}

TEST(Measures, AConstantOffset) {
  const Reference reference = make_reference(flat(0.5f), flat(0.5f));
  const FrameMeasures m = measure_frame(flat(0.75f), reference);
  EXPECT_NEAR(m.mse, 0.0625, 1e-9);
  EXPECT_NEAR(m.rel_mse, 0.0625 / (0.51 * 0.51), 1e-6);
  EXPECT_NEAR(m.bias, 0.25, 1e-9);
  EXPECT_NEAR(m.percentile_99_9, 0.25, 1e-6);
  EXPECT_GT(m.flip, 0);
}

TEST(Measures, OnlyPixelsWithASurfaceCount) {
  MeasuredFrame half = flat(0.5f);
  MeasuredFrame test = flat(0.5f);
  half.coverage[3] = 0;
  test.image.rgb[3 * 3] = 100;
  const FrameMeasures m = measure_frame(test, make_reference(half, half));
  EXPECT_EQ(m.mse, 0);
  EXPECT_EQ(m.bias, 0);
}

TEST(Measures, LnsRatios) {
  const Reference reference = make_reference(flat(1), flat(1));
  MeasuredFrame test = flat(1);
  for (std::size_t i = 0; i < kPixels; ++i) test.lns[i] = i == 0 ? 2.0f * kPixels : 1.0f;
  const FrameMeasures m = measure_frame(test, reference);
  EXPECT_NEAR(m.lns_mean, (2.0 * kPixels + (kPixels - 1)) / (2.0 * kPixels), 1e-9);
  EXPECT_EQ(m.lns_median, 0.5);
}

// H0: the mean over seeds of the squared error against a noisy reference is the true one, 0.01.
// 400 pairs of seeds; one value has a relative standard deviation below 0.1, so the mean one of
// 0.005: a reference that counts twice (0.0125, +25 %) lies 50 deviations off.
TEST(Measures, TheNoiseOfTheReferenceDropsOut) {
  double sum = 0, against_mean = 0;
  constexpr std::uint64_t kSeeds = 400;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Reference reference =
        make_reference(noisy(0.5f, 0.1f, 3 * seed), noisy(0.5f, 0.1f, 3 * seed + 1));
    const MeasuredFrame test = noisy(0.5f, 0.1f, 3 * seed + 2);
    sum += measure_frame(test, reference).mse;
    for (std::size_t k = 0; k < test.image.rgb.size(); ++k) {
      const double error = test.image.rgb[k] - reference.mean.rgb[k];
      against_mean += error * error / static_cast<double>(test.image.rgb.size());
    }
  }
  EXPECT_NEAR(sum / kSeeds, 0.01, 2e-4);
  EXPECT_NEAR(against_mean / kSeeds, 0.015, 3e-4);  // what the halves save us from
}

// The variance of the mean of two halves with variance 0.01 each is 0.005.
TEST(Measures, AReferenceKnowsItsOwnError) {
  double sum = 0;
  constexpr std::uint64_t kSeeds = 100;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
    sum += make_reference(noisy(0.5f, 0.1f, 2 * seed), noisy(0.5f, 0.1f, 2 * seed + 1)).mse;
  EXPECT_NEAR(sum / kSeeds, 0.005, 3e-4);
}

TEST(Measures, FlickerOfIndependentAndOfFrozenErrors) {
  const Reference reference = make_reference(flat(0.5f), flat(0.5f));
  const MeasuredFrame frozen = noisy(0.5f, 0.1f, 1);
  EXPECT_EQ(measure_flicker(frozen, reference, frozen, reference), 0);
  EXPECT_NEAR(measure_flicker(frozen, reference, noisy(0.5f, 0.1f, 2), reference), 1, 0.2);
  EXPECT_TRUE(std::isnan(measure_flicker(flat(0.5f), reference, flat(0.5f), reference)));
}

// A grey of .18 is shown as .4 at the exposure that makes the mean .4; the curve of sRGB does the
// rest by hand.
TEST(AsShown, ErrorsAreThoseOfThePictureAtItsExposure) {
  const FrameMeasures same = measure_frame(flat(0.18f), make_reference(flat(0.18f), flat(0.18f)));
  EXPECT_EQ(same.shown.mse, 0);
  EXPECT_EQ(same.shown.black, 0);

  const Reference reference = make_reference(flat(0.18f), flat(0.18f));
  const FrameMeasures twice = measure_frame(flat(0.36f), reference);
  const double linear = std::pow((0.4 + 0.055) / 1.055, 2.4);
  const double error = 1.055 * std::pow(2 * linear, 1 / 2.4) - 0.055 - 0.4;
  EXPECT_NEAR(std::sqrt(twice.shown.mse), error, 1e-4);
  EXPECT_NEAR(std::sqrt(twice.shown.darkest_mse), error, 1e-4);
  EXPECT_NEAR(std::sqrt(twice.shown.worst_block_mse), error, 1e-4);
  EXPECT_NEAR(twice.shown.percentile_99_9, error, 1e-4);
}

TEST(AsShown, AHighlightCountsNoMoreThanWhite) {
  MeasuredFrame bright = flat(0.18f);
  for (std::size_t i = 0; i < kPixels / 2; ++i)
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) bright.image.rgb[k] = 1e6f;
  const Reference reference = make_reference(flat(0.18f), flat(0.18f));
  EXPECT_NEAR(measure_frame(bright, reference).shown.mse, 0.5 * 0.6 * 0.6, 1e-4);
}

TEST(AsShown, DarkPlacesBlocksAndSpecksAreToldApart) {
  // The left half is dark; one pixel in it is lost, and one that is black in the reference.
  MeasuredFrame half = flat(1);
  for (std::size_t i = 0; i < kPixels; ++i) {
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
      half.image.rgb[k] = i == 2 ? 0.0f : i % kWidth < kWidth / 2 ? 0.01f : 1.0f;
  }
  MeasuredFrame test = half;
  for (std::size_t k = 3; k < 6; ++k) test.image.rgb[k] = 0;
  const ErrorAsShown error = measure_frame(test, make_reference(half, half)).shown;
  EXPECT_NEAR(error.black, 1.0 / kPixels, 1e-12) << "of two black ones the reference has one";
  EXPECT_NEAR(error.darkest_mse, 2 * error.mse, 1e-9) << "equal values are a half of the picture";
  EXPECT_NEAR(error.worst_block_mse, error.mse, 1e-12) << "128 pixels are one square";
}

TEST(AsShown, PixelsThatASurfaceCoversInPartDoNotCount) {
  MeasuredFrame half = flat(0.5f), test = flat(0.5f);
  half.coverage[3] = 0.99f;
  for (std::size_t k = 9; k < 12; ++k) test.image.rgb[k] = 0;
  const ErrorAsShown error = measure_frame(test, make_reference(half, half)).shown;
  EXPECT_EQ(error.mse, 0);
  EXPECT_EQ(error.black, 0);
}

// H0: the error against halves of noise .02 is that against the truth; 200 seeds, 1 % of one
// deviation of the mean is .2 % of it. Counting the reference's own noise would add 50 %.
TEST(AsShown, TheNoiseOfTheReferenceDropsOut) {
  double against_halves = 0, against_truth = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const MeasuredFrame test = noisy(0.5f, 0.02f, 3 * seed + 2);
    against_halves += measure_frame(test, make_reference(noisy(0.5f, 0.02f, 3 * seed),
                                                         noisy(0.5f, 0.02f, 3 * seed + 1)))
                          .shown.mse;
    against_truth += measure_frame(test, make_reference(flat(0.5f), flat(0.5f))).shown.mse;
  }
  EXPECT_NEAR(against_halves / against_truth, 1, 0.02);
}

// H0: half the squared difference of two seeds is the error of one against the truth; 200 seeds, as
// above.
TEST(AsShown, TheNoiseOfAHalfIsItsErrorAgainstTheTruth) {
  double of_half = 0, against_truth = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const MeasuredFrame a = noisy(0.5f, 0.02f, 2 * seed), b = noisy(0.5f, 0.02f, 2 * seed + 1);
    of_half += ReferenceAsShown(a.image, b.image, a.coverage).noise_of_half().mse;
    against_truth += measure_frame(a, make_reference(flat(0.5f), flat(0.5f))).shown.mse;
  }
  EXPECT_NEAR(of_half / against_truth, 1, 0.02);
}

TEST(AsShown, TheNoiseOfAHalfHasItsCornerAndItsSpecks) {
  MeasuredFrame a = flat(0.18f), b = flat(0.18f);
  for (std::size_t k = 3; k < 6; ++k) a.image.rgb[k] = 0;
  for (std::size_t k = 6; k < 9; ++k) a.image.rgb[k] = b.image.rgb[k] = 0;
  const ErrorAsShown noise = ReferenceAsShown(a.image, b.image, a.coverage).noise_of_half();
  EXPECT_NEAR(noise.black, 0.5 / kPixels, 1e-12) << "one of two seeds; black in both is black";
  EXPECT_NEAR(noise.mse * kPixels, 0.5 * 0.4 * 0.4, 0.01);
  EXPECT_NEAR(noise.worst_block_mse, noise.mse, 1e-12) << "128 pixels are one square";
}

TEST(AsShown, PicturesWithoutAnyPixelOrLightAreMeasured) {
  MeasuredFrame nothing = flat(0);
  EXPECT_EQ(measure_frame(nothing, make_reference(nothing, nothing)).shown.mse, 0);
  nothing.coverage.assign(kPixels, 0);
  EXPECT_EQ(measure_frame(nothing, make_reference(nothing, nothing)).shown.mse, 0);
}

TEST(Reference, OneWhoseHalvesDifferByMoreThanItSaysIsNotTrusted) {
  const auto reference = [](float told) {
    MeasuredFrame a = noisy(2, 0.3f, 5), b = noisy(2, 0.3f, 6);
    a.variance.assign(kPixels, told * told);
    b.variance = a.variance;
    return make_reference(std::move(a), std::move(b));
  };
  constexpr float true_deviation = 0.3f;
  EXPECT_FALSE(reference_fault(reference(true_deviation)));
  EXPECT_FALSE(reference_fault(reference(true_deviation / 1.6f)));
  const auto fault = reference_fault(reference(true_deviation / 4));
  ASSERT_TRUE(fault);
  EXPECT_NE(fault->find("times the 0.05"), std::string::npos) << *fault;
  EXPECT_TRUE(reference_fault(reference(0))) << "no error at all is said";

  // Too few pixels say nothing.
  MeasuredFrame a = noisy(2, 0.3f, 5), b = noisy(2, 0.3f, 6);
  std::fill(a.coverage.begin() + 20, a.coverage.end(), 0.0f);
  EXPECT_FALSE(reference_fault(make_reference(std::move(a), std::move(b))));
}

}  // namespace
}  // namespace baton
