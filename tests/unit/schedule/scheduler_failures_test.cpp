#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/limits.h"
#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// ---- lost workers -------------------------------------------------------------------------------

TEST_F(SchedulerTest, ASilentWorkerLosesItsLeases) {
  const auto held = farm.ask("a", 2);
  farm.now += kSilence;
  farm.step(WorkerAlive{"b", {}});
  EXPECT_THAT(farm.step(ClockTicked{}), IsEmpty());
  farm.now += 1ms;
  EXPECT_THAT(all_of<ForgetWorker>(farm.step(ClockTicked{})), SizeIs(1));
  EXPECT_EQ(farm.progress().attempts_lost, 2u);
  EXPECT_THAT(tasks_of(farm.ask("b", 2)), ElementsAre(render(0, 0), render(0, 1)));
}

// The process was stopped, or its disk was slow: what was sent meanwhile is read after the tick.
TEST_F(SchedulerTest, WhoeverStoodStillTakesNobodyForSilent) {
  farm.ask("a", 2);
  for (int i = 0; i < 3; ++i) {
    farm.step(ClockTicked{});
    farm.now += 100 * kSilence;
    EXPECT_THAT(all_of<ForgetWorker>(farm.step(ClockTicked{})), IsEmpty());
    farm.step(WorkerAlive{"a", {}});
    farm.step(WorkerAlive{"b", {}});
  }
  // A coordinator that always comes late finds out who is gone, too.
  int turns = 0;
  for (; turns < 10; ++turns) {
    farm.step(WorkerAlive{"b", {}});
    farm.now += 10 * kSilence;
    const auto forgotten = all_of<ForgetWorker>(farm.step(ClockTicked{}));
    if (forgotten.empty()) continue;
    EXPECT_THAT(forgotten, SizeIs(1));
    EXPECT_EQ(forgotten[0].worker, "a");
    break;
  }
  EXPECT_EQ(turns, 4);
}

TEST_F(SchedulerTest, AnyMessageIsASignOfLife) {
  farm.ask("a", 1);
  for (int i = 0; i < 5; ++i) {
    farm.now += kSilence;
    farm.ask("a", 1);
  }
  EXPECT_EQ(all_of<ForgetWorker>(farm.step(ClockTicked{}))[0].worker, "b");
  EXPECT_EQ(farm.progress().tasks_leased, 2u);
}

// Honest workers report that themselves, before.
TEST_F(SchedulerTest, ALeaseThatIsHeldForTooLongFailsItsTask) {
  const LeaseId held = farm.ask_one("a").lease;
  const auto may_take = std::chrono::seconds(2 * JobSpec().max_seconds_per_task);
  const auto failed_after = [&](std::chrono::seconds time) {
    std::vector<RecordFailure> failed;
    for (const TimePoint end = farm.now + time; farm.now < end; farm.now += kSilence) {
      farm.step(WorkerAlive{"a", {held}});
      farm.step(WorkerAlive{"b", {}});
      for (RecordFailure& failure : all_of<RecordFailure>(farm.step(ClockTicked{})))
        failed.push_back(std::move(failure));
    }
    return failed;
  };
  EXPECT_THAT(failed_after(may_take), IsEmpty());
  const std::vector<RecordFailure> failed = failed_after(20min);
  ASSERT_THAT(failed, SizeIs(1));
  EXPECT_EQ(failed[0].failure.lease, held);
  EXPECT_THAT(failed[0].failure.message, HasSubstr("longer than maxSecondsPerTask"));
  EXPECT_EQ(farm.ask_one("b").lease.task, held.task);
  farm.step(WorkerAlive{"a", {held}});
  EXPECT_EQ(farm.progress().tasks_leased, 1u) << "it is not taken up again";
}

TEST_F(SchedulerTest, AGrantThatNeverArrivedIsFoundByTheHeartbeat) {
  const GrantLease lost = farm.ask_one("a");
  farm.step(WorkerAlive{"a", {}});
  EXPECT_EQ(farm.progress().tasks_leased, 1u) << "it may still be on its way";
  farm.now += kSilence;
  farm.step(WorkerAlive{"a", {}});
  EXPECT_EQ(farm.progress().tasks_leased, 0u);
  EXPECT_EQ(farm.ask_one("b").lease.task, lost.lease.task);
}

