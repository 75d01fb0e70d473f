#include "jobs/slurm/pilots.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

SlurmPilot pilot(const std::string& id, SlurmState state, double alone_s = 0) {
  return {id, state, alone_s};
}

SlurmWorker worker(const std::string& id, int leases = 1) { return {id, "slurm-" + id, leases}; }

SlurmSnapshot snapshot(std::uint64_t tasks) {
  return {
      .pilots = {}, .workers = {}, .tasks = tasks, .threads_per_pilot = 4, .least = 1, .most = 3};
}

TEST(SlurmPilots, FollowTheWorkWithinTheirLimits) {
  const auto wanted = [](std::uint64_t tasks) { return wanted_pilots(snapshot(tasks)); };
  EXPECT_EQ(wanted(0), 1);
  EXPECT_EQ(wanted(4), 1);
  EXPECT_EQ(wanted(5), 2);
  EXPECT_EQ(wanted(12), 3);
  EXPECT_EQ(wanted(~std::uint64_t{0} - 10), 3);
}

TEST(SlurmPilots, ThoseThatWaitOrWorkAreNotSubmittedAgain) {
  SlurmSnapshot now = snapshot(100);
  EXPECT_EQ(give_orders(now), (SlurmOrders{3, {}, {}}));
  now.pilots = {pilot("1_1", SlurmState::waiting), pilot("1_2", SlurmState::running, 10)};
  EXPECT_EQ(give_orders(now), (SlurmOrders{1, {}, {}}));
  now.workers = {worker("1_2")};
  EXPECT_EQ(give_orders(now), (SlurmOrders{1, {}, {}}));
}

// A controller that was killed has forgotten the array; its tasks run on.
TEST(SlurmPilots, WhomTheCoordinatorSeesIsThere) {
  SlurmSnapshot now = snapshot(100);
  now.workers = {worker("1_1"), worker("1_2"), worker("1_3")};
  EXPECT_EQ(give_orders(now), SlurmOrders{});
  now.workers.pop_back();
  EXPECT_EQ(give_orders(now), (SlurmOrders{1, {}, {}}));
}

TEST(SlurmPilots, OnesThatNobodyHearsAreReplaced) {
  SlurmSnapshot now = snapshot(100);
  now.pilots = {pilot("1_1", SlurmState::running, kMostAlone_s + 1),
                pilot("1_2", SlurmState::resting), pilot("1_3", SlurmState::suspended),
                pilot("1_4", SlurmState::ending)};
  EXPECT_EQ(give_orders(now), (SlurmOrders{3, {"1_1", "1_2"}, {}}));
}

TEST(SlurmPilots, WhoWaitsGoesFirstThenWhoHoldsLeast) {
  SlurmSnapshot now = snapshot(4);
  now.pilots = {pilot("1_1", SlurmState::running), pilot("1_2", SlurmState::running),
                pilot("1_3", SlurmState::waiting)};
  now.workers = {worker("1_1", 5), worker("1_2", 0)};
  EXPECT_EQ(give_orders(now), (SlurmOrders{0, {"1_3"}, {"slurm-1_2"}}));
  // One that was told to end is on its way, and nobody is told in its place.
  now.workers[1].told_to_end = true;
  now.pilots.pop_back();
  EXPECT_EQ(give_orders(now), SlurmOrders{});
}

// Slurm has ended it and started it again before the coordinator missed its first worker.
TEST(SlurmPilots, AreNotTooManyWhenOneHasTwoWorkers) {
  SlurmSnapshot now = snapshot(100);
  now.workers = {worker("1_1", 3), worker("1_2", 2), worker("1_3", 3)};
  now.workers.push_back({"1_1", "slurm-1_1#6203e0e8", 0});
  EXPECT_EQ(give_orders(now), SlurmOrders{});
  now.most = 2;
  EXPECT_EQ(give_orders(now), (SlurmOrders{0, {}, {"slurm-1_2"}}));
  now.most = 1;
  EXPECT_EQ(give_orders(now),
            (SlurmOrders{0, {}, {"slurm-1_2", "slurm-1_1", "slurm-1_1#6203e0e8"}}));
}

TEST(SlurmPilots, TheLeastStay) {
  SlurmSnapshot now = snapshot(0);
  now.workers = {worker("1_1", 0), worker("1_2", 0)};
  now.least = 2;
  EXPECT_EQ(give_orders(now), SlurmOrders{});
}

// One in vain may be an array that a controller has forgotten; a pilot that comes ends the row.
TEST(SlurmPilots, ArraysInARowWithoutAWorkerAreCounted) {
  VainArrays vain;
  SlurmSnapshot now = snapshot(100);
  EXPECT_FALSE(vain.observe(now));
  vain.submitted("1");
  now.pilots = {pilot("1_1", SlurmState::ending), pilot("1_2", SlurmState::running, 1)};
  EXPECT_FALSE(vain.observe(now));
  now.pilots.pop_back();
  now.workers = {worker("11_1")};
  EXPECT_TRUE(vain.observe(now));
  EXPECT_FALSE(vain.observe(now));
  EXPECT_EQ(vain.count(), 1);
  EXPECT_EQ(vain.last(), "1");

  vain.submitted("2");
  now.pilots = {pilot("2_1", SlurmState::running, kMostAlone_s + 1)};
  EXPECT_TRUE(vain.observe(now));
  EXPECT_EQ(vain.count(), 2);

  // Nobody knows what would have become of one that was too many.
  vain.submitted("3");
  now.pilots = {pilot("3_1", SlurmState::waiting)};
  vain.cancelled({"3_1"});
  EXPECT_FALSE(vain.observe(snapshot(100)));
  EXPECT_EQ(vain.count(), 2);

  vain.submitted("4");
  now.workers = {worker("4_2")};
  EXPECT_FALSE(vain.observe(now));
  EXPECT_EQ(vain.count(), 0);
}

}  // namespace
}  // namespace baton
