#include "coordinator/schedule/tile_homes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/limits.h"
#include "common/job/plan/estimate.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;

/// A moving job of 6 x 6 tiles whose tiles need all around them.
JobSpec square_job(int frames) {
  JobSpec job = moving_job(6, frames, 4);
  job.image.height = job.image.width;
  return job;
}

constexpr auto kAny = [](TaskIndex) { return true; };

// ---- one choice ---------------------------------------------------------------------------------

class TileHomesTest : public testing::Test {
 protected:
  TileHomesTest() { homes.share_out({"a", "b"}); }
  /// The tile that one of "a" and "b" gets.
  std::int32_t choice(const std::string& worker, const std::set<TaskIndex>& ready) const {
    const std::optional<TaskIndex> task = homes.choose(graph, ready, baton::Run(9), worker, kAny);
    return task ? graph.key(*task).tile : -1;
  }
  std::set<TaskIndex> tiles(std::int32_t run, std::initializer_list<std::int32_t> which) const {
    std::set<TaskIndex> tasks;
    for (const std::int32_t tile : which) tasks.insert(*graph.find(render(run, tile)));
    return tasks;
  }

  JobSpec job = square_job(10);
  JobGraph graph{job};
  TileHomes homes{job};
};

TEST_F(TileHomesTest, TilesAreSharedOutInStrips) {
  EXPECT_EQ(choice("a", tiles(0, {3, 5, 32, 33, 35})), 32) << "columns 0 to 2 are a's";
  EXPECT_EQ(choice("b", tiles(0, {0, 2, 32, 33, 35})), 33);
}

// Whichever tile "b" takes from "a", it is at home in one more from then on, beside its strip.
TEST_F(TileHomesTest, WhoTakesATileHasALargerStrip) {
  homes.assign(0, "b");
  EXPECT_TRUE(homes.is_home(0, "a"));
  EXPECT_TRUE(homes.is_home(32, "b")) << "the last of column 2";
  EXPECT_TRUE(homes.is_home(26, "a"));
  homes.assign(35, "a");
  EXPECT_TRUE(homes.is_home(32, "a"));
  EXPECT_TRUE(homes.is_home(3, "b"));
}

TEST_F(TileHomesTest, StripsBetweenTheTwoMove) {
  homes.share_out({"a", "b", "c"});
  homes.assign(0, "c");
  EXPECT_TRUE(homes.is_home(31, "b")) << "a gave the last of column 1 to b";
  EXPECT_TRUE(homes.is_home(33, "c")) << "which gave the last of column 3 to c";
  homes.assign(35, "a");
  for (const auto& [tile, worker] : {std::pair{31, "a"}, {33, "b"}, {34, "c"}})
    EXPECT_TRUE(homes.is_home(tile, worker)) << tile;
}

TEST_F(TileHomesTest, WhoHasNothingToDoTakesTheTileNextToItsOwn) {
  EXPECT_EQ(choice("a", tiles(1, {5, 9, 35})), 9);
  EXPECT_EQ(choice("b", tiles(1, {0, 1, 14})), 14);
}

TEST_F(TileHomesTest, ItsOwnTileOneRunLaterComesFirst) {
  std::set<TaskIndex> ready = tiles(1, {9});
  ready.merge(tiles(2, {0}));
  EXPECT_EQ(choice("a", ready), 0);
  std::set<TaskIndex> much_later = tiles(1, {9});
  much_later.merge(tiles(3, {0}));
  EXPECT_EQ(choice("a", much_later), 9);
}

TEST_F(TileHomesTest, WhatAWorkerLeavesIsOfThoseBesideIt) {
  homes.share_out({"a", "gone", "b"});
  homes.leave("gone");
  EXPECT_TRUE(homes.is_home(2, "a"));
  EXPECT_TRUE(homes.is_home(3, "b"));
  homes.leave("a");
  EXPECT_TRUE(homes.is_home(0, "b"));
}

TEST_F(TileHomesTest, ATileIsSurroundedWhereAllThatReadItsStateAreAtHomeWithTheSameWorker) {
  EXPECT_TRUE(homes.surround(31, "a"));
  EXPECT_FALSE(homes.surround(32, "a")) << "column 3 is b's";
  EXPECT_FALSE(homes.surround(4, "a"));
  homes.assign(0, "b");
  EXPECT_FALSE(homes.surround(31, "a")) << "tile 32 is b's";
  EXPECT_FALSE(homes.surround(25, "a")) << "corner to corner";
  EXPECT_TRUE(homes.surround(19, "a"));
}

TEST_F(TileHomesTest, AssemblyComesBeforeAllTiles) {
  std::set<TaskIndex> ready = tiles(0, {0});
  ready.insert(*graph.find(assemble(0)));
  const auto task = homes.choose(graph, ready, baton::Run(9), "a", kAny);
  EXPECT_EQ(graph.key(*task), assemble(0));
}

// ---- a sequence ---------------------------------------------------------------------------------

/// What two workers with one thread each do with a sequence; `speed` of a over that of b.
struct Played {
  /// Until all is done; a tile takes b one hour.
  double hours = 0;
  /// Share of the states that whoever reads them has not made.
  double strange_inputs = 0;
  std::int32_t most_ahead = 0;  ///< frames begun and not written
};

