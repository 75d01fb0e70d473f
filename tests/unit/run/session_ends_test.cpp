#include <gtest/gtest.h>

#include "tests/unit/run/session_fixture.h"

namespace baton {
namespace {

using namespace test;

// Nobody has begun them: that is neither a failure nor a loss.
TEST_F(SessionTest, GivesBackWhatItDropsWhenItDrains) {
  welcome();
  grant(lease(0));
  grant(lease(1));
  step(DrainRequested{});
  const auto dropped = fail(lease(1), ErrorKind::cancelled);
  ASSERT_EQ(sent<LeaseReturn>(dropped).size(), 1u);
  EXPECT_EQ(sent<LeaseReturn>(dropped)[0].lease, lease(1));
  EXPECT_EQ(sent<LeaseReturn>(grant(lease(2))).at(0).lease, lease(2));
}

TEST_F(SessionTest, GivesBackATaskWhoseHeldInputsItDoesNotHave) {
  welcome();
  grant(lease(0));
  const BlobRef held{BlobKind::state, 1, 2, held_state_name({1, 1}, Step(1), 2)};
  const auto actions = step(TaskEnded{lease(0), TaskResult{.made = {}, .not_held = {held}}});
  ASSERT_EQ(sent<LeaseReturn>(actions).size(), 1u);
  EXPECT_EQ(sent<LeaseReturn>(actions)[0].not_held, std::vector{held});
  EXPECT_TRUE(sent<TaskDone>(actions).empty());
  EXPECT_TRUE(sent<TaskFailed>(actions).empty());
}

TEST_F(SessionTest, GivesBackATaskOfAJobThatItCannotSee) {
  welcome();
  grant(lease(0));
  const auto actions = step(TaskEnded{lease(0), TaskResult{.made = {}, .unseen = "/shows"}});
  ASSERT_EQ(sent<LeaseReturn>(actions).size(), 1u);
  EXPECT_EQ(sent<LeaseReturn>(actions)[0].unseen, "/shows");
  EXPECT_TRUE(sent<TaskDone>(actions).empty());
  EXPECT_TRUE(sent<TaskFailed>(actions).empty());
}

/// The same, in an allocation that ends after 100 s.
class PilotSessionTest : public SessionTest {
 protected:
  PilotSessionTest() {
    SessionOptions options{.identity = {.worker_id = "w",
                                        .host = {},
                                        .num_threads = 2,
                                        .build = {},
                                        .renderer = {},
                                        .running = {}},
                           .give_up = 60s,
                           .end_at = now_ + 100s,
                           .idle_exit = 30s,
                           .drain = 5s};
    session_ = Session(std::move(options), now_);
    welcome();
  }
  std::vector<SessionAction> grant_of(const LeaseId& lease, double expected_seconds) {
    return receive(LeaseGrant{lease, {}, {}, false, {}, expected_seconds});
  }
};

TEST_F(PilotSessionTest, TakesWhatItCanFinishAndNothingElse) {
  EXPECT_NE(find<StartTask>(grant_of(lease(0), 60)), nullptr);
  EXPECT_NE(find<StartTask>(grant_of(lease(1), 60)), nullptr);
  // Both threads are busy: a third one would be done after 2 x 60 s at the earliest.
  const auto refused = grant_of(lease(2), 60);
  EXPECT_EQ(find<StartTask>(refused), nullptr);
  ASSERT_EQ(sent<LeaseReturn>(refused).size(), 1u);
  EXPECT_EQ(sent<LeaseReturn>(refused)[0].lease, lease(2));
  EXPECT_EQ(sent<LeaseReturn>(refused)[0].unseen, "");
  // What it has begun it finishes; then it leaves.
  finish(lease(0));
  EXPECT_TRUE(sent<LeaseRequest>(finish(lease(1))).empty());
  receive(ReportReceived{lease(0)});
  EXPECT_NE(find<Leave>(receive(ReportReceived{lease(1)})), nullptr);
}

TEST_F(PilotSessionTest, GivesBackAllBeforeItsEnd) {
  grant_of(lease(0), 0);
  for (int i = 0; i < 97; ++i) {
    now_ += 1s;
    EXPECT_EQ(find<Leave>(receive(Heartbeat{})), nullptr) << i;
    EXPECT_EQ(find<Leave>(step(Tick{})), nullptr) << i;
  }
  const auto last = tick_after(1s);
  EXPECT_EQ(sent<WorkerGoodbye>(last).size(), 1u);
  ASSERT_NE(find<Leave>(last), nullptr);
  EXPECT_EQ(find<Leave>(last)->code, ExitCode::ok);
}

TEST_F(PilotSessionTest, DrainsOnlySoLong) {
  grant_of(lease(0), 0);
  step(DrainRequested{});
  EXPECT_EQ(find<Leave>(tick_after(4900ms)), nullptr);
  EXPECT_EQ(sent<WorkerGoodbye>(tick_after(100ms)).size(), 1u);
}

TEST_F(PilotSessionTest, ASecondSignalGivesBackAtOnce) {
  grant_of(lease(0), 0);
  step(DrainRequested{});
  const auto last = step(GiveBackRequested{});
  EXPECT_EQ(sent<WorkerGoodbye>(last).size(), 1u);
  EXPECT_NE(find<Leave>(last), nullptr);
}

TEST_F(PilotSessionTest, EndsWhenThereIsNothingToDo) {
  grant_of(lease(0), 0);
  EXPECT_EQ(find<Leave>(tick_after(40s)), nullptr);
  welcome();
  finish(lease(0));
  receive(ReportReceived{lease(0)});
  for (int i = 0; i < 29; ++i) {
    now_ += 1s;
    receive(NoWork{});
    EXPECT_EQ(find<Leave>(step(Tick{})), nullptr) << i;
  }
  EXPECT_NE(find<Leave>(tick_after(2s)), nullptr);
}

TEST_F(SessionTest, NamesThePictureInItsFramesPlace) {
  welcome();
  grant(lease(0));
  const auto actions =
      step(TaskEnded{lease(0), TaskResult{.made = {}, .in_place = PictureInPlace{{7, 8}, "ab"}}});
  ASSERT_EQ(sent<LeaseReturn>(actions).size(), 1u);
  EXPECT_EQ(sent<LeaseReturn>(actions)[0].in_place, (Digest{7, 8}));
  EXPECT_EQ(sent<LeaseReturn>(actions)[0].writer, "ab");
  EXPECT_TRUE(sent<TaskDone>(actions).empty());
}

// It gives its connection up, and comes back: somebody may have left.
TEST_F(SessionTest, AFullFarmIsAskedAgain) {
  const auto refuse = [&](ErrorKind kind) {
    return receive(Refused{static_cast<std::uint8_t>(kind), "the farm is full"});
  };
  EXPECT_EQ(sent<WorkerHello>(tick_after(0ms)).size(), 1u);
  for (int i = 0; i < 10; ++i) {
    const auto actions = refuse(ErrorKind::timeout);
    EXPECT_NE(find<HangUp>(actions), nullptr);
    EXPECT_EQ(find<Leave>(actions), nullptr);
    EXPECT_TRUE(sent<WorkerHello>(tick_after(14s)).empty());
    EXPECT_EQ(sent<WorkerHello>(tick_after(1s)).size(), 1u);
  }
  EXPECT_FALSE(sent<LeaseRequest>(welcome()).empty());
  EXPECT_EQ(find<HangUp>(refuse(ErrorKind::timeout)), nullptr) << "it is let in";
  EXPECT_EQ(find<Leave>(refuse(ErrorKind::io)), nullptr);
  EXPECT_NE(find<Leave>(refuse(ErrorKind::version)), nullptr);
}

}  // namespace
}  // namespace baton
