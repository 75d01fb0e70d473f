#include "worker/run/state_cache.h"

#include <gtest/gtest.h>

#include <string>

#include "worker/pass/tile_renderer.h"

namespace baton {
namespace {

StatePtr state_of(std::int32_t side, bool with_memory) {
  SampleState state;
  state.resize({0, 0, side, side}, with_memory ? 0 : 16);
  if (with_memory) state.add_memory();
  if (with_memory) state.memory[7].bins.make();
  return std::make_shared<const SampleState>(std::move(state));
}

// A pixel of `pool` takes 25 bytes, and 514 more where it needs bins.
TEST(StateCache, CountsWhatStatesTake) {
  StateCache cache(1 << 20);
  cache.insert(digest_of("pool"), state_of(10, true));
  EXPECT_EQ(cache.size(), 100u * 25 + 514);
  cache.insert(digest_of("sequential"), state_of(10, false));
  EXPECT_EQ(cache.size(), 100u * (25 + 9 + 16 * 9) + 514);
}

// Four tiles a frame and room for five states: each tile of a frame finds its own of the frame
// before, although that is the one that was used least recently.
TEST(StateCache, ATileFindsItsStateOfTheFrameBefore) {
  const StatePtr state = state_of(10, false);
  StateCache cache(5 * state->size_bytes());
  const auto key = [](int frame, int tile) {
    return digest_of(std::to_string(frame) + "/" + std::to_string(tile));
  };
  for (int frame = 0; frame < 3; ++frame) {
    for (int tile = 0; tile < 4; ++tile) {
      const bool is_there = frame == 0 || cache.peek(key(frame - 1, tile)) != nullptr;
      EXPECT_TRUE(is_there) << frame << " " << tile;
      cache.insert(key(frame, tile), state);
    }
  }
}

// What no task needs any more leaves room at once.
TEST(StateCache, StatesOfEarlierFramesAreForgotten) {
  const auto state_of_frame = [](std::int32_t frame) {
    SampleState state = *state_of(10, false);
    state.frame_index = frame;
    return std::make_shared<const SampleState>(std::move(state));
  };
  StateCache cache(1 << 20);
  for (const std::int32_t frame : {3, 4, 5})
    cache.insert(digest_of(std::to_string(frame)), state_of_frame(frame));
  cache.release_before(5);
  EXPECT_EQ(cache.peek(digest_of("4")), nullptr);
  ASSERT_NE(cache.peek(digest_of("5")), nullptr);
  EXPECT_EQ(cache.size(), cache.peek(digest_of("5"))->size_bytes());
}

// What does not fit is not held: it goes into the store instead.
TEST(HeldStates, HoldsWhatFitsUntilNobodyNeedsIt) {
  const StatePtr state = state_of(10, false);
  HeldStates held(2 * state->size_bytes());
  const auto ref = [](std::int32_t frame) {
    return BlobRef{BlobKind::state, frame, 0, held_state_name({1, 2}, frame, 0)};
  };
  EXPECT_TRUE(held.hold(ref(0), state));
  EXPECT_TRUE(held.hold(ref(1), state));
  EXPECT_TRUE(held.hold(ref(1), state)) << "again";
  EXPECT_FALSE(held.hold(ref(2), state));
  EXPECT_EQ(held.size_bytes(), 2 * state->size_bytes());
  EXPECT_EQ(held.states({ref(1).digest, ref(2).digest}).size(), 1u);

  held.release_before(1);
  EXPECT_EQ(held.find(ref(0).digest), nullptr);
  EXPECT_EQ(held.find(ref(1).digest), state);
  EXPECT_TRUE(held.hold(ref(2), state));
}

}  // namespace
}  // namespace baton
