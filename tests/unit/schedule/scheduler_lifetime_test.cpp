#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/limits.h"
#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

/// Cancelled jobs, blobs that nobody needs, restarts of the coordinator.
namespace baton {
namespace {

using namespace testing_farm;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(SchedulerTest, ACancelledJobTakesItsLeasesBack) {
  const auto grants = farm.ask("a", 2);
  const auto actions = farm.step(JobCancelled{farm.job});
  EXPECT_THAT(all_of<RevokeLease>(actions), SizeIs(2));
  EXPECT_EQ(farm.status(), JobStatus::cancelled);
  // A report that crossed that on its way changes nothing; what it made goes.
  const auto removed = farm.finish(grants[0]);
  EXPECT_THAT(removed, SizeIs(1));
  EXPECT_THAT(all_of<RemoveBlobs>(removed), SizeIs(1));
  EXPECT_THAT(farm.step(JobCancelled{farm.job}), IsEmpty());
}

TEST_F(SchedulerTest, BlobsGoWhenTheirLastUserIsDone) {
  // Both runs of tile 0: the state of the first is needed no more, the last one is kept.
  farm.finish(farm.ask_one("a"));
  const auto next = farm.ask("a", 2);
  const auto removed = all_of<RemoveBlobs>(farm.finish(next[1]));
  ASSERT_THAT(removed, SizeIs(1));
  EXPECT_THAT(removed[0].blobs, ElementsAre(next[1].inputs[0].digest));

  // A frame's films go when it is written.
  farm.finish(next[0]);
  const GrantLease frame = farm.ask_one("a");
  ASSERT_EQ(frame.lease.task, assemble(0));
  EXPECT_THAT(all_of<RemoveBlobs>(farm.finish(frame))[0].blobs, SizeIs(2));
  EXPECT_FALSE(farm.scheduler.is_referenced(frame.inputs[0].digest));
}

TEST(SchedulerBlobs, AllStatesStayWhenTheJobWantsThem) {
  JobSpec spec = small_job(1, 2, 1);
  spec.state.keep = StateKeep::all;
  Farm farm(spec);
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  farm.work_off("a");
  for (int frame = 0; frame < 2; ++frame) {
    EXPECT_TRUE(
        farm.scheduler.is_referenced(blob_digest(farm.job, {BlobKind::state, frame, 0, {}, 0})));
    EXPECT_FALSE(
        farm.scheduler.is_referenced(blob_digest(farm.job, {BlobKind::film, frame, 0, {}, 0})));
  }
}

TEST(SchedulerBlobs, AStateStaysUntilEveryNeighbourHasGoneOn) {
  Farm farm(moving_job(3, 3, 8));
  farm.submit();
  const auto state = [&](int frame, int tile) {
    return blob_digest(farm.job, {BlobKind::state, frame, tile, {}, 0});
  };
  std::map<TaskKey, GrantLease> held;
  const auto take = [&](const std::vector<Action>& actions) {
    for (const GrantLease& grant : all_of<GrantLease>(actions)) held[grant.lease.task] = grant;
  };
  const auto finish = [&](const TaskKey& task) {
    const GrantLease grant = held.at(task);
    held.erase(task);
    take(farm.finish(grant));
  };
  take(farm.step(WorkerJoined{"a", {}}));
  take(farm.step(WorkRequested{"a", 100}));
  for (int tile = 0; tile < 3; ++tile) finish(render(0, tile));

  // Tile 0 is needed by tiles 0 and 1 of the next frame, tile 1 by all three.
  EXPECT_THAT(held.at(render(1, 1)).inputs, SizeIs(3));
  finish(render(1, 0));
  EXPECT_TRUE(farm.scheduler.is_referenced(state(0, 0)));
  finish(render(1, 1));
  EXPECT_FALSE(farm.scheduler.is_referenced(state(0, 0)));
  EXPECT_TRUE(farm.scheduler.is_referenced(state(0, 1)));

  // The middle tile may not go on before its neighbours.
  EXPECT_FALSE(held.contains(render(2, 1)));
  finish(render(1, 2));
  EXPECT_TRUE(held.contains(render(2, 1)));
  EXPECT_FALSE(farm.scheduler.is_referenced(state(0, 1)));

  // The last states are kept.
  while (!held.empty()) finish(held.begin()->first);
  EXPECT_EQ(farm.status(), JobStatus::done);
  for (int tile = 0; tile < 3; ++tile) {
    EXPECT_FALSE(farm.scheduler.is_referenced(state(1, tile)));
    EXPECT_TRUE(farm.scheduler.is_referenced(state(2, tile)));
  }
}

TEST_F(SchedulerTest, APausedJobFinishesWhatIsLeasedAndGrantsNoMore) {
  const GrantLease held = farm.ask_one("a");
  const auto paused = all_of<RecordJobStatus>(farm.step(JobPaused{farm.job}));
  ASSERT_THAT(paused, SizeIs(1));
  EXPECT_EQ(paused[0].status, JobStatus::paused);
  EXPECT_THAT(farm.step(JobPaused{farm.job}), IsEmpty()) << "it is paused already";

  // The report counts, but nobody gets what follows from it.
  EXPECT_THAT(all_of<RecordCompletion>(farm.finish(held)), SizeIs(1));
  EXPECT_THAT(farm.ask("b", 2), IsEmpty());

  // Whoever has asked meanwhile gets work at once.
  const auto resumed = farm.step(JobResumed{farm.job});
  EXPECT_EQ(all_of<RecordJobStatus>(resumed)[0].status, JobStatus::running);
  EXPECT_THAT(all_of<GrantLease>(resumed), SizeIs(2));
  farm.work_off("b");
  EXPECT_THAT(farm.step(JobPaused{Digest{}}), IsEmpty()) << "no such job";
}

TEST_F(SchedulerTest, APausedJobStaysPausedThroughARestartAndCanBeCancelled) {
  const GrantLease held = farm.ask_one("a");
  Farm again(farm.spec(), /*epoch=*/2);
  again.step(JobAdded{farm.job, farm.spec(), JobStatus::paused, {}, {}});
  again.step(WorkerJoined{"a", {held.lease}});
  EXPECT_EQ(again.progress().tasks_leased, 1u) << "the lease of the first life is adopted";
  EXPECT_THAT(again.ask("a", 2), IsEmpty());
  const auto cancelled = again.step(JobCancelled{farm.job});
  EXPECT_THAT(all_of<RevokeLease>(cancelled), SizeIs(1));
  EXPECT_EQ(again.status(), JobStatus::cancelled);
  EXPECT_THAT(again.step(JobResumed{farm.job}), IsEmpty()) << "it has ended";
}

TEST_F(SchedulerTest, ARestartedCoordinatorTakesUpWhereTheJournalEnds) {
  const auto held = farm.ask("a", 2);
  const auto recorded = all_of<RecordCompletion>(farm.finish(held[0]));

  Farm again(farm.spec(), /*epoch=*/2);
  again.step(JobAdded{
      farm.job, farm.spec(), JobStatus::running, completions_of({recorded[0].completion}), {}});
  EXPECT_EQ(again.progress().tasks_done, 1u);

  // The lease of the first life is adopted, its report counts, and others get the rest.
  EXPECT_THAT(all_of<RevokeLease>(again.step(WorkerJoined{"a", {held[0].lease, held[1].lease}})),
              SizeIs(1))
      << "done is revoked";
  again.step(WorkerJoined{"b", {}});
  EXPECT_THAT(tasks_of(again.ask("b", 10)), ElementsAre(render(1, 0)));
  EXPECT_THAT(all_of<RecordCompletion>(again.finish(held[1])), SizeIs(1));
}

TEST_F(SchedulerTest, AnOldLeaseIsRevokedWhenTheTaskHasAnotherHolder) {
  const GrantLease old = farm.ask_one("a");
  Farm again(farm.spec(), /*epoch=*/2);
  again.submit();
  again.step(WorkerJoined{"b", {}});
  const GrantLease current = again.ask_one("b");
  ASSERT_EQ(current.lease.task, old.lease.task);
  const auto revoked = all_of<RevokeLease>(again.step(WorkerJoined{"a", {old.lease}}));
  ASSERT_THAT(revoked, SizeIs(1));
  EXPECT_EQ(revoked[0].lease, old.lease);
}

TEST_F(SchedulerTest, AFailureThatWasRecordedIsNotCountedAgainAfterARestart) {
  const GrantLease grant = farm.ask_one("a");
  const auto recorded = all_of<RecordFailure>(farm.fail(grant));
  Farm again(farm.spec(), /*epoch=*/2);
  JobAdded added{.job = farm.job, .spec = farm.spec(), .completions = {}, .failures = {}};
  added.failures.push_back(recorded[0].failure);
  again.step(added);
  again.step(WorkerJoined{"a", {grant.lease}});
  EXPECT_THAT(again.fail(grant), IsEmpty());
  EXPECT_EQ(again.progress().attempts_lost, 1u);
}

TEST_F(SchedulerTest, ACancelledJobThatIsSubmittedAgainKeepsWhatIsDone) {
  const auto recorded = all_of<RecordCompletion>(farm.finish(farm.ask_one("a")));
  farm.step(JobCancelled{farm.job});
  const auto actions = farm.step(JobAdded{
      farm.job, farm.spec(), JobStatus::running, completions_of({recorded[0].completion}), {}});
  EXPECT_THAT(all_of<RemoveBlobs>(actions), IsEmpty());
  EXPECT_EQ(farm.progress().tasks_done, 1u);
  EXPECT_THAT(tasks_of(farm.ask("a", 10)), ElementsAre(render(0, 1), render(1, 0)));
}

TEST_F(SchedulerTest, AJobThatStartsAfreshLetsGoOfItsBlobs) {
  farm.finish(farm.ask_one("a"));
  farm.step(JobCancelled{farm.job});
  EXPECT_THAT(all_of<RemoveBlobs>(farm.submit())[0].blobs, SizeIs(3));
  EXPECT_EQ(farm.progress().tasks_done, 0u);
}

TEST(SchedulerLifetime, AHundredThousandTasksAreNoTrouble) {
  Farm farm(small_job(1000, 300, 3));
  ASSERT_GT(JobGraph(farm.spec()).num_tasks(), 100000);
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  farm.work_off("a");
  EXPECT_EQ(farm.status(), JobStatus::done);
}

// The scheduler sees no file: it asks, and the answer ends the job, or opens it again.
TEST_F(SchedulerTest, AJobIsDoneWhenItsFramesHaveBeenInspected) {
  Scheduler& scheduler = farm.scheduler;
  const auto step = [&](const Event& event) { return scheduler.step(event, farm.now); };
  // Finishes what these actions grant, then what there is besides.
  const auto finish_all = [&](std::vector<Action> actions) {
    std::size_t num_asked = 0;
    for (int i = 0; i < 100; ++i) {
      std::vector<GrantLease> grants = all_of<GrantLease>(actions);
      if (grants.empty()) grants = all_of<GrantLease>(step(WorkRequested{"a", 1}));
      if (grants.empty()) break;
      const LeaseId& lease = grants[0].lease;
      actions = step(TaskCompleted{"a", lease, {outputs_of(farm.spec(), farm.job, lease.task)}});
      num_asked += all_of<InspectFrames>(actions).size();
    }
    return num_asked;
  };
  EXPECT_EQ(finish_all({}), 1u);
  EXPECT_EQ(farm.status(), JobStatus::running);

  // A frame is gone: its films are, too.
  const std::vector<Action> reopened = step(FramesInspected{farm.job, {assemble(1)}, {}});
  ASSERT_THAT(all_of<RecordReopened>(reopened), SizeIs(1));
  EXPECT_EQ(farm.progress().frames_done, 3u);
  EXPECT_THAT(step(FramesInspected{farm.job}), IsEmpty()) << "an answer that is late";
  EXPECT_EQ(finish_all(reopened), 1u);
  EXPECT_EQ(farm.status(), JobStatus::running);

  // Paused meanwhile, it asks again when it goes on.
  step(JobPaused{farm.job, "a folder"});
  EXPECT_EQ(waits_for(scheduler, farm.job, farm.now), "a folder");
  EXPECT_THAT(step(FramesInspected{farm.job}), IsEmpty());
  EXPECT_THAT(all_of<InspectFrames>(step(JobResumed{farm.job})), SizeIs(1));
  EXPECT_EQ(waits_for(scheduler, farm.job, farm.now), "");
  const auto ends = all_of<RecordJobStatus>(step(FramesInspected{farm.job}));
  ASSERT_THAT(ends, SizeIs(1));
  EXPECT_EQ(ends[0].status, JobStatus::done);
}

TEST_F(SchedulerTest, AJobWithFramesOfOthersFails) {
  Scheduler strict({.epoch = 1, .silence_limit = kSilence});
  JobAdded all{farm.job, farm.spec(), JobStatus::running, {}, {}};
  const JobGraph graph(farm.spec());
  for (TaskIndex task = 0; task < graph.num_tasks(); ++task)
    all.completions.add({graph.key(task), {outputs_of(farm.spec(), farm.job, graph.key(task))}});
  EXPECT_THAT(all_of<InspectFrames>(strict.step(all, farm.now)), SizeIs(1));
  const auto ends =
      all_of<RecordJobStatus>(strict.step(FramesInspected{farm.job, {}, "a frame"}, farm.now));
  ASSERT_THAT(ends, SizeIs(1));
  EXPECT_EQ(ends[0].status, JobStatus::failed);
  EXPECT_EQ(waits_for(strict, farm.job, farm.now), "a frame");
}

// Somebody who takes frames away as they come is told, and not served for ever.
TEST_F(SchedulerTest, AFrameThatIsLostTooOftenPausesItsJob) {
  Farm own(small_job(1, 1, 1, false));
  own.step(WorkerJoined{"a", {}});
  int num_lost = 0;
  std::vector<Action> actions =
      own.scheduler.step(JobAdded{own.job, own.spec(), JobStatus::running, {}, {}}, own.now);
  for (; own.status() == JobStatus::running && num_lost < 100; ++num_lost) {
    for (int i = 0; i < 2; ++i) {
      const auto grants = all_of<GrantLease>(own.scheduler.step(WorkRequested{"a", 1}, own.now));
      ASSERT_THAT(grants, SizeIs(1));
      own.scheduler.step(
          TaskCompleted{
              "a", grants[0].lease, {outputs_of(own.spec(), own.job, grants[0].lease.task)}},
          own.now);
    }
    own.scheduler.step(FramesInspected{own.job, {assemble(0)}, {}}, own.now);
  }
  EXPECT_EQ(own.status(), JobStatus::paused);
  EXPECT_EQ(num_lost, limits::kMaxTaskLosses);
  EXPECT_THAT(waits_for(own.scheduler, own.job, own.now), testing::HasSubstr("lost 16 times"));
}

// ---- frames that others have written ------------------------------------------------------------

/// One tile, one frame; the assembly is granted to "a".
struct PlaceTest : testing::Test {
  Farm own{small_job(1, 1, 1, false)};
  GrantLease frame;

