#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// ---- dependencies -------------------------------------------------------------------------------

TEST_F(SchedulerTest, FirstRunsAreReadyAndNothingElse) {
  EXPECT_THAT(tasks_of(farm.ask("a", 10)), ElementsAre(render(0, 0), render(0, 1)));
}

TEST_F(SchedulerTest, NextRunGetsTheStateOfThePreviousOne) {
  const GrantLease first = farm.ask_one("a");
  farm.finish(first);
  const auto grants = farm.ask("a", 10);
  ASSERT_THAT(tasks_of(grants), ElementsAre(render(0, 1), render(1, 0)));
  ASSERT_THAT(grants[1].inputs, SizeIs(1));
  EXPECT_EQ(grants[1].inputs[0].kind, BlobKind::state);
  EXPECT_EQ(grants[1].inputs[0].step(), Step(1));
  EXPECT_EQ(grants[1].inputs[0].digest, blob_digest(farm.job, grants[1].inputs[0]));
}

TEST_F(SchedulerTest, FramesComeFirstAndGetOneFilmPerTile) {
  const auto grants = farm.ask("a", 2);
  farm.finish(grants[1]);
  farm.finish(grants[0]);
  const auto next = farm.ask("a", 10);
  ASSERT_THAT(tasks_of(next), ElementsAre(assemble(0), assemble(1), render(1, 0), render(1, 1)));
  ASSERT_THAT(next[1].inputs, SizeIs(2));
  for (int tile = 0; tile < 2; ++tile) {
    EXPECT_EQ(next[1].inputs[tile].kind, BlobKind::film);
    EXPECT_EQ(next[1].inputs[tile].step(), Step(1));
    EXPECT_EQ(next[1].inputs[tile].tile, tile);
  }
}

TEST(SchedulerWithoutState, AllRunsAreReadyAtOnce) {
  Farm farm(small_job(2, 4, 2, false));
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  EXPECT_THAT(tasks_of(farm.ask("a", 10)),
              ElementsAre(render(0, 0), render(0, 1), render(1, 0), render(1, 1)));
}

TEST_F(SchedulerTest, AHungryWorkerIsServedAsSoonAsThereIsWork) {
  const GrantLease first = farm.ask_one("a");
  farm.ask("a", 1);
  EXPECT_THAT(all_of<ReportNoWork>(farm.step(WorkRequested{"b", 2})), SizeIs(1));
  const auto actions = farm.finish(first);
  const auto grants = all_of<GrantLease>(actions);
  ASSERT_THAT(tasks_of(grants), ElementsAre(render(1, 0)));
  EXPECT_EQ(grants[0].worker, "b");
  EXPECT_TRUE(std::holds_alternative<RecordCompletion>(actions.front()))
      << "recorded before it is used";
}

TEST_F(SchedulerTest, WorkIsDealtOneByOneToAllWhoWait) {
  Farm fresh(small_job(4, 1, 1));
  fresh.step(WorkerJoined{"a", {}});
  fresh.step(WorkerJoined{"b", {}});
  fresh.ask("a", 4);
  fresh.ask("b", 4);
  fresh.submit();
  EXPECT_EQ(fresh.scheduler.leases().of_worker("a").size(), 2u);
  EXPECT_EQ(fresh.scheduler.leases().of_worker("b").size(), 2u);
}

TEST_F(SchedulerTest, AJobEndsWhenItsLastFrameIsWritten) {
  const auto ends = all_of<RecordJobStatus>(farm.work_off("a"));
  ASSERT_THAT(ends, SizeIs(1));
  EXPECT_EQ(ends[0].status, JobStatus::done);
  EXPECT_EQ(farm.progress().frames_done, 4u);
  EXPECT_EQ(farm.progress().state_pixels, 4u * 64);
}

TEST_F(SchedulerTest, HigherPriorityThenEarlierSubmissionComesFirst) {
  JobSpec urgent = small_job(1, 1, 1);
  urgent.priority = 90;
  farm.step(JobAdded{digest_of("equal"), small_job(1, 1, 1), JobStatus::running, {}, {}});
  farm.step(JobAdded{digest_of("urgent"), urgent, JobStatus::running, {}, {}});
  const auto grants = farm.ask("a", 10);
  ASSERT_THAT(grants, SizeIs(4));
  EXPECT_EQ(grants[0].lease.job, digest_of("urgent"));
  EXPECT_EQ(grants[1].lease.job, farm.job);
  EXPECT_EQ(grants[3].lease.job, digest_of("equal"));
}

// ---- fences -------------------------------------------------------------------------------------

TEST_F(SchedulerTest, ADoubleReportChangesNothing) {
  const GrantLease grant = farm.ask_one("a");
  farm.finish(grant);
  const JobProgress before = farm.progress();
  EXPECT_THAT(farm.finish(grant), IsEmpty());
  EXPECT_THAT(farm.fail(grant), IsEmpty());
  EXPECT_EQ(farm.progress().tasks_done, before.tasks_done);
}

