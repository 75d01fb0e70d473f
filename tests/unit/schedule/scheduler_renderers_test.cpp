#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

/// Workers that do not render alike.
namespace baton {
namespace {

using namespace testing_farm;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

// What is done of a job was done by one renderer; others get none of its tasks.
TEST_F(SchedulerTest, OnlyWhoRendersAlikeGoesOn) {
  farm.step(WorkerJoined{"a", {}, "AVX2"});
  const auto held = farm.ask("a", 2);
  const std::vector<Action> actions = farm.finish(held[0]);
  const auto recorded = all_of<RecordRenderer>(actions);
  ASSERT_THAT(recorded, SizeIs(1));
  EXPECT_EQ(recorded.front().renderer, "AVX2");
  EXPECT_THAT(all_of<RecordRenderer>(farm.finish(held[1])), SizeIs(0)) << "told once";

  farm.step(WorkerLeft{"a"});
  farm.step(WorkerLeft{"b"});
  farm.step(WorkerJoined{"c", {held[1].lease}, "SSE4"});
  EXPECT_THAT(farm.ask("c", 1), SizeIs(0));
  EXPECT_THAT(waits_for(farm.scheduler, farm.job, farm.now),
              AllOf(HasSubstr("with AVX2"), HasSubstr("render with SSE4"), HasSubstr("--isa")));
  // Where it does not matter, anybody goes on.
  farm.step(WorkerJoined{"d", {}});
  EXPECT_THAT(farm.ask("d", 1), SizeIs(1));
  farm.step(WorkerJoined{"e", {}, "AVX2"});
  EXPECT_EQ(waits_for(farm.scheduler, farm.job, farm.now), "");
}

/// A job of 2 tiles, 4 frames, 2 frames a run; each frame is by one renderer.
struct TakeOverTest : testing::Test {
  Farm farm{small_job(2, 4, 2), 1, 0, /*may_take_over=*/true};

  void SetUp() override {
    farm.submit();
    farm.step(WorkerJoined{"a", {}, "AVX2"});
    farm.step(WorkerJoined{"b", {}, "SSE4"});
  }
  /// As time passes; "b" speaks meanwhile.
  std::vector<Action> wait(std::chrono::milliseconds time) {
    farm.now += time;
    std::vector<Action> actions = farm.step(WorkerAlive{"b", {}});
    std::ranges::move(farm.step(ClockTicked{}), std::back_inserter(actions));
    return actions;
  }
};

TEST_F(TakeOverTest, OthersWaitWhileSomebodyRendersAsWasBegun) {
  const auto held = farm.ask("a", 1);
  EXPECT_THAT(farm.ask("b", 2), SizeIs(0)) << "nothing is done, but somebody has begun";
  farm.finish(held[0]);
  farm.step(WorkRequested{"a", 0});
  for (int i = 0; i < 3; ++i) {
    farm.step(WorkerAlive{"a", {}});
    EXPECT_THAT(all_of<GrantLease>(wait(kSilence)), SizeIs(0));
  }
  EXPECT_EQ(waits_for(farm.scheduler, farm.job, farm.now), "");
}

TEST_F(TakeOverTest, FramesThatAreNotDoneAreMadeAgain) {
  // Frames 1 and 2, and one tile of the others.
  for (int i = 0; i < 5; ++i) farm.finish(farm.ask_one("a"));
  EXPECT_EQ(farm.progress().frames_done, 2u);
  const GrantLease late = farm.ask_one("a");
  farm.step(WorkRequested{"b", 2});
  farm.step(WorkerLeft{"a"});
  EXPECT_THAT(all_of<RecordReopened>(wait(kSilence - 1ms)), SizeIs(0)) << "it may come back";

  const std::vector<Action> actions = wait(1ms);
  const auto reopened = all_of<RecordReopened>(actions);
  ASSERT_THAT(reopened, SizeIs(1));
  EXPECT_THAT(reopened[0].tasks, ElementsAre(render(1, 0), render(0, 0)))
      << "and what its state is made of";
  ASSERT_THAT(all_of<RecordRenderer>(actions), SizeIs(1));
  EXPECT_EQ(all_of<RecordRenderer>(actions)[0].renderer, "SSE4");
  EXPECT_THAT(tasks_of(all_of<GrantLease>(actions)), ElementsAre(render(0, 0), render(1, 1)));

  // What comes back has lost it.
  farm.step(WorkerJoined{"a", {late.lease}, "AVX2"});
  EXPECT_THAT(all_of<RecordCompletion>(farm.finish(late)), SizeIs(0));
  EXPECT_THAT(farm.ask("a", 2), SizeIs(0));
  for (const GrantLease& grant : all_of<GrantLease>(actions)) farm.finish(grant, /*variant=*/1);
  EXPECT_THAT(all_of<ReportConflict>(farm.work_off("b")), SizeIs(0));
  EXPECT_EQ(farm.status(), JobStatus::done);
}

TEST_F(TakeOverTest, WhoComesBackInTimeGoesOn) {
  for (int i = 0; i < 5; ++i) farm.finish(farm.ask_one("a"));
  farm.step(WorkRequested{"b", 2});
  for (int i = 0; i < 3; ++i) {
    farm.step(WorkerLeft{"a"});
    EXPECT_THAT(all_of<GrantLease>(wait(kSilence - 1ms)), SizeIs(0));
    farm.step(WorkerJoined{"a", {}, "AVX2"});
    farm.step(ClockTicked{});
  }
  EXPECT_THAT(tasks_of(farm.ask("a", 1)), ElementsAre(render(1, 1)));
}

}  // namespace
}  // namespace baton
