#include <gtest/gtest.h>

#include "common/job/motion.h"
#include "tests/unit/schedule/chaos_farm.h"

namespace baton {
namespace {

using namespace testing_farm;

/// At rest or in motion, with and without state, a second pass or sweeps; nothing is given up.
JobSpec job_of_any_kind(std::uint32_t seed) {
  JobSpec spec =
      small_job(1 + static_cast<int>(seed % 5), 10, 1 + static_cast<int>(seed % 4), seed % 3 != 0);
  if (seed % 4 == 0) spec = moving_job(4, 8, 1 + static_cast<int>(seed % 9));
  spec.visibility.correlated = seed % 3 == 1;
  if (!spec.visibility.correlated && seed % 5 == 0)
    spec.quality.sweeps = 2 + static_cast<int>(seed % 2);
  spec.max_retries_per_task = 1000000;
  spec.max_failures_per_worker = 1000000;
  return spec;
}

/// Another job of the same picture.
JobSpec changed(JobSpec job, std::uint32_t how) {
  job.quality.refinable = !job.visibility.correlated && how % 3 != 0;
  if (!job.visibility.correlated && how % 8 == 1) {
    ++job.quality.sweeps;
    return job;
  }
  const std::uint32_t frames = 3 + how * 5 % 12;
  job.frames.clear();
  for (std::uint32_t i = 0; i < frames; ++i) job.frames.emplace_back(static_cast<int>(i) + 1);
  if (how % 3 == 0) job.image.tile_size = job.image.tile_size == 8 ? 12 : 8;
  if (how % 2 == 0) job.state.checkpoint_every = 1 + static_cast<int>(how % 5);
  job.state.keep = how % 7 == 0 ? StateKeep::all : StateKeep::last;
  job.leading_runs.clear();
  return job;
}

TEST(SchedulerModel, EveryTaskIsDoneOnceWhateverHappens) {
  std::size_t num_missing = 0, num_lost = 0, num_reopened = 0, num_events = 0, num_left = 0;
  std::size_t num_kept_frames = 0, num_cuts = 0, num_inspected_lost = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    ChaosFarm farm(seed, job_of_any_kind(seed), {.alike = seed % 2 == 0});
    // Some jobs are changed on the way, or after their end.
    int steps = 0;
    for (std::uint32_t change = 0; change < seed % 3; ++change) {
      const int end = steps + 50 + static_cast<int>(seed * 37 % 400);
      for (; farm.status() == JobStatus::running && steps < end; ++steps) farm.advance(true);
      farm.change_job(changed(farm.spec(), seed / 3 + change));
    }
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/steps < 3000);
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    EXPECT_EQ(farm.num_recorded(), farm.num_tasks());
    EXPECT_TRUE(farm.has_all_frames());
    EXPECT_EQ(farm.progress().tasks_open, 0u);
    EXPECT_EQ(farm.progress().tasks_leased, 0u);
    EXPECT_GE(farm.num_removed() + farm.num_lost(), seed % 3 == 0 ? 4u : 0u)
        << "the films are gone";
    num_left += farm.num_left();
    farm.delete_job();
    EXPECT_EQ(farm.num_left(), 0u);
    num_missing += farm.num_missing();
    num_lost += farm.num_lost();
    num_reopened += farm.num_reopened();
    num_events += farm.num_events();
    num_kept_frames += farm.num_kept_frames();
    num_cuts += farm.num_cuts();
    num_inspected_lost += farm.num_inspected_lost();
    if (testing::Test::HasFailure()) return;
  }
  RecordProperty("events", std::to_string(num_events));
  EXPECT_GT(num_left, num_seeds() / 2) << "the last states, until their jobs are deleted";
  EXPECT_GT(num_kept_frames, num_seeds() / 2) << "of changed jobs";
  EXPECT_GT(num_cuts, num_seeds() / 20) << "states of another tiling";
  EXPECT_GT(num_inspected_lost, num_seeds() / 20) << "frames that were gone in the end";
  EXPECT_GT(num_lost, num_seeds());
  EXPECT_GT(num_reopened, num_seeds()) << "something was done again";
  EXPECT_GT(num_missing, num_seeds() / 50) << "alike blobs went between publishing and reporting";
}

