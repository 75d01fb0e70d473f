#include "worker/run/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/base/limits.h"
#include "tests/unit/run/session_fixture.h"

namespace baton {
namespace {

using namespace test;

TEST_F(SessionTest, SaysHelloUntilItIsWelcome) {
  EXPECT_EQ(sent<WorkerHello>(tick_after(0ms)).size(), 1u);
  EXPECT_TRUE(tick_after(500ms).empty());
  EXPECT_EQ(sent<WorkerHello>(tick_after(500ms)).size(), 1u);
}

TEST_F(SessionTest, AsksForOneTaskMoreThanThreads) {
  const auto actions = welcome();
  ASSERT_NE(find<UseStore>(actions), nullptr);
  EXPECT_EQ(find<UseStore>(actions)->directory, "/store");
  ASSERT_EQ(sent<LeaseRequest>(actions).size(), 1u);
  EXPECT_EQ(sent<LeaseRequest>(actions)[0].count, 3);

  // A grant answers one of the three; the other two are still asked for.
  const auto after = grant(lease(0));
  ASSERT_NE(find<StartTask>(after), nullptr);
  EXPECT_EQ(find<StartTask>(after)->grant.lease, lease(0));
  EXPECT_TRUE(sent<LeaseRequest>(after).empty());
}

TEST_F(SessionTest, ReportsAndAsksAgainWhenATaskEnds) {
  welcome();
  for (int tile = 0; tile < 3; ++tile) grant(lease(tile));
  const auto actions = finish(lease(1));
  ASSERT_EQ(sent<TaskDone>(actions).size(), 1u);
  EXPECT_EQ(sent<TaskDone>(actions)[0].lease, lease(1));
  ASSERT_EQ(sent<LeaseRequest>(actions).size(), 1u);
  EXPECT_EQ(sent<LeaseRequest>(actions)[0].count, 1);
}

// What waits for the disk needs no thread, but is still in hand; and the disk may fall behind only
// so far.
TEST_F(SessionTest, AnExecutedTaskMakesRoomAndIsNotReported) {
  welcome();
  for (int tile = 0; tile < 3; ++tile) grant(lease(tile));
  const auto actions = step(TaskExecuted{lease(0)});
  EXPECT_EQ(sent<LeaseRequest>(actions).at(0).count, 1);
  EXPECT_TRUE(sent<TaskDone>(actions).empty());
  grant(lease(3));
  EXPECT_EQ(sent<Heartbeat>(tick_after(1000ms)).at(0).running.size(), 4u);

  step(TaskExecuted{lease(1)});
  grant(lease(4));
  EXPECT_TRUE(sent<LeaseRequest>(step(TaskExecuted{lease(2)})).empty());
  EXPECT_EQ(sent<TaskDone>(finish(lease(0))).size(), 1u);
}

TEST_F(SessionTest, ARequestNamesAllThatIsWanted) {
  welcome();
  grant(lease(0));
  EXPECT_EQ(sent<LeaseRequest>(finish(lease(0))).at(0).count, 3);
}

TEST_F(SessionTest, AnEndedTaskAsksAtOnceWhateverNoWorkSaid) {
  welcome();
  grant(lease(0));
  receive(NoWork{.retry_ms = 200});
  EXPECT_EQ(sent<LeaseRequest>(finish(lease(0))).at(0).count, 3);
}

TEST_F(SessionTest, WaitsAsLongAsNoWorkSays) {
  welcome();
  receive(NoWork{.retry_ms = 200});
  EXPECT_TRUE(sent<LeaseRequest>(tick_after(199ms)).empty());
  EXPECT_EQ(sent<LeaseRequest>(tick_after(1ms)).size(), 1u);
}

TEST_F(SessionTest, AsksAgainWhenARequestWasLost) {
  welcome();
  EXPECT_TRUE(sent<LeaseRequest>(tick_after(1900ms)).empty());
  EXPECT_EQ(sent<LeaseRequest>(tick_after(100ms)).size(), 1u);
}

TEST_F(SessionTest, BadInputIsPermanentAndALostDiskIsNot) {
  welcome();
  grant(lease(0));
  grant(lease(1));
  grant(lease(2));
  EXPECT_TRUE(sent<TaskFailed>(fail(lease(0), ErrorKind::bad_input)).at(0).permanent);
  EXPECT_FALSE(sent<TaskFailed>(fail(lease(1), ErrorKind::io)).at(0).permanent);
  const TaskFailed full = sent<TaskFailed>(fail(lease(2), ErrorKind::no_space)).at(0);
  EXPECT_TRUE(full.no_space && !full.permanent);
}

TEST_F(SessionTest, ARevokedTaskIsStoppedAndNotReported) {
  welcome();
  grant(lease(0));
  ASSERT_NE(find<StopTask>(receive(LeaseRevoke{lease(0)})), nullptr);
  const auto actions = fail(lease(0), ErrorKind::cancelled);
  EXPECT_TRUE(sent<TaskFailed>(actions).empty());
  EXPECT_TRUE(sent<TaskDone>(actions).empty());
  EXPECT_EQ(find<StopTask>(receive(LeaseRevoke{lease(0)})), nullptr);
}

TEST_F(SessionTest, WhatItLeavesInTheStoreIsNamed) {
  const BlobRef film{BlobKind::film, 3, 0, digest_of("film"), 10};
  const BlobRef held{BlobKind::state, 3, 0, digest_of("held"), 0};
  const BlobRef frame{BlobKind::image, 3, 0, digest_of("frame"), 10};
  const auto left = [](const std::vector<SessionAction>& actions) {
    const auto said = sent<BlobsLeft>(actions);
    return said.size() == 1 ? said[0].blobs : std::vector<Digest>();
  };
  const Error stopped{ErrorKind::cancelled, "stopped"};
  welcome();
  for (int tile = 0; tile < 3; ++tile) grant(lease(tile));

  // By a task that was stopped, or failed.
  receive(LeaseRevoke{lease(0)});
  EXPECT_THAT(left(step(TaskEnded{lease(0), stopped, {film}})), testing::ElementsAre(film.digest));
  EXPECT_THAT(left(step(TaskEnded{lease(0), stopped, {film}})), testing::ElementsAre(film.digest))
      << "its end was told before";

  // By one whose report came too late.
  const TaskResult output{{{film, held, frame}}};
  EXPECT_THAT(left(step(TaskEnded{lease(1), output})), testing::IsEmpty());
  EXPECT_THAT(left(receive(LeaseRevoke{lease(1)})), testing::ElementsAre(film.digest));
  step(TaskEnded{lease(2), output});
  EXPECT_THAT(left(receive(ReportReceived{lease(2)})), testing::IsEmpty());
}

TEST_F(SessionTest, AGrantThatComesTwiceStartsOneTask) {
  welcome();
  EXPECT_NE(find<StartTask>(grant(lease(0))), nullptr);
  EXPECT_EQ(find<StartTask>(grant(lease(0))), nullptr);
}

TEST_F(SessionTest, HeartbeatsNameTheLeasesInHand) {
  welcome();
  grant(lease(0));
  EXPECT_TRUE(sent<Heartbeat>(tick_after(999ms)).empty());
  const auto beats = sent<Heartbeat>(tick_after(1ms));
  ASSERT_EQ(beats.size(), 1u);
  EXPECT_EQ(beats[0].running, std::vector<LeaseId>{lease(0)});
}

TEST_F(SessionTest, AfterHelloAgainEveryReportFollowsTheWelcomeInOrder) {
  welcome();
  grant(lease(0));
  grant(lease(1));
  grant(lease(2));
  finish(lease(1));
  finish(lease(0));

  // The hello names what runs and what may have been lost.
  const auto hellos = sent<WorkerHello>(receive(HelloAgain{}));
  ASSERT_EQ(hellos.size(), 1u);
  EXPECT_THAT(hellos[0].running, testing::UnorderedElementsAre(lease(0), lease(1), lease(2)));
  EXPECT_TRUE(sent<WorkerHello>(receive(HelloAgain{})).empty());

  const auto actions = welcome();
  const auto done = sent<TaskDone>(actions);
  ASSERT_EQ(done.size(), 2u);
  EXPECT_EQ(done[0].lease, lease(1));
  EXPECT_EQ(done[1].lease, lease(0));
  EXPECT_TRUE(std::holds_alternative<LeaseRequest>(std::get<SendMessage>(actions.back()).message));
}

TEST_F(SessionTest, AReportMadeInSilenceWaitsForTheWelcome) {
  welcome();
  grant(lease(0));
  EXPECT_EQ(sent<WorkerHello>(tick_after(3100ms)).size(), 1u);
  EXPECT_TRUE(sent<TaskDone>(finish(lease(0))).empty());
  EXPECT_EQ(sent<TaskDone>(welcome()).size(), 1u);
}

TEST_F(SessionTest, AReportIsRepeatedUntilItIsConfirmed) {
  welcome();
  grant(lease(0));
  grant(lease(1));
  finish(lease(0));
  fail(lease(1), ErrorKind::io);
  EXPECT_THAT(sent<Heartbeat>(tick_after(1000ms)).at(0).running,
              testing::UnorderedElementsAre(lease(0), lease(1)))
      << "the coordinator must not give them to others before the reports come";
  for (int i = 0; i < 3; ++i) {
    const auto again = tick_after(2000ms);
    EXPECT_EQ(sent<TaskDone>(again).size(), 1u);
    EXPECT_EQ(sent<TaskFailed>(again).size(), 1u);
    receive(Heartbeat{});
  }
  receive(ReportReceived{lease(0)});
  receive(LeaseRevoke{lease(1)});
  const auto after = tick_after(2000ms);
  EXPECT_TRUE(sent<TaskDone>(after).empty());
  EXPECT_TRUE(sent<TaskFailed>(after).empty());
  EXPECT_THAT(sent<Heartbeat>(after).at(0).running, testing::IsEmpty());
}

TEST_F(SessionTest, NothingMoreIsTakenWhileNobodyConfirms) {
  welcome();
  int tile = 0;
  for (; tile < 1000; ++tile) {
    grant(lease(tile));
    if (sent<LeaseRequest>(finish(lease(tile))).empty()) break;
  }
  EXPECT_EQ(tile + 1, static_cast<int>(limits::kMaxUnconfirmedReports));
  EXPECT_EQ(sent<LeaseRequest>(receive(ReportReceived{lease(0)})).size(), 1u);
}

TEST_F(SessionTest, AMissingDocumentIsAskedForUntilItIsHere) {
  welcome();
  EXPECT_EQ(sent<JobDocumentRequest>(step(DocumentMissing{{1, 2}})).size(), 1u);
  EXPECT_TRUE(step(DocumentMissing{{1, 2}}).empty());
  EXPECT_EQ(sent<JobDocumentRequest>(tick_after(1000ms)).size(), 1u);
  ASSERT_NE(find<TakeDocument>(receive(JobDocument{{1, 2}, "{}"})), nullptr);
  EXPECT_TRUE(sent<JobDocumentRequest>(tick_after(1000ms)).empty());
}

TEST_F(SessionTest, TheCoordinatorMayAskForTheEndToo) {
  welcome();
  grant(lease(0));
  EXPECT_NE(find<DropQueuedTasks>(step(MessageArrived{Drain{}})), nullptr);
  finish(lease(0));
  const auto last = receive(ReportReceived{lease(0)});
  EXPECT_EQ(sent<WorkerGoodbye>(last).size(), 1u);
  ASSERT_NE(find<Leave>(last), nullptr);
  EXPECT_EQ(find<Leave>(last)->code, ExitCode::ok);
}

TEST_F(SessionTest, DrainsWhatRunsThenSaysGoodbye) {
  welcome();
  grant(lease(0));
  const auto draining = step(DrainRequested{});
  EXPECT_NE(find<DropQueuedTasks>(draining), nullptr);
  EXPECT_EQ(find<Leave>(draining), nullptr);
  EXPECT_EQ(find<StartTask>(grant(lease(1))), nullptr);
  const auto told = sent<Heartbeat>(step(Tick{}));
  ASSERT_EQ(told.size(), 1u) << "at once, not at its turn";
  EXPECT_TRUE(told[0].is_draining);

  const auto ended = finish(lease(0));
  EXPECT_EQ(sent<TaskDone>(ended).size(), 1u);
  EXPECT_TRUE(sent<LeaseRequest>(ended).empty());
  EXPECT_EQ(find<Leave>(ended), nullptr) << "the report may be lost";
  const auto last = receive(ReportReceived{lease(0)});
  EXPECT_EQ(sent<WorkerGoodbye>(last).size(), 1u);
  ASSERT_NE(find<Leave>(last), nullptr);
  EXPECT_EQ(find<Leave>(last)->code, ExitCode::ok);
}

TEST_F(SessionTest, WhatItHoldsIsPublishedWhenAskedForAndBeforeItLeaves) {
  const StatesPublished states{{1, 2}, {{{BlobKind::state, 3, 4, {5, 6}}, {}}}};
  holds_ = true;
  welcome();
  const auto asked = receive(RequestStates{{1, 2}, {{5, 6}}});
  ASSERT_NE(find<PackHeld>(asked), nullptr);
  EXPECT_EQ(find<PackHeld>(asked)->request->states, (std::vector<Digest>{{5, 6}}));
  const auto packed = step(HeldPacked{{states}});
  EXPECT_EQ(sent<StatesPublished>(packed).size(), 1u);
  EXPECT_EQ(find<Leave>(packed), nullptr);

  const auto draining = step(DrainRequested{});
  ASSERT_NE(find<PackHeld>(draining), nullptr);
  EXPECT_FALSE(find<PackHeld>(draining)->request) << "all";
  EXPECT_EQ(find<Leave>(draining), nullptr);
  EXPECT_EQ(find<PackHeld>(tick_after(10ms)), nullptr) << "once";
  const auto last = step(HeldPacked{{states}});
  EXPECT_EQ(sent<StatesPublished>(last).size(), 1u);
  EXPECT_NE(find<Leave>(last), nullptr);
}

TEST_F(SessionTest, GivesUpOnASilentCoordinator) {
  EXPECT_EQ(find<Leave>(tick_after(60s)), nullptr);
  const auto actions = tick_after(1ms);
  ASSERT_NE(find<Leave>(actions), nullptr);
  EXPECT_EQ(find<Leave>(actions)->code, ExitCode::unavailable);
}

TEST_F(SessionTest, ShutdownEndsAtOnce) {
  welcome();
  grant(lease(0));
  ASSERT_NE(find<Leave>(receive(Shutdown{})), nullptr);
}

TEST_F(SessionTest, AnotherProtocolVersionEndsTheWorkerAndOtherRefusalsDoNot) {
  EXPECT_NE(find<Leave>(receive(Refused{static_cast<std::uint8_t>(ErrorKind::version), "v2"})),
            nullptr);
  const auto actions =
      receive(Refused{static_cast<std::uint8_t>(ErrorKind::bad_input), "no such job"});
  EXPECT_EQ(find<Leave>(actions), nullptr);
  EXPECT_NE(find<Warn>(actions), nullptr);
}

}  // namespace
}  // namespace baton
