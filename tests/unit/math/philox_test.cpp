#include "common/math/philox.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

namespace baton {
namespace {

using Counter = Philox4x32::Counter;

/// The key's two words, as the vectors list them.
constexpr std::uint64_t key_of(std::uint32_t k0, std::uint32_t k1) {
  return (std::uint64_t{k1} << 32) | k0;
}

// kat_vectors of the Random123 distribution [Salmon et al. 2011], philox4x32 with 10 rounds.
TEST(Philox, MatchesTheKnownAnswers) {
  constexpr std::uint32_t kOnes = 0xffffffffu;
  EXPECT_EQ(Philox4x32::block({0, 0, 0, 0}, 0),
            (Counter{0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u}));
  EXPECT_EQ(Philox4x32::block({kOnes, kOnes, kOnes, kOnes}, key_of(kOnes, kOnes)),
            (Counter{0x408f276du, 0x41c83b0eu, 0xa20bc7c6u, 0x6d5451fdu}));
  EXPECT_EQ(Philox4x32::block({0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u},
                              key_of(0xa4093822u, 0x299f31d0u)),
            (Counter{0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u}));
}

TEST(Philox, RunsAtCompileTime) {
  static_assert(Philox4x32::block({0, 0, 0, 0}, 0)[0] == 0x6627e8d5u);
}

TEST(PixelNumber, CountsThePictureRowByRowWithoutItsOverscan) {
  EXPECT_EQ(pixel_number(640, 0, 0), 0u);
  EXPECT_EQ(pixel_number(640, 639, 1), 1279u);
  EXPECT_EQ(pixel_number(640, 5, 400), 400u * 640 + 5) << "below, too";
}

TEST(PixelNumber, NoTwoPixelsShareOne) {
  const std::int32_t width = 7, margin = 12;
  std::set<std::uint32_t> numbers;
  for (std::int32_t y = -margin; y < 5 + margin; ++y) {
    for (std::int32_t x = -margin; x < width + margin; ++x)
      numbers.insert(pixel_number(width, x, y));
  }
  EXPECT_EQ(numbers.size(), static_cast<std::size_t>((5 + 2 * margin) * (width + 2 * margin)));
  // The largest picture, at its corners.
  constexpr std::int32_t kSide = limits::kMaxImageSide, kMargin = limits::kMaxOverscan;
  const std::uint32_t first = pixel_number(kSide, -kMargin, -kMargin);
  const std::uint32_t last = pixel_number(kSide, kSide + kMargin - 1, kSide + kMargin - 1);
  EXPECT_EQ(first, 0x80000000u);
  EXPECT_EQ(last, 0x80000000u + 40960u * 40960u - 1);
  EXPECT_LT(pixel_number(kSide, kSide - 1, kSide + kMargin - 1), first);
}

TEST(UniformFloat, StaysBelowOne) {
  EXPECT_EQ(uniform_float(0), 0.0f);
  EXPECT_LT(uniform_float(0xffffffffu), 1.0f);
  EXPECT_EQ(uniform_float(0x80000000u), 0.5f);
}

TEST(Rng, EveryPartOfTheAddressMatters) {
  const RngKey key{.job_seed = 7, .frame = 3, .pixel = 1000};
  const std::set<Counter> draws = {
      Rng(key, PassId::move).bits(1, 2),
      Rng({.job_seed = 8, .frame = 3, .pixel = 1000}, PassId::move).bits(1, 2),
      Rng({.job_seed = 7ull + (1ull << 32), .frame = 3, .pixel = 1000}, PassId::move).bits(1, 2),
      Rng({.job_seed = 7, .frame = 4, .pixel = 1000}, PassId::move).bits(1, 2),
      Rng({.job_seed = 7, .frame = 3, .pixel = 1001}, PassId::move).bits(1, 2),
      Rng(key, PassId::resample).bits(1, 2),
      Rng(key, PassId::move).bits(2, 2),
      Rng(key, PassId::move).bits(1, 3),
  };
  EXPECT_EQ(draws.size(), 8u);
  EXPECT_EQ(Rng(key, PassId::move).bits(1, 2), Rng(key, PassId::move).bits(1, 2));
}

// z-test at about 1e-6: mean 1/2, variance 1/12 over 2^18 uniforms, and no correlation between the
// lanes of a block.
TEST(Rng, UniformsHaveTheRightMomentsOverNeighbouringPixels) {
  constexpr int kBlocks = 1 << 16;
  std::array<double, 4> sum{};
  double cross = 0;
  for (std::uint32_t pixel = 0; pixel < kBlocks; ++pixel) {
    const auto u =
        Rng({.job_seed = 1, .frame = 0, .pixel = pixel}, PassId::candidates).uniforms(0, 0);
    for (std::size_t lane = 0; lane < 4; ++lane) sum[lane] += u[lane];
    cross += (u[0] - 0.5) * (u[1] - 0.5);
  }
  const double sigma = std::sqrt(1.0 / 12 / kBlocks);
  for (const double s : sum) EXPECT_NEAR(s / kBlocks, 0.5, 5 * sigma);
  EXPECT_NEAR(cross / kBlocks, 0.0, 5 * (1.0 / 12) / std::sqrt(double{kBlocks}));
}

}  // namespace
}  // namespace baton
