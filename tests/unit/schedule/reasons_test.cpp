#include "coordinator/schedule/reasons.h"

#include <gmock/gmock.h>

#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<ReasonKind> kinds(const std::vector<Cause>& chain) {
  std::vector<ReasonKind> kinds;
  for (const Cause& cause : chain) kinds.push_back(cause.kind);
  return kinds;
}

struct ReasonsFarm : Farm {
  explicit ReasonsFarm(JobSpec spec, std::uint64_t limit = 0) : Farm(std::move(spec), 1, limit) {
    submit();
  }
  std::vector<Cause> why(std::set<std::string> draining = {}) const {
    return Reasons(scheduler, now, {std::move(draining)}).of_job(job);
  }
  std::vector<Cause> why_task(const TaskKey& key) const {
    return Reasons(scheduler, now).of_task(job, *scheduler.find_job(job)->tasks.graph().find(key));
  }
  std::vector<Cause> why_worker(const std::string& worker) const {
    return Reasons(scheduler, now).of_worker(worker);
  }
};

TEST(Reasons, AFrameWaitsForATileThatWaitsForAStateThatAWorkerMakes) {
  ReasonsFarm farm(moving_job(2, 8, 8));
  farm.step(WorkerJoined{"node3", {}});
  const GrantLease done = farm.ask_one("node3");
  farm.finish(done);
  const GrantLease in_hand = farm.ask_one("node3");
  farm.now += 41s;
  const TaskKey open = assemble(1);
  const std::vector<Cause> chain = farm.why_task(open);
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::input, ReasonKind::running));
  EXPECT_EQ(chain[0].task, open);
  EXPECT_EQ(chain[0].awaited, chain[1].task);
  EXPECT_EQ(chain[1].awaited, in_hand.lease.task);
  EXPECT_EQ(chain[2].task, in_hand.lease.task);
  EXPECT_THAT(chain[2].workers, ElementsAre("node3"));
  EXPECT_EQ(farm.now - *chain[2].since, 41s);
}

TEST(Reasons, WhoSaysNothingIsTheCause) {
  ReasonsFarm farm(small_job(1, 2, 1));
  farm.step(WorkerJoined{"a", {}});
  const TaskKey task = farm.ask_one("a").lease.task;
  const TaskIndex index = *farm.scheduler.find_job(farm.job)->tasks.graph().find(task);
  const auto why = [&](std::chrono::seconds after) {
    const Reasons reasons(farm.scheduler, farm.now + after, {.silent_after = 2s});
    EXPECT_EQ(kinds(reasons.of_worker("a")), kinds(reasons.of_task(farm.job, index)));
    return reasons.of_worker("a");
  };
  EXPECT_THAT(kinds(why(1s)), ElementsAre(ReasonKind::running));
  const std::vector<Cause> chain = why(3s);
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::running, ReasonKind::silent));
  EXPECT_THAT(chain[1].workers, ElementsAre("a"));
  EXPECT_EQ(*chain[1].since, farm.now);
}

TEST(Reasons, ASilentIdleWorkerIsNotFree) {
  ReasonsFarm farm(small_job(1, 2, 1));
  farm.step(WorkerJoined{"a", {}});
  const Reasons reasons(farm.scheduler, farm.now + 3s, {.silent_after = 2s});
  EXPECT_THAT(kinds(reasons.of_job(farm.job)), ElementsAre(ReasonKind::input, ReasonKind::silent));
  EXPECT_THAT(kinds(reasons.of_worker("a")), ElementsAre(ReasonKind::silent));
}

TEST(Reasons, AnIdleWorkerNamesThePausedJobs) {
  ReasonsFarm farm(small_job(1, 2, 1));
  farm.step(WorkerJoined{"a", {}});
  farm.step(JobPaused{farm.job});
  const std::vector<Cause> chain = farm.why_worker("a");
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::no_job));
  EXPECT_THAT(chain[0].jobs, ElementsAre(farm.job));
}

TEST(Reasons, NobodyIsConnected) {
  ReasonsFarm farm(small_job(1, 2, 1));
  EXPECT_THAT(kinds(farm.why()), ElementsAre(ReasonKind::input, ReasonKind::no_worker));
  EXPECT_THAT(kinds(farm.why_worker("a")), ElementsAre(ReasonKind::gone));
  farm.step(WorkerJoined{"a", {}});
  EXPECT_THAT(kinds(farm.why()), ElementsAre(ReasonKind::input, ReasonKind::asking));
  EXPECT_THAT(kinds(farm.why_worker("a")), ElementsAre(ReasonKind::asking));
  EXPECT_THAT(farm.ask("a", 1), SizeIs(1)) << "it asks";
}