TEST_F(SchedulerTest, AWorkerThatIntroducesItselfAgainKeepsWhatItNames) {
  const auto held = farm.ask("a", 2);
  // What it does not name is told to have ended; nothing else follows.
  const std::vector<Action> actions = farm.step(WorkerJoined{"a", {held[0].lease}});
  ASSERT_THAT(actions, SizeIs(1));
  EXPECT_EQ(std::get<TellLeaseEnd>(actions.front()).end, LeaseEnd::lost);
  EXPECT_EQ(farm.progress().tasks_leased, 1u);
  EXPECT_THAT(all_of<RecordCompletion>(farm.finish(held[0])), SizeIs(1));
}

// Sixteen preemptions are no failure of the task, but may be its doing: somebody should look.
TEST_F(SchedulerTest, AJobWhoseTaskKeepsLosingItsWorkersIsPaused) {
  for (int round = 0; round < 2; ++round) {
    int losses = 0;
    for (farm.ask("a", 1); farm.status() == JobStatus::running && losses < 100; ++losses) {
      farm.step(WorkerJoined{"a", {}});
      farm.ask("a", 1);
    }
    EXPECT_EQ(losses, limits::kMaxTaskLosses);
    EXPECT_EQ(farm.status(), JobStatus::paused);
    EXPECT_THAT(farm.scheduler.find_job(farm.job)->waits, HasSubstr("frames 1-2, tile 0"));
    farm.step(JobResumed{farm.job});
  }
  EXPECT_EQ(farm.progress().tasks_failed, 0u);
  farm.step(WorkerJoined{"a", {}});
  farm.work_off("a");
  EXPECT_EQ(farm.status(), JobStatus::done);
}

TEST_F(SchedulerTest, AReportedLeaseIsNotTakenUpAgain) {
  const GrantLease grant = farm.ask_one("a");
  farm.step(SpaceLacking{"a", grant.lease, "full"});
  // The worker names the lease until its report is confirmed.
  EXPECT_THAT(all_of<RevokeLease>(farm.step(WorkerAlive{"a", {grant.lease}})), SizeIs(1));
  EXPECT_EQ(farm.progress().tasks_leased, 0u);
}

TEST_F(SchedulerTest, AFullDiskIsNobodysFailureHoweverOften) {
  for (int i = 0; i < 100; ++i) {
    const GrantLease grant = farm.ask_one("a");
    ASSERT_EQ(grant.lease.task, render(0, 0));
    farm.step(SpaceLacking{"a", grant.lease, "full"});
    EXPECT_EQ(farm.scheduler.find_job(farm.job)->waits, "full");
    EXPECT_THAT(farm.ask("a", 1), IsEmpty()) << "tries again at once";
    farm.step(WorkRequested{"a", 0});
    farm.now += Scheduler::kRest;
  }
  EXPECT_EQ(farm.progress().attempts_lost, 0u);
  farm.finish(farm.ask_one("a"));
  EXPECT_EQ(farm.scheduler.find_job(farm.job)->waits, "");
  farm.work_off("a");
  EXPECT_EQ(farm.status(), JobStatus::done);
}

TEST_F(SchedulerTest, OneTaskTellsWhetherAFullDiskHasSpaceAgain) {
  for (const GrantLease& grant : farm.ask("a", 2))
    farm.step(SpaceLacking{"a", grant.lease, "full"});
  farm.now += Scheduler::kRest;
  std::vector<GrantLease> grants = farm.ask("a", 2);
  ASSERT_THAT(grants, SizeIs(1)) << "the other one waits for what this one finds";
  const auto more = all_of<GrantLease>(farm.finish(grants[0]));
  EXPECT_THAT(more, Not(IsEmpty()));
}

