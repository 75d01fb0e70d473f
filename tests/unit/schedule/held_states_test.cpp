#include <gtest/gtest.h>

#include <set>

#include "coordinator/schedule/held_states.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;

/// The worker does a task, and holds its state if it may.
std::vector<Action> finish_holding(Farm& farm, const GrantLease& grant) {
  std::vector<BlobRef> outputs = outputs_of(farm.spec(), farm.job, grant.lease.task);
  for (BlobRef& blob : outputs) {
    if (grant.may_hold && blob.kind == BlobKind::state)
      blob = {blob.kind, blob.position, blob.tile,
              held_state_name(farm.job, blob.step(), blob.tile)};
  }
  return farm.step(TaskCompleted{grant.worker, grant.lease, {outputs}});
}

/// Tiles in a row that need their neighbours, 12 frames, checkpoints every 6.
JobSpec row_of(int tiles) {
  JobSpec job = moving_job(tiles, 12, 1);
  job.state.checkpoint_every = 6;
  return job;
}

/// Four tiles. Worker "a" is there and holds what it may.
class HeldStatesTest : public testing::Test {
 protected:
  void SetUp() override {
    farm.submit();
    farm.step(WorkerJoined{"a", {}});
  }
  std::vector<Action> finish(const GrantLease& grant) { return finish_holding(farm, grant); }
  /// "a" renders the first frame of all tiles.
  void render_first_frame() {
    for (int tile = 0; tile < 4; ++tile) finish(farm.ask_one("a"));
    while (farm.progress().frames_done == 0) finish(farm.ask_one("a"));
    ASSERT_EQ(held_now(farm.scheduler.find_job(farm.job)->tasks).size(), 4u);
  }
  Farm farm{row_of(4)};
};

TEST_F(HeldStatesTest, OneWorkerHoldsAllButCheckpointsAndResults) {
  std::map<std::int32_t, int> held;  // by run
  for (GrantLease grant = farm.ask_one("a"); grant.lease.attempt > 0; grant = farm.ask_one("a")) {
    if (grant.lease.task.kind == TaskKind::render)
      held[grant.lease.task.run().value()] += grant.may_hold;
    finish(grant);
  }
  EXPECT_EQ(farm.status(), JobStatus::done);
  for (const auto& [run, tiles] : held) EXPECT_EQ(tiles, run == 5 || run == 11 ? 0 : 4) << run;
}

TEST_F(HeldStatesTest, WhoHasNothingToDoMakesTheHolderPublish) {
  render_first_frame();
  farm.step(WorkerJoined{"b", {}});
  const std::vector<Action> actions = farm.step(WorkRequested{"b", 1});
  EXPECT_TRUE(all_of<GrantLease>(actions).empty()) << "it can read nothing";
  const auto asked = all_of<AskForStates>(actions);
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].worker, "a");
  EXPECT_EQ(asked[0].states.size(), 4u);
  EXPECT_TRUE(all_of<AskForStates>(farm.step(WorkRequested{"b", 1})).empty()) << "once";
  EXPECT_EQ(all_of<AskForStates>(farm.step(ClockTicked{})).size(), 1u) << "or the answer was lost";

  HeldPublished published{"a", farm.job, {}};
  for (const BlobRef& state : outputs_of(farm.spec(), farm.job, render(0, 0))) {
    if (state.kind != BlobKind::state) continue;
    for (std::int32_t tile = 0; tile < 4; ++tile) {
      const BlobRef packed{state.kind, 0, tile, digest_of(std::to_string(tile)), 20};
      published.states.push_back(
          {{state.kind, 0, tile, held_state_name(farm.job, Step(0), tile)}, packed});
    }
  }
  const auto after = farm.step(published);
  EXPECT_EQ(all_of<RecordOutputs>(after).size(), 4u);
  const auto granted = all_of<GrantLease>(after);
  ASSERT_EQ(granted.size(), 1u);
  EXPECT_EQ(granted[0].worker, "b");
  for (const BlobRef& input : granted[0].inputs) EXPECT_FALSE(input.is_held());
}

