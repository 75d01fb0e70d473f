#include "worker/run/job_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "common/base/limits.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

Result<LoadedJobPtr> empty_job(const JobDocument& document) {
  return LoadedJobPtr(std::make_shared<LoadedJob>(LoadedJob{{}, document.job, {}, nullptr}));
}

TEST(JobCache, ManyWaitersLoadOnce) {
  std::atomic<int> loads{0};
  JobEntry entry({1, 1}, [&](const JobDocument& document) {
    EXPECT_EQ(document.json, "text");
    ++loads;
    return empty_job(document);
  });

  // All threads wait for the document; then all get the same job.
  std::vector<LoadedJobPtr> jobs(8);
  std::vector<std::thread> threads;
  for (LoadedJobPtr& job : jobs) {
    threads.emplace_back([&] { job = entry.load({}).value(); });
  }
  entry.provide({{}, "text"});
  entry.provide({{}, "another text"});
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(loads, 1);
  for (const LoadedJobPtr& job : jobs) EXPECT_EQ(job, jobs.front());
}

TEST(JobCache, AWaiterCanBeStopped) {
  JobEntry entry({1, 1}, empty_job);
  std::stop_source stop;
  std::thread stopper([&] { stop.request_stop(); });
  const Result<LoadedJobPtr> job = entry.load(stop.get_token());
  stopper.join();
  ASSERT_FALSE(job);
  EXPECT_EQ(job.error().kind, ErrorKind::cancelled);
}

TEST(JobCache, AFailureIsForThatEntryAlone) {
  int loads = 0;
  JobCache cache([&](const JobDocument& document) -> Result<LoadedJobPtr> {
    if (++loads == 1) return Error{ErrorKind::bad_input, "mesh.ply: no triangles"};
    return empty_job(document);
  });
  const auto first = cache.entry({1, 1});
  first->provide({{}, "text"});
  EXPECT_FALSE(first->load({}));
  EXPECT_TRUE(first->failed());

  const auto second = cache.entry({1, 1});
  EXPECT_NE(first, second);
  EXPECT_FALSE(second->has_document());
  second->provide({{}, "text"});
  EXPECT_TRUE(second->load({}));
}

TEST(JobCache, AFileThatIsAwayIsLookedForAgain) {
  using namespace std::chrono_literals;
  int loads = 0;
  ErrorKind kind = ErrorKind::io;
  int failures = 1;
  const auto loader = [&](const JobDocument& document) -> Result<LoadedJobPtr> {
    if (++loads <= failures) return Error{kind, "sky.exr: no such file"};
    return empty_job(document);
  };
  const auto load = [&] {
    JobEntry entry({1, 1}, loader, 5ms);
    entry.provide({{}, "text"});
    loads = 0;
    return entry.load({}).ok();
  };
  EXPECT_TRUE(load()) << "it is back";
  EXPECT_EQ(loads, 2);
  failures = 2;
  EXPECT_FALSE(load()) << "once is enough for one attempt";
  EXPECT_EQ(loads, 2);
  kind = ErrorKind::bad_input;
  EXPECT_FALSE(load());
  EXPECT_EQ(loads, 1) << "what is wrong stays wrong";
}

TEST(JobCache, TheOldestJobGoesFirst) {
  JobCache cache(empty_job);
  cache.entry({0, 1})->provide({{}, "text"});
  cache.entry({0, 2})->provide({{}, "text"});
  for (std::uint64_t i = 3; i <= limits::kMaxCachedJobs; ++i) (void)cache.entry({0, i});
  EXPECT_TRUE(cache.entry({0, 1})->has_document());
  (void)cache.entry({9, 9});
  EXPECT_TRUE(cache.entry({0, 1})->has_document());
  EXPECT_FALSE(cache.entry({0, 2})->has_document());
}

// A task waits for its job's document. However many jobs come meanwhile, the document must reach
// the entry that the task holds, or the task would wait for ever.
TEST(JobCache, AJobInUseIsNotForgotten) {
  JobCache cache(empty_job);
  std::vector<std::shared_ptr<JobEntry>> held;
  for (std::uint64_t i = 0; i < 3 * limits::kMaxCachedJobs; ++i)
    held.push_back(cache.entry({0, i}));
  for (std::uint64_t i = 0; i < held.size(); ++i) {
    cache.entry({0, i})->provide({{}, "text"});
    EXPECT_TRUE(held[i]->has_document()) << i;
  }

  // Once nobody holds them, they are forgotten like all others.
  held.clear();
  for (std::uint64_t i = 0; i < limits::kMaxCachedJobs; ++i) (void)cache.entry({1, i});
  for (std::uint64_t i = 0; i < 3 * limits::kMaxCachedJobs; ++i)
    EXPECT_FALSE(cache.entry({0, i})->has_document()) << i;
}