TEST_F(SchedulerTest, WhoPausesAJobIsNoDisk) {
  farm.step(SpaceLacking{"a", farm.ask_one("a").lease, "full"});
  farm.step(JobPaused{farm.job});
  EXPECT_EQ(farm.scheduler.find_job(farm.job)->waits, "");
}

TEST_F(SchedulerTest, FramesAreWrittenWhileRenderingFindsNoSpace) {
  for (const GrantLease& grant : farm.ask("a", 2)) farm.finish(grant);
  const auto grants = farm.ask("a", 4);
  ASSERT_THAT(tasks_of(grants), ElementsAre(assemble(0), assemble(1), render(1, 0), render(1, 1)));
  farm.step(SpaceLacking{"a", grants[2].lease, "full"});
  farm.step(AttemptFailed{{grants[0].lease, "a", "boom"}});
  farm.step(WorkRequested{"b", 2});
  EXPECT_EQ(farm.scheduler.leases().of_worker("b").size(), 1u) << "the assembly, not the tile";
}

// ---- failures -----------------------------------------------------------------------------------

TEST_F(SchedulerTest, ARetryGoesToAnotherWorker) {
  const GrantLease grant = farm.ask_one("a");
  farm.fail(grant);
  EXPECT_NE(farm.ask_one("a").lease.task, grant.lease.task);
  EXPECT_EQ(farm.ask_one("b").lease.task, grant.lease.task);
}

TEST_F(SchedulerTest, TheSameWorkerMayRetryWhenItIsAlone) {
  farm.step(WorkerLeft{"b"});
  const GrantLease grant = farm.ask_one("a");
  farm.fail(grant);
  EXPECT_EQ(farm.ask_one("a").lease.task, grant.lease.task);
}

TEST_F(SchedulerTest, ATaskFailsAfterAllItsAttempts) {
  farm.step(WorkerLeft{"b"});
  for (int attempt = 0; attempt <= farm.spec().max_retries_per_task; ++attempt) {
    ASSERT_EQ(farm.status(), JobStatus::running);
    const GrantLease grant = farm.ask_one("a");
    ASSERT_EQ(grant.lease.task, render(0, 0));
    farm.fail(grant);
  }
  EXPECT_EQ(farm.status(), JobStatus::failed);
  EXPECT_EQ(farm.progress().tasks_open, 0u);
}

// What a worker lacks is its own trouble as long as another has it.
TEST_F(SchedulerTest, APermanentFailureIsOneWorkersTrouble) {
  const GrantLease grant = farm.ask_one("a");
  farm.fail(grant, /*permanent=*/true);
  EXPECT_EQ(farm.status(), JobStatus::running);
  EXPECT_NE(farm.ask_one("a").lease.task, grant.lease.task);
  const GrantLease again = farm.ask_one("b");
  EXPECT_EQ(again.lease.task, grant.lease.task);
  farm.finish(again);
  EXPECT_EQ(farm.progress().tasks_done, 1u);
}

TEST_F(SchedulerTest, APermanentFailureOfAllWorkersEndsTheJob) {
  farm.fail(farm.ask_one("a"), /*permanent=*/true);
  const auto grants = farm.ask("b", 2);
  const auto actions = farm.fail(grants[0], /*permanent=*/true);
  EXPECT_EQ(all_of<RecordJobStatus>(actions)[0].status, JobStatus::failed);
  EXPECT_TRUE(all_of<RecordFailure>(actions)[0].failure.last);
  EXPECT_EQ(all_of<RevokeLease>(actions)[0].lease, grants[1].lease);
  EXPECT_THAT(farm.ask("b", 1), IsEmpty());
}

TEST_F(SchedulerTest, AnAttemptIsLeftForEachWorkerThatHasNotTried) {
  farm.step(WorkerLeft{"b"});
  for (int i = 0; i < farm.spec().max_retries_per_task; ++i) farm.fail(farm.ask_one("a"));
  farm.step(WorkerJoined{"b", {}});
  const GrantLease last = farm.ask_one("a");  // tile 0 is b's now
  EXPECT_EQ(last.lease.task, render(0, 1));
  farm.finish(last);
  farm.finish(farm.ask_one("b"));
  EXPECT_EQ(farm.status(), JobStatus::running);
  EXPECT_EQ(farm.progress().tasks_done, 2u);
}