TEST_F(HeldStatesTest, NobodyElsePublishesThem) {
  render_first_frame();
  farm.step(WorkerJoined{"b", {}});
  const BlobRef held{BlobKind::state, 0, 1, held_state_name(farm.job, Step(0), 1)};
  const BlobRef packed{BlobKind::state, 0, 1, digest_of("1"), 20};
  for (const HeldPublished& event :
       {HeldPublished{"b", farm.job, {{held, packed}}},
        HeldPublished{"a", farm.job, {{held, held}}},
        HeldPublished{"a", farm.job, {{{held.kind, -1, 1, held.digest}, packed}}}}) {
    EXPECT_TRUE(all_of<RecordOutputs>(farm.step(event)).empty());
  }
}

TEST_F(HeldStatesTest, WithTheHolderTheyAreGone) {
  render_first_frame();
  const auto reopened = all_of<RecordReopened>(farm.step(WorkerLeft{"a"}));
  ASSERT_EQ(reopened.size(), 1u);
  EXPECT_EQ(reopened[0].tasks.size(), 4u);
  EXPECT_EQ(reopened[0].why, "what worker a held is gone");
  EXPECT_EQ(farm.progress().frames_done, 1u) << "the frame stays";
}

// The worker may have reported it once already, and dropped it since.
TEST_F(HeldStatesTest, WhatWasGrantedBeforeARestartIsMadeAgain) {
  const LeaseId lease{farm.job, render(0, 0), 1, /*epoch=*/0};
  GrantLease before;
  before.worker = "b";
  before.lease = lease;
  before.may_hold = true;
  farm.step(WorkerJoined{"b", {before.lease}});
  EXPECT_TRUE(all_of<RecordCompletion>(finish(before)).empty());
  EXPECT_EQ(farm.ask_one("a").lease.task, render(0, 0));
}

// It was silent, and what it held was lost; what it repeats then is of no use.
TEST_F(HeldStatesTest, WhatIsReportedForALeaseTakenUpAgainIsMadeAgain) {
  const GrantLease before = farm.ask_one("a");
  ASSERT_TRUE(before.may_hold);
  ASSERT_FALSE(all_of<RecordCompletion>(finish(before)).empty());
  farm.now += 2 * kSilence;
  farm.step(ClockTicked{});
  farm.step(WorkerJoined{"a", {}});
  EXPECT_TRUE(all_of<RecordCompletion>(finish(before)).empty());
}

// It has come to lose them in some way: what made them is done again, and put where it stays.
TEST_F(HeldStatesTest, WhatAHolderDoesNotHaveIsMadeAgainOnce) {
  render_first_frame();
  const GrantLease grant = farm.ask_one("a");
  ASSERT_EQ(grant.lease.task.kind, TaskKind::render);
  const auto actions = farm.step(InputsLost{"a", grant.lease, {grant.inputs.front()}});
  EXPECT_TRUE(all_of<RecordFailure>(actions).empty()) << "it costs no attempt";
  const auto reopened = all_of<RecordReopened>(actions);
  ASSERT_EQ(reopened.size(), 1u);
  EXPECT_EQ(reopened[0].tasks, std::vector{render(0, grant.inputs.front().tile)});
  EXPECT_EQ(reopened[0].why, "what worker a held is gone");

  bool is_made_again = false, are_others_held = false;
  for (GrantLease next = farm.ask_one("a"); next.lease.attempt > 0; next = farm.ask_one("a")) {
    is_made_again |= next.lease.task == reopened[0].tasks[0];
    EXPECT_FALSE(next.lease.task == reopened[0].tasks[0] && next.may_hold);
    are_others_held |= next.may_hold;
    finish(next);
  }
  EXPECT_TRUE(is_made_again);
  EXPECT_TRUE(are_others_held);
  EXPECT_EQ(farm.status(), JobStatus::done);
}