// What a job holds is nowhere else: its scene may go, its states not.
TEST(JobCache, WhatAJobHoldsOutlivesItsScene) {
  JobCache cache([](const JobDocument& document) -> Result<LoadedJobPtr> {
    auto job = std::make_shared<LoadedJob>(LoadedJob{{}, document.job, {}, nullptr});
    job->states = std::make_shared<JobStates>(std::make_shared<MemoryShare>(1 << 20));
    return LoadedJobPtr(std::move(job));
  });
  const auto load = [&](const Digest& job) {
    const auto entry = cache.entry(job);
    entry->provide({job, "text"});
    return entry->load({}).value();
  };
  const BlobRef held{BlobKind::state, 0, 0, held_state_name({1, 1}, Step(0), 0)};
  const auto state = std::make_shared<const SampleState>();
  ASSERT_TRUE(load({1, 1})->states->hold(held, state));
  for (std::uint64_t i = 0; i < 2 * limits::kMaxCachedJobs; ++i) (void)load({2, i});
  EXPECT_FALSE(cache.entry({1, 1})->has_document()) << "its scene is gone";
  EXPECT_EQ(load({1, 1})->states->find(held), state);

  // Without being loaded again it can still publish them.
  for (std::uint64_t i = 0; i < 2 * limits::kMaxCachedJobs; ++i) (void)load({3, i});
  std::size_t num_held = 0;
  for (const auto& [job, states] : cache.states()) num_held += states->held().size();
  EXPECT_EQ(num_held, 1u);
}

// Its folders may be mounted by the time that a task of it comes again.
TEST(JobCache, AJobThatWasNotSeenIsLookedForAgain) {
  int loads = 0;
  JobCache cache([&](const JobDocument& document) -> Result<LoadedJobPtr> {
    auto job = std::make_shared<LoadedJob>(LoadedJob{{}, document.job, {}, nullptr});
    if (++loads == 1) job->unseen = "/shows: not there";
    return LoadedJobPtr(std::move(job));
  });
  const auto first = cache.entry({1, 1});
  first->provide({{1, 1}, "text"});
  EXPECT_EQ(first->load({}).value()->unseen, "/shows: not there");
  const auto second = cache.entry({1, 1});
  EXPECT_NE(second, first);
  second->provide({{1, 1}, "text"});
  EXPECT_EQ(second->load({}).value()->unseen, "");
}

TEST(JobCache, ADocumentOfAnotherJobIsRefused) {
  AssetShelf shelf;
  const Result<LoadedJobPtr> job = load_job_document({{1, 1}, "not a document"}, {}, shelf);
  EXPECT_FALSE(job);
}

TEST(AssetShelf, JobsOfOneSceneShareItWhileOneOfThemLives) {
  JobSpec job = test::box_job();
  const std::vector<AssetDigest> files{{"map.exr", {1, 2}}};
  AssetShelf shelf;
  const MemoryBudget memory = MemoryBudget::of_machine();
  const auto get = [&](const JobSpec& of, const std::vector<AssetDigest>& with) {
    return shelf.get(of, with, memory, memory.scene_bytes);
  };
  auto first = get(job, files).value();
  job.seed = 7;
  job.sampling.num_particles = 3;
  EXPECT_EQ(get(job, files).value(), first);

  // Another file content or another scene is loaded anew.
  EXPECT_NE(get(job, {{"map.exr", {1, 3}}}).value(), first);
  job.scene.ground->size += 1;
  EXPECT_NE(get(job, files).value(), first);
  job.scene.ground->size -= 1;

  // Nothing is kept for its own sake.
  const std::weak_ptr<const SharedAssets> gone = first;
  first.reset();
  EXPECT_TRUE(gone.expired());
}

TEST(MapCache, AMapIsReadOncePerTable) {
  const JobSpec job = test::box_job();
  const std::string& path = job.environment.keys.front().map;
  MapCache maps(std::make_shared<MemoryShare>(std::uint64_t{1} << 30));
  const auto first = maps.get(path, job.environment, false).value();
  EXPECT_EQ(maps.get(path, job.environment, false).value(), first);
  EXPECT_NE(maps.get(path, job.environment, true).value(), first);
  EnvironmentSpec brighter = job.environment;
  brighter.scale *= 2;
  const auto scaled = maps.get(path, brighter, false).value();
  EXPECT_FLOAT_EQ(scaled->texels()[0].r, 2 * first->texels()[0].r);
  EnvironmentSpec coarse = job.environment;
  coarse.max_width = 2;
  EXPECT_EQ(maps.get(path, coarse, false).value()->width(), 2);
  EXPECT_FALSE(maps.get("nowhere.exr", job.environment, false));
}

}  // namespace
}  // namespace baton
