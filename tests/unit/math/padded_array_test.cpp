#include "common/math/padded_array.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/poison.h"

namespace baton {
namespace {

TEST(PaddedArray, HasRoomForVectorsThatBeginAtAnyElement) {
  PaddedArray<float, 5> array;
  const auto end = reinterpret_cast<std::uintptr_t>(&array + 1);
  EXPECT_LE(reinterpret_cast<std::uintptr_t>(array.from(4) + kVectorPadding), end);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(array.from(0)) % 64, 0u);

  array.pad(3, 7.0f);
  for (std::size_t i = 3; i < 3 + kVectorPadding; ++i) EXPECT_EQ(array.from(0)[i], 7.0f);
}

TEST(PaddedArrayDeathTest, CheckedBuildsCheckIndices) {
  if (!kCanPoison) return;  // only checked builds check
  PaddedArray<float, 5> array{};
  std::vector<int> vector(3);
  const volatile std::size_t past = 5;
  EXPECT_DEATH(array[past] = 1, "i < N");
  EXPECT_DEATH(*array.from(past) = 1, "i < N");
  EXPECT_DEATH(static_cast<void>(array.first(past + 1)), "count <= N");
  EXPECT_DEATH(vector[past] = 1, "Assertion");
}

TEST(Poison, FillsWorkSpaceWhileAPatternIsSet) {
  if (!kCanPoison) return;  // only checked builds check
  std::array<std::uint8_t, 6> bytes{};
  std::vector<std::uint32_t> words(2);
  set_poison(0x04030201u);
  poison(bytes);
  poison(words);
  set_poison(0);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 6>{1, 2, 3, 4, 1, 2}));
  EXPECT_EQ(words, std::vector<std::uint32_t>(2, 0x04030201u));
  words = {};
  poison(words);
  bytes = {};
  poison(bytes);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 6>{}));
}

}  // namespace
}  // namespace baton