// A worker that has no time for a task has not failed it: holding goes on.
TEST_F(HeldStatesTest, AfterAReturnedLeaseStatesAreHeldAsBefore) {
  render_first_frame();
  farm.step(LeaseReturned{"a", farm.ask_one("a").lease});
  const GrantLease again = farm.ask_one("a");
  ASSERT_EQ(again.lease.task.kind, TaskKind::render);
  EXPECT_TRUE(again.may_hold);
}

TEST_F(HeldStatesTest, AfterAFailureNothingIsBoundToAWorker) {
  render_first_frame();
  farm.step(WorkerJoined{"b", {}});
  const GrantLease grant = farm.ask_one("a");
  ASSERT_EQ(grant.lease.task.kind, TaskKind::render);
  EXPECT_FALSE(all_of<RecordReopened>(farm.fail(grant)).empty()) << "its inputs are made again";
  const GrantLease next = farm.ask_one("b");
  ASSERT_EQ(next.lease.task.kind, TaskKind::render);
  EXPECT_FALSE(next.may_hold);
}

// "a" had all 20 tiles. When "b" comes, 10 to 19 are b's, and of so many states it wants those
// first.
TEST(HeldStates, WhoComesGetsAStripAndAsksForItsStatesFirst) {
  Farm farm(row_of(20));
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  while (farm.progress().frames_done == 0) finish_holding(farm, farm.ask_one("a"));
  farm.step(WorkerJoined{"b", {}});
  const auto asked = all_of<AskForStates>(farm.step(WorkRequested{"b", 1}));
  ASSERT_EQ(asked.size(), 1u);
  std::set<Digest> expected;  // eight tiles, and their neighbours
  for (std::int32_t tile = 9; tile <= 18; ++tile)
    expected.insert(held_state_name(farm.job, Step(0), tile));
  EXPECT_EQ(std::set<Digest>(asked[0].states.begin(), asked[0].states.end()), expected);
}

/// Two workers with four tiles each, and the states that are in the store.
class BorderTest : public testing::Test {
 protected:
  void SetUp() override {
    farm.submit();
    for (const char* const worker : {"a", "b"}) farm.step(WorkerJoined{worker, {}});
  }
  /// The workers take turns until all renders of the run are done.
  void finish_run(int run) {
    while (farm.scheduler.find_job(farm.job)->tasks.book().first_open_run().value() <= run) {
      for (const char* const worker : {"a", "b"}) {
        const GrantLease grant = farm.ask_one(worker);
        if (grant.lease.attempt > 0) states.note(finish_holding(farm, grant));
      }
    }
  }
  Farm farm{row_of(8)};
  StoredStates states;
};

// Tiles 3 and 4 are at the border.
TEST_F(BorderTest, WhatWorkersReadOfEachOtherStaysUntilTheNextCheckpoint) {
  finish_run(3);
  EXPECT_EQ(states.size(), 2u * 4);
  finish_run(4);
  EXPECT_EQ(states.size(), 2u * 5);
  finish_run(5);
  EXPECT_EQ(states.size(), 8u) << "the checkpoint";
}

TEST_F(BorderTest, ALostWorkerTakesItsOwnTilesAlone) {
  finish_run(4);
  const auto reopened = all_of<RecordReopened>(farm.step(WorkerLeft{"b"}));
  ASSERT_EQ(reopened.size(), 1u);
  EXPECT_EQ(reopened[0].tasks.size(), 3u * 5) << "what it held of five frames";
}

TEST_F(BorderTest, OnAFullDiskNothingStaysForALostWorker) {
  finish_run(3);
  const GrantLease grant = farm.ask_one("a");
  states.note(farm.step(SpaceLacking{"a", grant.lease, "the disk is full"}));
  EXPECT_EQ(states.size(), 2u) << "what the next frame needs";
}

}  // namespace
}  // namespace baton
