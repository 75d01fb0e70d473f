#include "common/state/join_states.h"

#include <gmock/gmock.h>

#include <random>

namespace baton {
namespace {

/// A state with everything that one may hold, each value another.
SampleState state_of(const PixelRect& rect, std::int32_t tile) {
  SampleState state;
  state.picture = {1, 2};
  state.step = Step(3);
  state.tile = tile;
  state.resize(rect, 4, 2);
  state.add_memory();
  state.add_confidence();
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    for (std::int32_t x = rect.x0; x < rect.x1; ++x) {
      const auto i = static_cast<std::size_t>((y - rect.y0) * rect.width() + (x - rect.x0));
      std::mt19937 random(static_cast<std::uint32_t>(1000 * y + x));
      for (std::size_t k = 0; k < 2; ++k) {
        state.lns[2 * i + k] = static_cast<float>(random() % 100);
        state.lns_fresh[2 * i + k] = static_cast<float>(random() % 100);
        state.source[2 * i + k] = PixelSource::carried;
      }
      for (std::size_t p = 4 * i; p < 4 * i + 4; ++p) {
        state.direction[p] = static_cast<OctDirection>(random());
        state.weight[p] = 0.5f;
        state.site[p] = static_cast<std::uint8_t>(random() % 16);
      }
      state.memory[i].all_rays = static_cast<VisibilityCell>(random());
      state.confidence[i] = static_cast<std::uint16_t>(random());
    }
  }
  return state;
}

TEST(JoinStates, AnyTilingGivesTheBytesOfTheTileItself) {
  const SampleState a = state_of({0, 0, 5, 4}, 0), b = state_of({5, 0, 7, 4}, 1),
                    c = state_of({0, 4, 5, 9}, 2), d = state_of({5, 4, 7, 9}, 3);
  const std::array parts{&a, &b, &c, &d};
  for (const PixelRect& rect :
       {PixelRect{0, 0, 7, 9}, {1, 2, 6, 8}, {5, 0, 7, 4}, {4, 3, 6, 5}, {6, 8, 7, 9}}) {
    const Result<SampleState> joined = join_states(parts, rect, 9);
    ASSERT_TRUE(joined.ok()) << joined.error().message;
    EXPECT_EQ(encode_state(*joined), encode_state(state_of(rect, 9)));
  }
}

TEST(JoinStates, PartsThatDoNotFitAreRefused) {
  const SampleState a = state_of({0, 0, 5, 4}, 0);
  SampleState b = state_of({5, 0, 7, 4}, 1);
  EXPECT_THAT(join_states(std::array{&a}, {0, 0, 6, 4}, 9).error().message,
              testing::HasSubstr("they cover 20 of 24 pixels"));
  b.step = Step(4);
  EXPECT_THAT(
      join_states(std::array<const SampleState*, 2>{&a, &b}, {0, 0, 7, 4}, 9).error().message,
      testing::HasSubstr("another picture, frame or layout"));
  EXPECT_FALSE(join_states({}, {0, 0, 1, 1}, 9));
}

}  // namespace
}  // namespace baton
