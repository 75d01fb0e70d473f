#include "worker/run/job_states.h"

#include <gtest/gtest.h>

#include "common/state/memory_plane.h"
#include "worker/pass/tile_renderer.h"

namespace baton {
namespace {

StatePtr state_of(std::int32_t side, bool with_memory) {
  SampleState state;
  if (with_memory) {
    state.resize(memory_format(), {0, 0, side, side}, 0);
  } else {
    state.resize(sample_format(), {0, 0, side, side}, 16);
  }
  return std::make_shared<const SampleState>(std::move(state));
}

StatePtr state_of_frame(std::int32_t frame) {
  SampleState state = *state_of(10, false);
  state.step = Step(frame);
  return std::make_shared<const SampleState>(std::move(state));
}

BlobRef held_ref(std::int32_t frame) {
  return {BlobKind::state, frame, 0, held_state_name({1, 2}, Step(frame), 0)};
}
BlobRef stored_ref(std::int32_t frame) {
  return {BlobKind::state, frame, 0, digest_of(std::to_string(frame)), 100};
}

MemorySharePtr room_for(std::size_t num_states) {
  return std::make_shared<MemoryShare>(num_states * state_of(10, false)->size_bytes());
}

// A pixel of `pool` takes 12 bytes and a block of 4 x 4 pixels 1024, beside 9 that every pixel
// takes.
TEST(JobStates, CountsWhatStatesTake) {
  JobStates states(std::make_shared<MemoryShare>(1 << 20));
  states.keep(digest_of("pool"), state_of(10, true));
  EXPECT_EQ(states.size_bytes(), 100u * (9 + 12) + 9 * sizeof(BlockMemory));
  states.keep(digest_of("sequential"), state_of(10, false));
  EXPECT_EQ(states.size_bytes(), 100u * (9 + 12 + 9 + 16 * 9) + 9 * sizeof(BlockMemory));
}

// What does not fit is not held: it goes into the store instead.
TEST(JobStates, HoldsWhatFitsUntilNobodyNeedsIt) {
  const auto share = room_for(2);
  JobStates states(share);
  EXPECT_TRUE(states.hold(held_ref(0), state_of_frame(0)));
  EXPECT_TRUE(states.hold(held_ref(1), state_of_frame(1)));
  EXPECT_TRUE(states.hold(held_ref(1), state_of_frame(1))) << "again";
  EXPECT_FALSE(states.hold(held_ref(2), state_of_frame(2)));
  EXPECT_EQ(share->used(), share->bytes());
  const JobStates::List held = states.held({held_ref(1).digest, held_ref(2).digest});
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held.front().first, held_ref(1));

  states.release_before(Step(1));
  EXPECT_EQ(states.find(held_ref(0)), nullptr);
  EXPECT_NE(states.find(held_ref(1)), nullptr);
  EXPECT_TRUE(states.hold(held_ref(2), state_of_frame(2)));
  EXPECT_EQ(states.held().size(), 2u);
}

// What can be read again makes room for what cannot.
TEST(JobStates, HeldStatesComeFirst) {
  JobStates states(room_for(2));
  states.keep(stored_ref(0).digest, state_of_frame(0));
  EXPECT_TRUE(states.hold(held_ref(1), state_of_frame(1)));
  EXPECT_NE(states.find(stored_ref(0)), nullptr);
  EXPECT_TRUE(states.hold(held_ref(2), state_of_frame(2)));
  EXPECT_EQ(states.find(stored_ref(0)), nullptr);
  states.keep(stored_ref(0).digest, state_of_frame(0));
  EXPECT_EQ(states.find(stored_ref(0)), nullptr) << "no room";
  EXPECT_EQ(states.held().size(), 2u);
}

// Jobs share the memory of a worker; one that is not at work leaves what it keeps, not what it
// holds.
TEST(JobStates, WhatIsKeptMakesRoomForAnotherJob) {
  const auto share = room_for(2);
  JobStates first(share), second(share);
  first.keep(stored_ref(0).digest, state_of_frame(0));
  EXPECT_TRUE(first.hold(held_ref(1), state_of_frame(1)));
  EXPECT_FALSE(second.hold(held_ref(3), state_of_frame(3)));
  first.drop_kept();
  EXPECT_TRUE(second.hold(held_ref(3), state_of_frame(3)));
  EXPECT_NE(first.find(held_ref(1)), nullptr);
}

}  // namespace
}  // namespace baton