TEST_F(SchedulerTest, ALateReportIsFencedOnceSomebodyElseHasTheTask) {
  const GrantLease old = farm.ask_one("a");
  farm.step(WorkerLeft{"a"});
  farm.step(WorkerJoined{"a", {}});
  const GrantLease current = farm.ask_one("b");
  ASSERT_EQ(current.lease.task, old.lease.task);
  ASSERT_NE(current.lease, old.lease);
  EXPECT_THAT(farm.finish(old), IsEmpty());
  EXPECT_THAT(farm.fail(old), IsEmpty());
  EXPECT_THAT(all_of<RecordCompletion>(farm.finish(current)), SizeIs(1));
}

TEST_F(SchedulerTest, ALateReportIsWelcomeWhileTheTaskIsOpen) {
  const GrantLease old = farm.ask_one("a");
  farm.step(WorkerLeft{"a"});
  farm.step(WorkerJoined{"a", {}});
  EXPECT_THAT(all_of<RecordCompletion>(farm.finish(old)), SizeIs(1));
}

TEST_F(SchedulerTest, TwoResultsForOneTaskAreABug) {
  const GrantLease grant = farm.ask_one("a");
  farm.finish(grant);
  const auto conflicts = all_of<ReportConflict>(farm.finish(grant, /*variant=*/1));
  ASSERT_THAT(conflicts, SizeIs(1));
  EXPECT_EQ(conflicts[0].maker, "a");
  EXPECT_EQ(farm.status(), JobStatus::paused) << "somebody should look before more is made of it";
  EXPECT_NE(conflicts[0].expected.digest, conflicts[0].reported.digest);
}

// Also the last task's: the job is not done before somebody has looked.
TEST_F(SchedulerTest, AnotherResultThanBeforeKeepsAJobFromItsEnd) {
  std::vector<Completion> all;
  for (TaskIndex task = 0; task < JobGraph(farm.spec()).num_tasks(); ++task) {
    const TaskKey key = JobGraph(farm.spec()).key(task);
    all.push_back({key, outputs_of(farm.spec(), farm.job, key), {}});
  }
  Farm again(farm.spec(), 2);
  again.step(JobAdded{
      again.job, again.spec(), JobStatus::running, completions_of(all), {}, {assemble(3)}});
  again.step(WorkerJoined{"b", {}});
  std::size_t num_conflicts = 0;
  for (int i = 0; i < 100 && again.status() == JobStatus::running; ++i) {
    const GrantLease grant = again.ask_one("b");
    const bool last = grant.lease.task == assemble(3);
    num_conflicts += all_of<ReportConflict>(again.finish(grant, last ? 1 : 0)).size();
  }
  EXPECT_EQ(num_conflicts, 1u);
  EXPECT_EQ(again.progress().tasks_open, 0u);
  EXPECT_EQ(again.status(), JobStatus::paused);
  EXPECT_THAT(waits_for(again.scheduler, again.job, again.now),
              testing::HasSubstr("worker b has made other bytes of frame 4 than were there"));
  again.step(JobResumed{again.job});
  EXPECT_EQ(again.status(), JobStatus::done);
}

TEST_F(SchedulerTest, AReportThatLacksAnOutputIsAFailedAttempt) {
  const GrantLease grant = farm.ask_one("a");
  std::vector<BlobRef> outputs = outputs_of(farm.spec(), farm.job, grant.lease.task);
  outputs.pop_back();
  const auto failures =
      all_of<RecordFailure>(farm.step(TaskCompleted{"a", grant.lease, {outputs}}));
  ASSERT_THAT(failures, SizeIs(1));
  EXPECT_THAT(failures[0].failure.message, testing::HasSubstr("lacks the state"));
}

TEST_F(SchedulerTest, NonsenseIsIgnored) {
  const LeaseId nowhere{digest_of("other"), render(0, 0), 1, 1};
  const LeaseId no_such_task{farm.job, render(9, 9), 1, 1};
  EXPECT_THAT(farm.step(TaskCompleted{"a", nowhere, {}}), IsEmpty());
  EXPECT_THAT(farm.step(TaskCompleted{"a", no_such_task, {}}), IsEmpty());
  EXPECT_THAT(farm.step(TaskCompleted{"stranger", {farm.job, render(0, 0), 1, 1}, {}}), IsEmpty());
  EXPECT_THAT(farm.step(WorkRequested{"stranger", 1}), IsEmpty());
  EXPECT_THAT(farm.step(WorkRequested{"a", -5}), IsEmpty());
  EXPECT_THAT(farm.step(JobCancelled{digest_of("other")}), IsEmpty());
}

}  // namespace
}  // namespace baton
