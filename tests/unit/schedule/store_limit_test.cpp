#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

/// What is rendered where the store has a limit. In these tests a film takes 10 bytes, a state 20,
/// the samples of a first pass 30.
namespace baton {
namespace {

using namespace testing_farm;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// 2 tiles, `frames` frames in runs of two: a run makes 2 x (20 + 2 x 10) = 80 bytes.
struct LimitedFarm : Farm {
  explicit LimitedFarm(std::uint64_t limit, int frames = 8)
      : Farm(small_job(2, frames, 2), 1, limit) {
    submit();
    step(WorkerJoined{"a", {}});
    step(WorkerJoined{"b", {}});
  }
  std::string waits() const { return waits_for(scheduler, job, now); }
};

TEST(StoreLimit, OneTaskTellsHowLargeItsBlobsAre) {
  LimitedFarm farm(1000);
  const auto first = farm.ask("a", 4);
  EXPECT_THAT(tasks_of(first), ElementsAre(render(0, 0))) << "by the estimate it takes all";
  EXPECT_THAT(farm.ask("b", 1), IsEmpty());
  EXPECT_EQ(farm.waits(), "");
  EXPECT_THAT(tasks_of(all_of<GrantLease>(farm.finish(first[0]))),
              ElementsAre(render(0, 1), render(1, 0)));
}

TEST(StoreLimit, ARunIsBegunWhenThereIsRoomForAllOfIt) {
  LimitedFarm farm(150);
  farm.finish(farm.ask_one("a"));
  EXPECT_EQ(farm.scheduler.store_bytes(), 40u);
  const auto grants = farm.ask("a", 4);
  EXPECT_THAT(tasks_of(grants), ElementsAre(render(0, 1))) << "160 bytes with all of run 1";
  // A frame that is written gives back 20.
  const auto assembly = all_of<GrantLease>(farm.finish(grants[0]));
  EXPECT_THAT(tasks_of(assembly), ElementsAre(assemble(0), assemble(1)));
  EXPECT_THAT(tasks_of(all_of<GrantLease>(farm.finish(assembly[0]))), ElementsAre(render(1, 0)));
}

TEST(StoreLimit, NeverIsMoreInTheStoreThanItAllowsAndTheJobEnds) {
  for (const std::uint64_t limit : {140u, 180u, 300u, 1000u}) {
    SCOPED_TRACE(limit);
    LimitedFarm farm(limit, 20);
    std::vector<GrantLease> grants = farm.ask("a", 10);
    while (!grants.empty()) {
      std::vector<GrantLease> next;
      for (const GrantLease& grant : grants) {
        for (const auto& more : {farm.finish(grant), farm.step(WorkRequested{"a", 10})}) {
          for (GrantLease& granted : all_of<GrantLease>(more)) next.push_back(std::move(granted));
        }
        EXPECT_LE(farm.scheduler.store_bytes(), limit);
        EXPECT_EQ(farm.waits(), "");
      }
      grants = std::move(next);
    }
    EXPECT_EQ(farm.status(), JobStatus::done);
  }
}

TEST(StoreLimit, AJobThatCannotGoOnSaysWhy) {
  LimitedFarm farm(70);
  farm.finish(farm.ask_one("a"));
  EXPECT_THAT(farm.ask("a", 1), IsEmpty());
  EXPECT_TRUE(lacks_room(farm.scheduler, farm.job));
  EXPECT_EQ(
      farm.waits(),
      "room in the store: it holds 40 B of the 70 B that --store-limit allows, 0 B of them of "
      "jobs that have ended and the rest of this one, and its next frames need about 40 B: raise "
      "the limit");
  // It waits for nothing else while frames can still be written.
  LimitedFarm other(1000);
  for (int i = 0; i < 2; ++i) other.finish(other.ask_one("a"));
  other.step(StoreKeeps{1000});
  EXPECT_FALSE(lacks_room(other.scheduler, other.job));
}

TEST(StoreLimit, AJobGoesOnWhenAnotherIsDeleted) {
  LimitedFarm farm(900);
  farm.finish(farm.ask_one("a"));
  farm.step(StoreKeeps{950});
  EXPECT_THAT(farm.ask("a", 1), IsEmpty());
  EXPECT_THAT(farm.waits(), HasSubstr("holds 990 B of the 900 B that --store-limit allows, 950 B"));
  EXPECT_THAT(tasks_of(all_of<GrantLease>(farm.step(StoreKeeps{0}))), ElementsAre(render(0, 1)));
  EXPECT_EQ(farm.waits(), "");
}

TEST(StoreLimit, CountsWhatARestartFinds) {
  Farm farm(small_job(2, 8, 2), 1, 100);
  std::vector<Completion> done;
  for (int tile = 0; tile < 2; ++tile)
    done.push_back({render(0, tile), {outputs_of(farm.spec(), farm.job, render(0, tile))}});
  for (Completion& completion : done)
    std::sort(completion.made.outputs.begin(), completion.made.outputs.end());
  farm.step(JobAdded{farm.job, farm.spec(), JobStatus::running, completions_of(done), {}});
  farm.step(WorkerJoined{"a", {}});
  EXPECT_EQ(farm.scheduler.store_bytes(), 80u);
  EXPECT_THAT(tasks_of(farm.ask("a", 4)), ElementsAre(assemble(0), assemble(1)));
}

// For all that anybody can tell the urgent job does not fit: what is begun is finished first.
TEST(StoreLimit, AJobIsNotBegunBesideOthersWithWhichItCannotEnd) {
  LimitedFarm farm(1000);
  farm.finish(farm.ask_one("a"));
  const GrantLease last = farm.ask_one("a");
  ASSERT_EQ(last.lease.task, render(0, 1));
  JobSpec spec = small_job(6, 4, 2);
  spec.priority = farm.spec().priority + 1;
  const Digest urgent = digest_of("urgent");
  farm.step(JobAdded{urgent, spec, JobStatus::running, {}, {}});
  EXPECT_THAT(tasks_of(farm.ask("b", 4)), ElementsAre(render(1, 0)));
  EXPECT_EQ(RoomOfTasks(farm.scheduler, *farm.scheduler.find_job(urgent), Room::enough).most(),
            Room::beside);
  EXPECT_THAT(tasks_of(all_of<GrantLease>(farm.finish(last))),
              ElementsAre(assemble(0), assemble(1), render(1, 1)));
  farm.step(JobCancelled{farm.job});
  farm.step(JobForgotten{farm.job});
  const auto begun = farm.ask("a", 1);
  ASSERT_THAT(begun, SizeIs(1));
  EXPECT_EQ(begun[0].lease.job, urgent);
}

// States of two checkpoints take 80 bytes, the films of a sweep 160: those of the next one take
// their place.
TEST(StoreLimit, LaterSweepsNeedNoRoomForFilmsThatTheyReplace) {
  Farm farm(with_sweeps(small_job(2, 8, 2), 3, /*refinable=*/false), 1, 270);
  farm.submit();
  farm.step(WorkerJoined{"a", {}});
  farm.work_off("a");
  EXPECT_EQ(farm.status(), JobStatus::done) << waits_for(farm.scheduler, farm.job, farm.now);
}

// After its first frames it holds 40 bytes and needs 80 for the next ones.
TEST(StoreLimit, AJobThatCannotEndDoesNotKeepOthers) {
  LimitedFarm farm(100);
  for (int i = 0; i < 2; ++i) farm.finish(farm.ask_one("a"));
  farm.work_off("a");
  EXPECT_EQ(farm.scheduler.store_bytes(), 40u);
  EXPECT_TRUE(lacks_room(farm.scheduler, farm.job));
  const JobSpec small = small_job(1, 2, 2, /*carry=*/false);
  const Digest other = digest_of("other");
  std::vector<GrantLease> grants =
      all_of<GrantLease>(farm.step(JobAdded{other, small, JobStatus::running, {}, {}}));
  for (std::size_t i = 0; i < grants.size(); ++i) {
    const LeaseId lease = grants[i].lease;
    EXPECT_EQ(lease.job, other);
    for (GrantLease& more : all_of<GrantLease>(
             farm.step(TaskCompleted{"a", lease, {outputs_of(small, other, lease.task)}})))
      grants.push_back(std::move(more));
  }
  EXPECT_EQ(farm.scheduler.find_job(other)->status, JobStatus::done);
}

// With a second pass a run also needs room for the films that come after it.
TEST(StoreLimit, LeavesRoomForTheSecondPass) {
  JobSpec spec = small_job(2, 8, 2, false);
  spec.visibility.correlated = true;
  for (const std::uint64_t limit : {230u, 300u}) {
    Farm farm(spec, 1, limit);
    farm.submit();
    farm.step(WorkerJoined{"a", {}});
    const GrantLease first = farm.ask_one("a");
    std::vector<GrantLease> grants = all_of<GrantLease>(farm.finish(first));
    for (GrantLease& more : farm.ask("a", 10)) grants.push_back(std::move(more));
    for (std::size_t i = 0; i < grants.size(); ++i) {
      for (const auto& actions : {farm.finish(grants[i]), farm.step(WorkRequested{"a", 10})}) {
        for (GrantLease& more : all_of<GrantLease>(actions)) grants.push_back(std::move(more));
      }
      EXPECT_LE(farm.scheduler.store_bytes(), limit);
    }
    EXPECT_EQ(farm.status(), JobStatus::done) << limit;
  }
}

// A worker that has nothing to do does not make another one fill the store with what it holds.
TEST(StoreLimit, HeldStatesStayWhereTheyAreWhileTheStoreIsFull) {
  for (const std::uint64_t kept : {0u, 1000000u}) {
    Farm farm(moving_job(4, 8, 1), 1, 1000000);
    farm.submit();
    farm.step(WorkerJoined{"a", {}});
    std::vector<GrantLease> grants = farm.ask("a", 4);
    for (const GrantLease& grant : grants) {
      std::vector<BlobRef> made = outputs_of(farm.spec(), farm.job, grant.lease.task);
      EXPECT_TRUE(grant.may_hold);
      for (BlobRef& blob : made) {
        if (blob.kind != BlobKind::state) continue;
        blob.digest = held_state_name(farm.job, blob.step(), blob.tile);
        blob.size_bytes = 0;
      }
      farm.step(TaskCompleted{"a", grant.lease, {made}});
    }
    farm.step(StoreKeeps{kept});
    farm.finish(farm.ask_one("a"));  // the assembly
    farm.step(WorkerJoined{"b", {}});
    const auto asked = all_of<AskForStates>(farm.step(WorkRequested{"b", 4}));
    EXPECT_THAT(asked, SizeIs(kept == 0 ? 1 : 0));
  }
}

}  // namespace
}  // namespace baton