// With one renderer or two, blind to nothing, and in half of the farms with too small a store.
TEST(SchedulerModel, AJobThatIsNotDoneHasAReason) {
  std::map<ReasonKind, std::size_t> seen;
  for (std::uint32_t seed = 1; seed <= num_seeds() / 2; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const JobSpec spec = job_of_any_kind(seed);
    const std::uint64_t limit = seed % 2 == 0 ? 60 + 20 * (seed % 20) : 0;
    ChaosFarm farm(seed, spec,
                   {.num_workers = 1 + static_cast<int>(seed % 4),
                    .store_limit = limit,
                    .num_renderers = 1 + static_cast<int>(seed / 4 % 2)});
    for (int steps = 0; farm.status() == JobStatus::running && steps < 600; ++steps) {
      farm.advance(/*trouble=*/true);
      if (const auto kind = steps % 7 == 0 ? farm.check_reasons() : std::nullopt) ++seen[*kind];
      if (testing::Test::HasFailure()) return;
    }
  }
  for (const ReasonKind kind : {ReasonKind::running, ReasonKind::no_worker, ReasonKind::asking,
                                ReasonKind::store, ReasonKind::renderer})
    EXPECT_GT(seen[kind], num_seeds() / 50) << reason_kind_name(kind);
}

// Renderers take over from each other at whole frames, with all that goes wrong.
TEST(SchedulerModel, AFrameIsByOneRenderer) {
  std::size_t num_taken_over = 0, num_reopened = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    ChaosFarm farm(seed, job_of_any_kind(seed), {.num_workers = 2, .num_renderers = 2});
    int steps = 0;
    if (seed % 3 == 0) {
      for (; farm.status() == JobStatus::running && steps < 300; ++steps) farm.advance(true);
      farm.change_job(changed(farm.spec(), seed / 3));
    }
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/steps < 3000);
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    EXPECT_EQ(farm.num_recorded(), farm.num_tasks());
    num_taken_over += farm.num_taken_over();
    num_reopened += farm.num_reopened();
    if (testing::Test::HasFailure()) return;
  }
  RecordProperty("taken_over", std::to_string(num_taken_over));
  EXPECT_GT(num_taken_over, num_seeds() / 8);
  EXPECT_GT(num_reopened, num_seeds());
}

// A result that is not there costs time and nothing else: with no retries allowed the job ends
// well.
TEST(SchedulerModel, NobodyIsBlamedForBlobsThatAreAlike) {
  std::size_t num_missing = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = small_job(4, 12, 3);
    spec.max_retries_per_task = 0;
    spec.max_failures_per_worker = 1;
    ChaosFarm farm(seed, spec, {.alike = true});
    int steps = 0;
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/false);
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    EXPECT_EQ(farm.num_failures(), 0u);
    num_missing += farm.num_missing();
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(num_missing, num_seeds() / 50);
}

// One or two workers die, fall silent and leave, and messages are lost; what they held is made
// again from a checkpoint, or was published before. Between checkpoints most states are held.
TEST(SchedulerModel, HeldStatesAreReadByTheirHolderAlone) {
  std::size_t num_tasks = 0, num_held = 0, num_published = 0, num_held_lost = 0;
  std::uint32_t num_paused = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = moving_job(8, 24, 1);
    spec.state.checkpoint_every = 6;
    if (seed % 4 == 0) {
      spec.frames.resize(12);
      spec.quality.sweeps = 2;
    }
    const int num_workers = 1 + static_cast<int>(seed % 2);
    ChaosFarm farm(seed, spec, {.num_workers = num_workers, .failures = false});
    int steps = 0;
    for (; farm.status() != JobStatus::done && steps < 20000; ++steps) {
      // By rare bad luck one task is lost sixteen times, and waits for a person.
      if (farm.status() == JobStatus::paused) {
        ++num_paused;
        farm.resume();
      }
      farm.advance(/*trouble=*/steps % 500 < 250);
    }
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    EXPECT_EQ(farm.progress().tasks_open, 0u);
    num_tasks += farm.num_tasks();
    num_held += farm.num_held();
    num_published += farm.num_published();
    num_held_lost += farm.num_held_lost();
    farm.delete_job();
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_LE(num_paused, 1 + num_seeds() / 2000);
  EXPECT_GT(num_held, num_tasks / 4);
  EXPECT_GT(num_published, num_tasks / 100) << "others waited for them, or their worker left";
  EXPECT_GT(num_held_lost, num_tasks / 100) << "with their workers";
}