  void SetUp() override {
    own.submit();
    own.step(WorkerJoined{"a", {}});
    own.step(WorkerJoined{"b", {}});
    own.finish(own.ask_one("a"));
    frame = own.ask_one("a");
    ASSERT_EQ(frame.lease.task, assemble(0));
  }
};

// Its worker was silent while it was locked, and says too late what it has written.
TEST_F(PlaceTest, ALateReportOfALockedFrameIsNoConflict) {
  own.now += 2 * kSilence;
  own.step(WorkerAlive{"b", {}});
  own.step(ClockTicked{});
  ASSERT_EQ(own.progress().attempts_lost, 1u);
  own.scheduler.step(FramesLocked{own.job, {FrameIndex(0)}}, own.now);
  own.scheduler.step(WorkerJoined{"a", {frame.lease}}, own.now);
  const auto actions = own.scheduler.step(
      TaskCompleted{"a", frame.lease, {outputs_of(own.spec(), own.job, assemble(0))}}, own.now);
  EXPECT_THAT(all_of<ReportConflict>(actions), IsEmpty());
  EXPECT_EQ(own.status(), JobStatus::running);
}

TEST_F(PlaceTest, APictureThatStaysCountsAsTheFrame) {
  const auto actions = own.scheduler.step(PlaceTaken{"a", frame.lease}, own.now);
  const auto recorded = all_of<RecordCompletion>(actions);
  ASSERT_THAT(recorded, SizeIs(1));
  EXPECT_TRUE(recorded[0].completion.made.outputs.at(0).is_any_image());
  ASSERT_THAT(all_of<TellLeaseEnd>(actions), SizeIs(1));
  EXPECT_EQ(all_of<TellLeaseEnd>(actions)[0].end, LeaseEnd::returned);
  EXPECT_THAT(all_of<InspectFrames>(actions), SizeIs(1)) << "the end tells of it";
  EXPECT_THAT(own.scheduler.step(PlaceTaken{"b", frame.lease}, own.now), IsEmpty()) << "late";
}

TEST_F(PlaceTest, OneThatMayGoIsNobodysFailure) {
  EXPECT_THAT(all_of<RecordCompletion>(own.step(PlaceTaken{"a", frame.lease, false})), IsEmpty());
  const GrantLease again = own.ask_one("b");
  EXPECT_EQ(again.lease.task, assemble(0));
  own.finish(again);
  EXPECT_EQ(own.status(), JobStatus::done);
  EXPECT_EQ(own.progress().attempts_lost, 0u);
}

}  // namespace
}  // namespace baton
