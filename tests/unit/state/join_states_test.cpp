#include "common/state/join_states.h"

#include <gmock/gmock.h>

#include <random>

#include "common/state/memory_plane.h"

namespace baton {
namespace {

/// A state each of whose values is another.
SampleState state_of(const StateFormat& format, const PixelRect& rect, std::int32_t tile) {
  SampleState state;
  state.picture = {1, 2};
  state.step = Step(3);
  state.tile = tile;
  state.resize(format, rect, 4, 2);
  const SamplePlanes samples(state);
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    for (std::int32_t x = rect.x0; x < rect.x1; ++x) {
      const auto i = static_cast<std::size_t>((y - rect.y0) * rect.width() + (x - rect.x0));
      std::mt19937 random(static_cast<std::uint32_t>(1000 * y + x));
      for (std::size_t k = 0; k < 2; ++k) {
        samples.lns[2 * i + k] = static_cast<float>(random() % 100);
        samples.lns_fresh[2 * i + k] = static_cast<float>(random() % 100);
        state.source[2 * i + k] = PixelSource::carried;
      }
      for (std::size_t p = 4 * i; p < 4 * i + 4; ++p) {
        samples.direction[p] = static_cast<OctDirection>(random());
        samples.weight[p] = 0.5f;
        samples.site[p] = static_cast<std::uint8_t>(random() % 16);
      }
      if (&format == &memory_format()) {
        pixel_memory_plane(state)[i].light_noise = static_cast<std::uint16_t>(random() % 0x7F80);
        // Of the block: whatever part of it the tile has.
        VisibilityCell& cell = block_memory_plane(state)[PixelBlocks(rect).at(x, y)].cells[9];
        cell.seen = static_cast<std::uint8_t>(1 + y / 4 * 10 + x / 4);
      }
      if (&format == &weighed_sample_format())
        confidence_plane(state)[i] = static_cast<std::uint16_t>(random());
    }
  }
  return state;
}

TEST(JoinStates, AnyTilingGivesTheBytesOfTheTileItself) {
  const std::array<const StateFormat*, 3> formats{&sample_format(), &weighed_sample_format(),
                                                  &memory_format()};
  for (const StateFormat* const f : formats) {
    // Tiles end where blocks do.
    const SampleState a = state_of(*f, {0, 0, 4, 4}, 0), b = state_of(*f, {4, 0, 7, 4}, 1),
                      c = state_of(*f, {0, 4, 4, 9}, 2), d = state_of(*f, {4, 4, 7, 9}, 3);
    const std::array parts{&a, &b, &c, &d};
    for (const PixelRect& rect :
         {PixelRect{0, 0, 7, 9}, {1, 2, 6, 8}, {4, 0, 7, 4}, {3, 3, 6, 5}, {6, 8, 7, 9}}) {
      const Result<SampleState> joined = join_states(parts, rect, 9);
      ASSERT_TRUE(joined.ok()) << joined.error().message;
      EXPECT_EQ(encode_state(*joined), encode_state(state_of(*f, rect, 9)));
    }
  }
}

TEST(JoinStates, PartsThatDoNotFitAreRefused) {
  const SampleState a = state_of(sample_format(), {0, 0, 5, 4}, 0);
  SampleState b = state_of(sample_format(), {5, 0, 7, 4}, 1);
  const SampleState other = state_of(memory_format(), {5, 0, 7, 4}, 1);
  EXPECT_THAT(join_states(std::array{&a}, {0, 0, 6, 4}, 9).error().message,
              testing::HasSubstr("they cover 20 of 24 pixels"));
  b.step = Step(4);
  EXPECT_THAT(
      join_states(std::array<const SampleState*, 2>{&a, &b}, {0, 0, 7, 4}, 9).error().message,
      testing::HasSubstr("another picture, frame or layout"));
  EXPECT_THAT(
      join_states(std::array<const SampleState*, 2>{&a, &other}, {0, 0, 7, 4}, 9).error().message,
      testing::HasSubstr("another picture, frame or layout"));
  EXPECT_FALSE(join_states({}, {0, 0, 1, 1}, 9));

  // Tiles that cut blocks: what these remember is in no part.
  const SampleState left = state_of(memory_format(), {0, 0, 6, 8}, 0);
  const SampleState right = state_of(memory_format(), {6, 0, 12, 8}, 1);
  EXPECT_EQ(join_states(std::array<const SampleState*, 2>{&left, &right}, {0, 0, 12, 8}, 9)
                .error()
                .message,
            "joining states for tile 9: 2 of 6 blocks of 4 x 4 pixels lie in none of them whole");
}

}  // namespace
}  // namespace baton