TEST(Reasons, AJobOfHigherPriorityHasAllWorkers) {
  ReasonsFarm farm(small_job(1, 2, 1));
  JobSpec urgent = small_job(2, 4, 1);
  urgent.priority = 80;
  const Digest other = digest_of("urgent");
  farm.step(JobAdded{other, urgent, JobStatus::running, {}, {}});
  farm.step(WorkerJoined{"a", {}});
  farm.ask("a", 1);
  std::vector<Cause> chain = farm.why();
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::busy, ReasonKind::running));
  EXPECT_THAT(chain[1].workers, ElementsAre("a"));
  EXPECT_THAT(chain[1].jobs, ElementsAre(other));
  EXPECT_EQ(chain[2].job, other);

  // Its place in the queue changes, and what is ready next is this job's.
  farm.step(PriorityChanged{farm.job, 90});
  EXPECT_THAT(farm.scheduler.in_turn(), ElementsAre(farm.job, other));
  EXPECT_EQ(farm.ask_one("a").lease.job, farm.job);
  EXPECT_EQ(farm.scheduler.find_job(farm.job)->spec.priority, 90);
  farm.step(JobPaused{farm.job});
  farm.step(PriorityChanged{farm.job, 10});
  EXPECT_THAT(farm.scheduler.in_turn(), ElementsAre(other)) << "a paused job has no place";
  EXPECT_THAT(kinds(farm.why()), ElementsAre(ReasonKind::paused));
  farm.step(JobResumed{farm.job});
  EXPECT_THAT(farm.scheduler.in_turn(), ElementsAre(other, farm.job));
}

TEST(Reasons, ABlindWorkerIsNamedWhileItIsThere) {
  ReasonsFarm farm(small_job(2, 2, 1));
  farm.step(WorkerJoined{"x", {}});
  farm.step(LeaseReturned{"x", farm.ask_one("x").lease, "/shows"});
  std::vector<Cause> chain = farm.why();
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::blind));
  EXPECT_THAT(chain[1].workers, ElementsAre("x"));
  EXPECT_EQ(chain[1].text, "/shows");
  EXPECT_THAT(kinds(farm.why_worker("x")), ElementsAre(ReasonKind::blind));

  // With another worker it is one that is left out.
  farm.step(WorkerJoined{"y", {}});
  farm.ask("y", 1);
  chain = farm.why_task(render(0, 1));
  ASSERT_THAT(kinds(chain),
              ElementsAre(ReasonKind::left_out, ReasonKind::busy, ReasonKind::running));
  EXPECT_EQ(chain[0].text, "does not see /shows");

  farm.step(WorkerLeft{"x"});
  farm.step(LeaseReturned{"y", farm.ask_one("y").lease, "/films"});
  EXPECT_EQ(waits_for(farm.scheduler, farm.job, farm.now), "a worker that sees /films");
  farm.step(WorkerLeft{"y"});
  EXPECT_EQ(waits_for(farm.scheduler, farm.job, farm.now), "") << "nobody is there to be blamed";
  EXPECT_THAT(kinds(farm.why()), ElementsAre(ReasonKind::input, ReasonKind::no_worker));
}

TEST(Reasons, TheStoreHasNoRoom) {
  ReasonsFarm farm(small_job(2, 8, 2), 70);
  farm.step(WorkerJoined{"a", {}});
  farm.finish(farm.ask_one("a"));
  EXPECT_THAT(farm.ask("a", 1), IsEmpty());
  const std::vector<Cause> chain = farm.why();
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::store));
  EXPECT_EQ(chain[1].need_bytes, 40u);
  EXPECT_EQ(chain[1].free_bytes, 30u);
  EXPECT_THAT(kinds(farm.why_worker("a")), ElementsAre(ReasonKind::store));
}

TEST(Reasons, WorkersRenderOtherwiseHaveFailedOrAreDraining) {
  ReasonsFarm farm(small_job(1, 2, 1));
  farm.step(WorkerJoined{"a", {}, "AVX2"});
  farm.finish(farm.ask_one("a"));
  EXPECT_THAT(kinds(farm.why({"a"})), ElementsAre(ReasonKind::draining));
  farm.step(WorkerJoined{"b", {}, "SSE4"});
  farm.step(WorkerLeft{"a"});
  std::vector<Cause> chain = farm.why();
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::renderer));
  EXPECT_EQ(chain[0].text, "AVX2");
  EXPECT_THAT(chain[0].workers, ElementsAre("b"));

  farm.step(WorkerLeft{"b"});
  farm.step(WorkerJoined{"c", {}, "AVX2"});
  farm.step(WorkerJoined{"d", {}, "AVX2"});
  farm.fail(farm.ask_one("c"), /*permanent=*/true);
  farm.step(WorkerLeft{"d"});
  chain = farm.why();
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::tried));
  EXPECT_THAT(chain[0].workers, ElementsAre("c"));
  EXPECT_EQ(chain[0].count, 1u);
  EXPECT_FALSE(chain[0].text.empty()) << "what it said";
}