TEST(SchedulerFailures, ATaskFailsWithAsManyWorkersAsItMayHaveAttempts) {
  Farm farm(small_job(1, 1, 1));
  farm.submit();
  for (const char* name : {"a", "b", "c", "d", "e", "f"}) farm.step(WorkerJoined{name, {}});
  for (const char* name : {"a", "b", "c"}) {
    farm.fail(farm.ask_one(name), /*permanent=*/true);
    ASSERT_EQ(farm.status(), JobStatus::running);
  }
  farm.fail(farm.ask_one("d"));
  EXPECT_EQ(farm.status(), JobStatus::failed);
}

/// A job of one tile, which "a" cannot do and "b" has left.
struct DeadEnd : Farm {
  DeadEnd() : Farm(small_job(1, 1, 1)) {
    submit();
    step(WorkerJoined{"a", {}});
    step(WorkerJoined{"b", {}});
    fail(ask_one("a"), /*permanent=*/true);
    EXPECT_EQ(waits_for(scheduler, job, now), "") << "b may do it";
    step(WorkerLeft{"b"});
    EXPECT_THAT(ask("a", 1), IsEmpty());
    EXPECT_THAT(waits_for(scheduler, job, now), HasSubstr("a worker that can do frame 1, tile 0"));
  }
  void expect_that_it_is_done_by(const std::string& worker) {
    step(WorkerJoined{worker, {}});
    EXPECT_EQ(waits_for(scheduler, job, now), "");
    finish(ask_one(worker));
    EXPECT_EQ(progress().tasks_done, 1u);
  }
};

TEST(SchedulerFailures, ATaskThatNobodyThereCanDoWaitsForAnotherWorker) {
  DeadEnd().expect_that_it_is_done_by("c");
}

// Whoever makes a task again may have put its blob just before the old one is removed.
TEST(SchedulerFailures, WhatATaskInWorkMadeBeforeIsNotRemoved) {
  Farm farm(small_job(1, 2, 2));
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  const GrantLease first = farm.ask_one("a");
  farm.finish(first);
  farm.finish(farm.ask_one("a"));
  const Digest film = outputs_of(farm.spec(), farm.job, first.lease.task).front().digest;
  EXPECT_FALSE(farm.scheduler.is_referenced(film));
  EXPECT_FALSE(is_made_again(farm.scheduler, film)) << "nobody works on it";
  farm.step(TasksReopened{farm.job, {assemble(0), render(0, 0)}, "somebody wants it"});
  const GrantLease again = farm.ask_one("a");
  ASSERT_EQ(again.lease.task, first.lease.task);
  EXPECT_TRUE(is_made_again(farm.scheduler, film));
  farm.fail(again);
  EXPECT_FALSE(is_made_again(farm.scheduler, film));
}

TEST(SchedulerFailures, AWorkerThatStartsAnewMayTryOnceMore) {
  DeadEnd().expect_that_it_is_done_by("a");
}

TEST(SchedulerFailures, AJobGoesOnBelowItsLimitOfFailedTasks) {
  JobSpec spec = small_job(2, 4, 2);
  spec.max_failed_tasks = 2;
  Farm farm(spec);
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  farm.fail(farm.ask_one("a"), /*permanent=*/true);
  EXPECT_EQ(farm.status(), JobStatus::running);

  // Tile 1 is still rendered to the end; no frame can be written.
  for (const GrantLease& grant : all_of<GrantLease>(farm.work_off("a"))) {
    EXPECT_EQ(grant.lease.task.kind, TaskKind::render);
    EXPECT_EQ(grant.lease.task.tile, 1);
  }
  EXPECT_EQ(farm.status(), JobStatus::failed);
  EXPECT_EQ(farm.progress().tasks_done, 2u);
}