// Three workers, whose strips move: of those that live nothing is done again (checked by
// ChaosFarm).
TEST(SchedulerModel, ALostWorkerTakesOnlyWhatItHasMade) {
  std::size_t num_tasks = 0, num_reopened = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds() / 2; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = moving_job(18, 24, 1 + static_cast<int>(seed % 2) * 8);
    spec.state.checkpoint_every = 6;
    ChaosFarm farm(seed, spec, {.num_workers = 3, .failures = false, .restarts = false});
    int steps = 0;
    for (; farm.status() != JobStatus::done && steps < 40000; ++steps) {
      if (farm.status() == JobStatus::paused) farm.resume();
      farm.advance(/*trouble=*/steps % 1000 < 100);
    }
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    num_tasks += farm.num_tasks();
    num_reopened += farm.num_reopened();
    farm.delete_job();
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(num_reopened, num_tasks / 100);
}

// A limit at which a job can go on is never passed, and the job ends, whatever happens to workers,
// messages and the coordinator. (Where files are lost, what is made again may need more room.)
// Where leases are lost, or a coordinator starts again, workers may report one task each that it no
// longer counted on; and states that a leaving worker hands over are in no account.
TEST(SchedulerModel, AStoreWithALimitIsNeverFullAndNeverStuck) {
  std::size_t num_felt = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const int tiles = 2 + static_cast<int>(seed % 4);
    JobSpec spec = small_job(tiles, 24, 1 + static_cast<int>(seed % 3), seed % 5 != 0);
    if (seed % 4 == 0) spec = moving_job(tiles, 24, 1);
    spec.visibility.correlated = seed % 3 == 1;
    spec.max_retries_per_task = 1000000;
    spec.max_failures_per_worker = 1000000;
    // States of all tiles: two checkpoints, what tasks read and make, in motion a third checkpoint;
    // and the films of two runs.
    const int num_states = !carries_state(spec) ? 0 : shares_history(spec) ? 6 : 4;
    const int run = frames_per_run(spec) * (spec.visibility.correlated ? 50 : 10);
    const auto limit = static_cast<std::uint64_t>(tiles * (20 * num_states + 2 * run));
    const bool trouble = seed % 2 == 0;
    ChaosFarm farm(seed, spec, {.alike = seed % 8 < 4, .failures = false, .store_limit = limit});
    int steps = 0;
    for (; farm.status() == JobStatus::running && steps < 40000; ++steps)
      farm.advance(trouble && steps < 3000);
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    const auto late = static_cast<std::uint64_t>(trouble ? 5 * (20 + run) : 0);
    if (farm.num_published() == 0) {
      EXPECT_LE(farm.most_bytes(), limit + late);
    }
    num_felt += farm.most_bytes() * 4 > limit * 3 ? 1 : 0;
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(num_felt, num_seeds() / 4);
}

TEST(SchedulerModel, AJobAlwaysEndsWhenAttemptsAreLimited) {
  for (std::uint32_t seed = 1; seed <= num_seeds() / 4; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = small_job(4, 12, 3);
    if (seed % 2 == 0) spec = moving_job(4, 8, 1 + static_cast<int>(seed % 9));
    spec.visibility.correlated = seed % 3 == 1;
    if (seed % 3 == 2) spec.quality.sweeps = 2;
    spec.max_retries_per_task = 1;
    spec.max_failed_tasks = 2 + static_cast<int>(seed % 4);
    spec.max_failures_per_worker = 3;
    ChaosFarm farm(seed, spec, {.alike = seed % 2 == 0});
    int steps = 0;
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/true);
    EXPECT_NE(farm.status(), JobStatus::running);
    EXPECT_EQ(farm.progress().tasks_open, 0u);
    EXPECT_EQ(farm.progress().tasks_leased, 0u);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace baton