Played play(const JobSpec& job, double speed) {
  Farm farm(job);
  farm.submit();
  const JobGraph graph(job);
  std::map<std::string, GrantLease> running;
  std::map<std::string, double> free_at{{"a", 0.0}, {"b", 0.0}};
  std::map<Digest, std::string> maker;
  Played played;
  std::size_t strange = 0, inputs = 0;
  for (const auto& [worker, time] : free_at) farm.step(WorkerJoined{worker, {}});
  const auto begin = [&](const std::vector<Action>& actions) {
    for (const GrantLease& grant : all_of<GrantLease>(actions)) {
      running[grant.worker] = grant;
      const bool renders = grant.lease.task.kind == TaskKind::render;
      free_at[grant.worker] =
          played.hours + (renders ? 1 / (grant.worker == "a" ? speed : 1) : 0.01);
      for (const BlobRef& input : grant.inputs) {
        if (input.kind != BlobKind::state) continue;
        ++inputs;
        strange += maker.at(input.digest) != grant.worker ? 1 : 0;
      }
      if (renders) {
        played.most_ahead =
            std::max(played.most_ahead, graph.steps(grant.lease.task).last.value() + 1 -
                                            static_cast<std::int32_t>(farm.progress().frames_done));
      }
    }
  };
  for (const auto& [worker, time] : free_at) begin(farm.step(WorkRequested{worker, 1}));
  while (!running.empty()) {
    const auto next = std::min_element(
        running.begin(), running.end(),
        [&](const auto& a, const auto& b) { return free_at[a.first] < free_at[b.first]; });
    const GrantLease grant = next->second;
    running.erase(next);
    played.hours = free_at[grant.worker];
    for (const BlobRef& output : outputs_of(job, farm.job, grant.lease.task))
      maker[output.digest] = grant.worker;
    farm.now += 1ms;
    begin(farm.finish(grant));
    begin(farm.step(WorkRequested{grant.worker, 1}));
  }
  EXPECT_EQ(farm.status(), JobStatus::done);
  played.strange_inputs = static_cast<double>(strange) / static_cast<double>(std::max(inputs, 1ul));
  return played;
}

// 36 tiles of 40 frames. Were tiles given to whoever asks, a state would be read by another worker
// than its maker's with the probability that two tasks have different workers.
TEST(TileHomesInASequence, EachWorkerReadsMostlyWhatItMade) {
  for (const double speed : {1.0, 1.3, 3.0}) {
    const Played played = play(square_job(40), speed);
    const double by_chance = 2 * speed / ((1 + speed) * (1 + speed));
    EXPECT_LT(played.strange_inputs, (speed < 2 ? 0.4 : 0.7) * by_chance) << speed;
    const double ideal = 40 * 36 / (1 + speed);
    EXPECT_LT(played.hours, 1.03 * ideal + 1) << speed;
    EXPECT_LE(played.most_ahead, 4) << speed;
  }
}

// ---- how far ahead ------------------------------------------------------------------------------

/// Worker "stuck" has the first tile and keeps it; "a" is there, too.
struct StuckFarm : Farm {
  explicit StuckFarm(const JobSpec& spec) : Farm(spec) {
    submit();
    step(WorkerJoined{"stuck", {}});
    step(WorkerJoined{"a", {}});
    ask_one("stuck");
  }
};

// One tile does not come back. Frames at rest do not wait for it; only their films do.
TEST(FramesAhead, AreBoundedByTheirFilms) {
  JobSpec job = small_job(4, 400, 2);
  job.image = {.width = 4096, .height = 1024, .sites = 1, .tile_size = 1024};
  StuckFarm farm(job);
  std::int32_t last_run = 0;
  for (std::vector<GrantLease> grants = farm.ask("a", 1); !grants.empty();
       grants = farm.ask("a", 1)) {
    last_run = std::max(last_run, grants[0].lease.task.run().value());
    farm.finish(grants[0]);
  }
  const auto film_bytes = static_cast<double>(estimate_job(job).film_bytes);
  const auto frames = std::floor(static_cast<double>(limits::kMaxFilmBytesAhead) / film_bytes);
  EXPECT_GT(frames, 10);
  EXPECT_LT(frames, 100);
  EXPECT_NEAR(2 * last_run, frames, 2);
}

TEST(FramesAhead, AreNeverFewerThanTwoRuns) {
  JobSpec job = small_job(2, 40, 10);
  job.image = {.width = 16384, .height = 8192, .sites = 1, .tile_size = 8192};
  StuckFarm farm(job);
  EXPECT_EQ(farm.ask("a", 10).size(), 1u);
  farm.step(WorkRequested{"a", 0});
  std::vector<TaskKey> done;
  GrantLease first;
  first.worker = "a";
  first.lease = {farm.job, render(0, 1), 1, 1};
  farm.finish(first);
  for (const GrantLease& grant : farm.ask("a", 10)) done.push_back(grant.lease.task);
  EXPECT_THAT(done, testing::ElementsAre(render(1, 1)));
}

}  // namespace
}  // namespace baton