TEST(SchedulerFailures, WhatNeedsAFailedTaskIsTakenBackFromItsWorker) {
  JobSpec spec = moving_job(4, 4, 8);
  spec.max_failed_tasks = 10;
  Farm farm(spec);
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  farm.step(WorkerJoined{"b", {}});
  for (const char* name : {"a", "a", "b", "b"}) farm.finish(farm.ask_one(name));
  farm.finish(farm.ask_one("a"));
  std::map<TaskKey, GrantLease> grants;
  for (const char* name : {"a", "a", "b", "b"}) {
    const GrantLease grant = farm.ask_one(name);
    grants.emplace(grant.lease.task, grant);
  }

  // A state that tiles 0 and 1 read is lost, and cannot be made again.
  const GrantLease& kept = grants.at(render(1, 0));
  const GrantLease& blocked = grants.at(render(1, 1));
  farm.step(InputsLost{blocked.worker, blocked.lease, {blocked.inputs.at(0)}});
  farm.fail(farm.ask_one("b"), /*permanent=*/true);
  const auto actions = farm.fail(farm.ask_one("a"), /*permanent=*/true);
  const auto revoked = all_of<RevokeLease>(actions);
  ASSERT_EQ(revoked.size(), 1u);
  EXPECT_EQ(revoked[0].lease, kept.lease);
  EXPECT_EQ(farm.status(), JobStatus::running) << "the other tiles go on";
  EXPECT_EQ(farm.progress().tasks_leased, 2u);
  farm.step(WorkerLeft{kept.worker});
}

/// A job of four tiles, from which "bad" rests after two failures.
struct TwoFailures : Farm {
  static JobSpec spec_of_two() {
    JobSpec spec = small_job(4, 1, 1);
    spec.max_failures_per_worker = 2;
    return spec;
  }
  TwoFailures() : Farm(spec_of_two()) {
    submit();
    step(WorkerJoined{"bad", {}});
  }
  void fail_twice() {
    for (const GrantLease& grant : ask("bad", 2)) fail(grant);
  }
};

TEST(SchedulerFailures, AWorkerThatFailsMuchRestsAndIsForgiven) {
  TwoFailures farm;
  farm.step(WorkerJoined{"good", {}});
  farm.fail_twice();
  EXPECT_THAT(farm.ask("bad", 1), IsEmpty());
  EXPECT_THAT(farm.ask("good", 3), SizeIs(3));
  farm.now += Standings::kWorkerRest - 1s;
  EXPECT_THAT(farm.ask("bad", 1), IsEmpty());
  farm.now += 1s;
  farm.step(WorkerAlive{"good", {}});
  EXPECT_THAT(farm.ask("bad", 1), SizeIs(1));
}

// Whose failures they are cannot be told where everybody fails: no job waits for the end of a rest.
TEST(SchedulerFailures, NobodyRestsWhereAllWould) {
  TwoFailures farm;
  farm.step(WorkerJoined{"good", {}});
  farm.fail_twice();
  farm.step(WorkerLeft{"good"});
  EXPECT_THAT(waits_for(farm.scheduler, farm.job, farm.now), IsEmpty());
  EXPECT_THAT(farm.ask("bad", 1), SizeIs(1));
}

// With several leases at a time the worker has failed too much before it has used up any task.
TEST(SchedulerFailures, ALoneWorkerThatFailsEverythingEndsTheJobAtOnce) {
  TwoFailures farm;
  for (int round = 0; farm.status() == JobStatus::running; ++round) {
    ASSERT_LT(round, farm.spec().max_retries_per_task + 1);
    const auto grants = farm.ask("bad", 4);
    ASSERT_THAT(grants, SizeIs(4));
    for (const GrantLease& grant : grants) farm.fail(grant);
  }
  EXPECT_EQ(farm.status(), JobStatus::failed);
}

