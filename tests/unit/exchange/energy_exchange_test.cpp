// The second pass on scenes so small that the right answer is a sum. The hypothesis of every z-test
// is "the mean of this pixel and channel is the given one"; the level of a comparison is 1e-3 over
// its pixels and channels [Sidak].
#include "worker/exchange/energy_exchange.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/unit/exchange/exact_scenes.h"

namespace baton {
namespace {

using namespace exact;
using exact::Method;
using exact::Scene;

struct Verdict {
  double worst_z = 0;
  /// |mean - expected| / expected where |z| is largest.
  double largest_bias = 0;
  /// Smallest relative bias of any value that would have reached the limit.
  double resolution = 0;
};

Verdict compare(const Scene& scene, const Method& method, int runs,
                const std::vector<double>& expected) {
  const exact::Estimate e = exact::estimate(scene, method, runs);
  Verdict v;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    // Floats add up to a relative 1e-5 at worst.
    const double error = std::hypot(e.error[i], 1e-5 * expected[i]);
    const double z = std::fabs(e.mean[i] - expected[i]) / error;
    v.resolution = std::max(v.resolution, kLimit * error / expected[i]);
    if (z <= v.worst_z) continue;
    v.worst_z = z;
    v.largest_bias = std::fabs(e.mean[i] - expected[i]) / expected[i];
  }
  return v;
}

void expect_unbiased(const Scene& scene, const Method& method, int runs) {
  const Verdict v = compare(scene, method, runs, truth(scene));
  std::printf("  worst |z| %.2f, resolves a bias of %.2f %%\n", v.worst_z, 100 * v.resolution);
  EXPECT_LT(v.worst_z, kLimit);
  EXPECT_LT(v.resolution, 0.003);
}

TEST(EnergyExchange, CorrectedWithCrossFoldIsUnbiased) {
  expect_unbiased(penumbra(), {}, 75000);
  expect_unbiased(scaled_penumbra(), {}, 75000);
  expect_unbiased(mixed_materials(), {}, 60000);
  expect_unbiased(extremes(), {}, 75000);
}
TEST(EnergyExchange, CorrectedWithSplitIsUnbiased) {
  expect_unbiased(scaled_penumbra(), {.policy = MaskPolicy::split}, 145000);
  expect_unbiased(mixed_materials(), {.policy = MaskPolicy::split}, 145000);
  expect_unbiased(extremes(), {.policy = MaskPolicy::split}, 145000);
}
TEST(EnergyExchange, SitesAreReceivers) { expect_unbiased(two_sites(), {}, 95000); }
TEST(EnergyExchange, DilationAddsNoBias) { expect_unbiased(extremes(), {.dilate = 1}, 90000); }

TEST(EnergyExchange, AMaskOfTheSameSamplesIsSeenToBeBiased) {
  // Few samples, so that a mask often misses a pixel.
  const Scene scene = mixed_materials();
  const Method method{.policy = MaskPolicy::same_samples, .num_slots = 8};
  const Verdict v = compare(scene, method, 40000, truth(scene));
  std::printf("  |z| %.1f, bias %.2f %%\n", v.worst_z, 100 * v.largest_bias);
  EXPECT_GT(v.worst_z, kLimit);
  EXPECT_GT(v.largest_bias, 0.003);
  EXPECT_LT(v.largest_bias, 0.05);
  // The other policies on the same samples.
  EXPECT_LT(compare(scene, {.num_slots = 8}, 40000, truth(scene)).worst_z, kLimit);
}

/// t(x -> x') of a method, when every pixel takes part: mean over the partitions of 1 / (pixels of
/// the square - 1).
double transition(const Scene& scene, const SquarePartitions& partitions, std::size_t from,
                  std::size_t to) {
  const auto x = [&](std::size_t pixel) { return static_cast<std::int32_t>(pixel) % scene.width; };
  const auto y = [&](std::size_t pixel) { return static_cast<std::int32_t>(pixel) / scene.width; };
  double sum = 0;
  for (std::int32_t c = 0; c < partitions.count(); ++c) {
    const PixelRect square = partitions.square(c, x(from), y(from));
    if (square.contains(x(to), y(to))) sum += 1.0 / static_cast<double>(square.area() - 1);
  }
  return sum / partitions.count();
}

/// Predicted mean radiance of a pixel under `published-kept`, every pixel taking part.
double predict_kept(const Scene& scene, const SquarePartitions& partitions, std::size_t x) {
  double value = mean(scene.truth(x));
  for (std::size_t y = 0; y < scene.num_pixels(); ++y) {
    if (y == x) continue;
    const double lns = std::min(scene.lns(x), scene.lns(y));
    for (std::size_t d = 0; d < kDirections; ++d) {
      if (scene.visible[scene.at(x, d)] == 0 || scene.visible[scene.at(y, d)] == 0) continue;
      const double difference =
          scene.target(scene.at(y, d)) / scene.lns(y) - scene.target(scene.at(x, d)) / scene.lns(x);
      value += transition(scene, partitions, x, y) * lns * difference;
    }
  }
  return value;
}

TEST(EnergyExchange, PublishedKeptHasThePredictedBias) {
  // All 16 offsets of squares of 4: t does not depend on the run.
  Scene scene = mixed_materials();
  for (Rgb& r : scene.reflected) r = Rgb{1, 1, 1} * mean(r);
  const Method method{
      .form = SecondPassForm::published_kept, .mask_all = true, .side = 4, .partitions = 16};
  std::vector<double> predicted;
  double largest = 0;
  for (std::size_t pixel = 0; pixel < 4; ++pixel) {
    const double p = predict_kept(scene, exact::partitions_of(scene, method, 1), pixel);
    predicted.insert(predicted.end(), 3, p);
    largest = std::max(largest, std::fabs(p / mean(scene.truth(pixel)) - 1));
    std::printf("  pixel %zu: %+.1f %%\n", pixel, 100 * (p / mean(scene.truth(pixel)) - 1));
  }
  EXPECT_GT(largest, 0.05);
  EXPECT_LT(compare(scene, method, 20000, predicted).worst_z, kLimit);
  EXPECT_GT(compare(scene, method, 20000, truth(scene)).worst_z, 10 * kLimit);
}

/// Predicted mean radiance of a pixel under `published`, every pixel taking part: what it receives
/// [eq. 8], and its own in partitions where it is alone.
double predict_published(const Scene& scene, const SquarePartitions& partitions, std::size_t x) {
  double alone = 1;
  double value = 0;
  for (std::size_t y = 0; y < scene.num_pixels(); ++y) {
    if (y == x) continue;
    const double offered = transition(scene, partitions, y, x);
    const double accepted = std::min(1.0, scene.lns(x) / scene.lns(y));
    for (std::size_t d = 0; d < kDirections; ++d) {
      if (scene.visible[scene.at(x, d)] != 0 && scene.visible[scene.at(y, d)] != 0)
        value += offered * accepted * scene.target(scene.at(y, d));
    }
    alone -= transition(scene, partitions, x, y);
  }
  return value + alone * mean(scene.truth(x));
}

TEST(EnergyExchange, PublishedLosesWhatIsRefused) {
  Scene scene = mixed_materials();
  for (Rgb& r : scene.reflected) r = Rgb{1, 1, 1} * mean(r);
  const Method method{
      .form = SecondPassForm::published, .mask_all = true, .side = 4, .partitions = 16};
  std::vector<double> predicted;
  double sum = 0;
  double true_sum = 0;
  for (std::size_t pixel = 0; pixel < 4; ++pixel) {
    const double p = predict_published(scene, exact::partitions_of(scene, method, 1), pixel);
    predicted.insert(predicted.end(), 3, p);
    sum += p;
    true_sum += mean(scene.truth(pixel));
    std::printf("  pixel %zu: %+.1f %%\n", pixel, 100 * (p / mean(scene.truth(pixel)) - 1));
  }
  std::printf("  energy %.0f %% of the truth\n", 100 * sum / true_sum);
  EXPECT_LT(sum, 0.9 * true_sum);
  EXPECT_LT(compare(scene, method, 20000, predicted).worst_z, kLimit);
  EXPECT_GT(compare(scene, method, 20000, truth(scene)).worst_z, 10 * kLimit);
}

TEST(EnergyExchange, EqualPixelsEvenPublishedIsRight) {
  // Where the products of a square agree, all forms with a kept share are one.
  const Scene scene = penumbra();
  EXPECT_LT(compare(scene, {.form = SecondPassForm::published_kept}, 20000, truth(scene)).worst_z,
            kLimit);
}

/// Red, green, blue and white pixels side by side.
Scene coloured() {
  Scene scene = penumbra();
  constexpr Rgb kColour[] = {{1, 0, 0}, {0, 2, 0}, {0, 0, 1}, {1, 1, 1}};
  for (std::size_t i = 0; i < scene.reflected.size(); ++i) {
    const auto d = static_cast<float>(i % kDirections);
    scene.reflected[i] = kColour[i / kDirections] * (1 + 0.3f * d);
  }
  return scene;
}

TEST(EnergyExchange, EnergyTakesTheReceiversColour) {
  const Scene scene = coloured();
  const std::vector<Rgb> pixels = exact::render(scene, {}, 7);
  for (std::size_t pixel = 0; pixel < 3; ++pixel) {
    EXPECT_EQ(pixels[pixel].x > 0, pixel == 0);
    EXPECT_EQ(pixels[pixel].y > 0, pixel == 1);
    EXPECT_EQ(pixels[pixel].z > 0, pixel == 2);
  }
  // The mean over RGB of each pixel, so that no expectation is 0.
  const exact::Estimate e = exact::estimate(scene, {}, 75000);
  for (std::size_t pixel = 0; pixel < 4; ++pixel) {
    const double expected = mean(scene.truth(pixel));
    const std::size_t channel = 3 * pixel + std::min<std::size_t>(pixel, 2);
    const double share = pixel == 3 ? 1.0 : 1.0 / 3;
    const double error = std::hypot(share * e.error[channel], 1e-5 * expected);
    EXPECT_LT(std::fabs(share * e.mean[channel] - expected), kLimit * error) << pixel;
    EXPECT_LT(kLimit * error, 0.003 * expected) << pixel;
  }
}

TEST(EnergyExchange, ALonePixelKeepsItsEnergy) {
  // Pixel 1 alone is shadowed; its neighbours are free, so nobody is there to take or give.
  Scene scene(3, 1, kDirections);
  for (std::size_t d = 0; d < 5; ++d) scene.visible[scene.at(1, d)] = 0;
  for (const SecondPassForm form :
       {SecondPassForm::corrected, SecondPassForm::published, SecondPassForm::published_kept}) {
    const std::vector<Rgb> pixels = exact::render(scene, {.form = form}, 3);
    EXPECT_NEAR(pixels[0].x, 10, 1e-4);
    EXPECT_NEAR(pixels[1].x, 5, 1e-4);
  }
}

TEST(EnergyExchange, ABlockedPixelReceives) {
  // Pixel 0 sees the last of ten directions; with two samples its own rays mostly fail.
  Scene scene = penumbra();
  for (std::size_t d = 0; d + 1 < kDirections; ++d) scene.visible[scene.at(0, d)] = 0;
  const Method method{.num_slots = 2};
  int received = 0;
  for (std::uint32_t seed = 1; seed <= 200; ++seed) {
    exact::Source source(scene, 2, 2, seed);
    std::vector<GiverSample> own;
    std::array<Giver, 1> giver;
    source.load_samples(giver, own);
    received += own.empty() && exact::render(scene, method, seed)[0].x > 0 ? 1 : 0;
  }
  EXPECT_GT(received, 20);
  EXPECT_LT(compare(scene, {.num_slots = 4}, 60000, truth(scene)).worst_z, kLimit);
}

TEST(EnergyExchange, BordersAreSymmetric) {
  // Squares of two in a row of five: every partition clips one at an end.
  Scene scene(5, 1, kDirections);
  for (std::size_t pixel = 0; pixel < 5; ++pixel) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      scene.reflected[scene.at(pixel, d)] =
          Rgb{1, 1, 1} * static_cast<float>(1 + (d * (pixel + 1)) % 4);
      scene.visible[scene.at(pixel, d)] = d >= 2 + pixel ? 1 : 0;
    }
  }
  expect_unbiased(scene, {.side = 2, .partitions = 2}, 60000);
  expect_unbiased(scene, {.side = 3, .partitions = 9}, 40000);
}

TEST(EnergyExchange, CutsOfTheImageDoNotShow) {
  Scene scene(9, 7, kDirections);
  for (std::size_t i = 0; i < scene.visible.size(); ++i) {
    scene.reflected[i] = Rgb{1, 0.5f, 0.2f} * static_cast<float>(1 + (i * 7) % 5);
    scene.visible[i] = (i * i) % 7 < 3 ? 0 : 1;
  }
  const Method method{.side = 3, .partitions = 9, .dilate = 1};
  const std::vector<Rgb> whole = exact::render(scene, method, 5);
  for (const PixelRect part :
       {PixelRect{0, 0, 4, 7}, PixelRect{4, 0, 9, 3}, PixelRect{4, 3, 9, 7}}) {
    const std::vector<Rgb> pixels = exact::render(scene, method, 5, part);
    std::size_t i = 0;
    for (std::int32_t y = part.y0; y < part.y1; ++y) {
      for (std::int32_t x = part.x0; x < part.x1; ++x) {
        EXPECT_EQ(pixels[i++], whole[static_cast<std::size_t>(y * 9 + x)]) << x << "," << y;
      }
    }
  }
}

}  // namespace
}  // namespace baton