// Each worker is told of for what it did itself.
TEST(Reasons, WhoDoesNotSeeAJobHasNotFailedIt) {
  ReasonsFarm farm(small_job(1, 2, 1));
  farm.step(WorkerJoined{"a", {}});
  farm.step(WorkerJoined{"b", {}});
  farm.step(LeaseReturned{"b", farm.ask_one("b").lease, "/shows"});
  farm.fail(farm.ask_one("a"), /*permanent=*/true);
  const std::vector<Cause> chain = farm.why_task(render(0, 0));
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::left_out, ReasonKind::tried));
  EXPECT_THAT(chain[0].workers, ElementsAre("b"));
  EXPECT_EQ(chain[0].text, "does not see /shows");
  EXPECT_THAT(chain[1].workers, ElementsAre("a"));
  EXPECT_EQ(chain[1].text, "boom");
}

TEST(Reasons, WhoHasFailedATaskIsNamedBesideWhoMayTryIt) {
  ReasonsFarm farm(small_job(2, 4, 1));
  farm.step(WorkerJoined{"a", {}});
  farm.step(WorkerJoined{"b", {}});
  const GrantLease failed = farm.ask_one("a");
  farm.fail(failed);
  const std::vector<Cause> chain = farm.why_task(failed.lease.task);
  ASSERT_FALSE(chain.empty());
  const auto told = std::ranges::find(chain, ReasonKind::left_out, &Cause::kind);
  ASSERT_NE(told, chain.end());
  EXPECT_THAT(told->workers, ElementsAre("a"));
  EXPECT_EQ(told->count, 1u);
  EXPECT_EQ(told->text, "boom");
}

// A film takes 10 bytes and a state 20; of the other job only the estimate is known.
TEST(Reasons, APausedJobThatHoldsRoomIsTheLastCause) {
  ReasonsFarm farm(small_job(2, 4, 2), 1000);
  farm.step(WorkerJoined{"a", {}});
  farm.finish(farm.ask_one("a"));
  farm.step(JobPaused{farm.job});
  const Digest other = digest_of("other");
  farm.step(JobAdded{other, small_job(6, 4, 2), JobStatus::running, {}, {}});
  farm.step(WorkRequested{"a", 1});
  const std::vector<Cause> chain = Reasons(farm.scheduler, farm.now).of_job(other);
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::store, ReasonKind::paused));
  EXPECT_EQ(chain[1].room, Room::beside);
  EXPECT_THAT(chain[1].jobs, ElementsAre(farm.job));
  EXPECT_EQ(chain[2].job, farm.job);
  EXPECT_THAT(chain[2].jobs, ElementsAre(farm.job)) << "which is not the one that waits";
}

// A thread that comes free would not help it.
TEST(Reasons, WhoWaitsForTheStoreIsNotToldThatAllAreBusy) {
  ReasonsFarm farm(small_job(2, 4, 2), 1000);
  farm.step(WorkerJoined{"a", {}});
  farm.finish(farm.ask_one("a"));
  farm.ask_one("a");
  const Digest other = digest_of("other");
  JobSpec first = small_job(6, 4, 2);
  first.priority = 99;
  farm.step(JobAdded{other, first, JobStatus::running, {}, {}});
  const std::vector<Cause> chain = Reasons(farm.scheduler, farm.now).of_job(other);
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::store));
  EXPECT_EQ(chain[1].room, Room::beside);
  EXPECT_THAT(chain[1].jobs, ElementsAre(farm.job));
}

TEST(Reasons, FramesFarAheadComeLater) {
  JobSpec spec = small_job(1, 4000, 1, /*carry=*/false);
  spec.image = {.width = 4096, .height = 4096, .sites = 1, .tile_size = 4096};
  ReasonsFarm farm(spec);
  farm.step(WorkerJoined{"a", {}});
  farm.ask("a", 1);
  const std::vector<Cause> chain = farm.why_task(assemble(3999));
  ASSERT_THAT(kinds(chain), ElementsAre(ReasonKind::input, ReasonKind::order, ReasonKind::running));
  EXPECT_EQ(chain[1].awaited, render(0, 0));
}

TEST(Reasons, ALongChainIsToldWithoutItsMiddle) {
  ReasonsFarm farm(small_job(1, 100, 1));
  farm.step(WorkerJoined{"a", {}});
  farm.ask("a", 1);
  const std::vector<Cause> chain = farm.why_task(assemble(99));
  ASSERT_THAT(chain, SizeIs(8));
  EXPECT_EQ(chain[4].kind, ReasonKind::skipped);
  EXPECT_EQ(chain[4].count, 94u);  // of 101
  EXPECT_EQ(chain.back().kind, ReasonKind::running);
}

}  // namespace
}  // namespace baton