// A pilot whose time is up: the task is ready at once, and nobody is to blame.
TEST(SchedulerFailures, AReturnedLeaseIsNeitherFailureNorLoss) {
  Farm farm(small_job(1, 2, 2));
  farm.submit();
  farm.step(WorkerJoined{"short", {}});
  farm.step(WorkerJoined{"long", {}});
  for (int i = 0; i < 3 * limits::kMaxTaskLosses; ++i) {
    const GrantLease grant = farm.ask_one("short");
    ASSERT_EQ(grant.lease.task, render(0, 0)) << i;
    farm.step(LeaseReturned{"short", grant.lease});
    EXPECT_EQ(farm.progress().attempts_lost, 0u);
    // Said twice, and a heartbeat that still names it.
    farm.step(LeaseReturned{"short", grant.lease});
    EXPECT_THAT(all_of<RevokeLease>(farm.step(WorkerAlive{"short", {grant.lease}})), SizeIs(1));
  }
  EXPECT_EQ(farm.ask_one("long").lease.task, render(0, 0));
  EXPECT_EQ(farm.status(), JobStatus::running);
}

TEST(SchedulerFailures, WhoDoesNotSeeAJobGetsNothingOfItForAWhile) {
  Farm farm(small_job(4, 2, 2));
  farm.submit();
  farm.step(WorkerJoined{"blind", {}});
  const GrantLease grant = farm.ask_one("blind");
  farm.step(LeaseReturned{"blind", grant.lease, "/shows"});
  EXPECT_THAT(farm.ask("blind", 1), IsEmpty());
  EXPECT_EQ(waits_for(farm.scheduler, farm.job, farm.now), "a worker that sees /shows");

  farm.step(WorkerJoined{"sees", {}});
  EXPECT_THAT(waits_for(farm.scheduler, farm.job, farm.now), IsEmpty());
  EXPECT_THAT(farm.ask("sees", 1), SizeIs(1));
  EXPECT_EQ(farm.progress().attempts_lost, 0u);
  farm.now += Standings::kBlindRest;
  farm.step(WorkerJoined{"sees", {}});
  EXPECT_THAT(farm.ask("blind", 1), SizeIs(1));
}

TEST(SchedulerFailures, AGrantSaysHowLongTasksTake) {
  Farm farm(small_job(4, 2, 2));
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  const auto finish_in = [&](double seconds) {
    const GrantLease grant = farm.ask_one("a");
    TaskCompleted done{"a", grant.lease, {outputs_of(farm.spec(), farm.job, grant.lease.task)}};
    done.made.stats.cpu_seconds = seconds;
    farm.step(done);
    return grant.expected_seconds;
  };
  EXPECT_EQ(finish_in(10), 0);
  EXPECT_EQ(finish_in(5), 10);
  EXPECT_EQ(finish_in(20), 9.5);
  EXPECT_EQ(farm.ask_one("a").expected_seconds, 20);
  EXPECT_EQ(longest_task_seconds(farm.scheduler), 20);
}

// One worker's key is trusted with pixels, not with the end of a job.
TEST_F(SchedulerTest, WhatWasNeverGrantedIsNobodysFailure) {
  const GrantLease granted = farm.ask_one("a");
  const LeaseId& lease = granted.lease;
  const LeaseId others{lease.job, render(0, 1), 1, lease.epoch};  // nobody has it
  for (std::uint32_t attempt = 0; attempt < 20; ++attempt) {
    for (const std::uint32_t epoch : {0u, 1u, 2u}) {
      LeaseId claimed = others;
      claimed.attempt = attempt;
      claimed.epoch = epoch;
      farm.step(WorkerAlive{"b", {claimed}});
      if (attempt % 2 == 0) farm.step(AttemptFailed{{claimed, "b", "boom"}});
      if (attempt % 2 != 0) farm.step(TaskCompleted{"b", claimed, {}});  // an incomplete report
    }
  }
  EXPECT_EQ(farm.status(), JobStatus::running);
  EXPECT_FALSE(farm.scheduler.find_job(farm.job)->tasks.attempts().has_failed());
  // What it says of a lease that another one has is nothing either.
  farm.step(AttemptFailed{{lease, "b", "boom"}});
  EXPECT_EQ(all_of<RecordCompletion>(farm.finish(granted)).size(), 1u);
}

}  // namespace
}  // namespace baton
