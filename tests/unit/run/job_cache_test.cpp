#include "worker/run/job_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/state/sample_planes.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

Result<LoadedJobPtr> empty_job(const JobDocument& document) {
  return LoadedJobPtr(std::make_shared<LoadedJob>(LoadedJob{{}, document.job, {}, nullptr}));
}

std::shared_ptr<JobStates> no_states() {
  return std::make_shared<JobStates>(std::make_shared<MemoryShare>(0));
}
/// Room for the states of all jobs.
MemorySharePtr room(std::uint64_t bytes = 0) { return std::make_shared<MemoryShare>(bytes); }

TEST(JobCache, ManyWaitersLoadOnce) {
  std::atomic<int> loads{0};
  JobEntry entry(
      {1, 1},
      [&](const JobDocument& document) {
        EXPECT_EQ(document.json, "text");
        ++loads;
        return empty_job(document);
      },
      no_states());

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
  JobEntry entry({1, 1}, empty_job, no_states());
  std::stop_source stop;
  std::thread stopper([&] { stop.request_stop(); });
  const Result<LoadedJobPtr> job = entry.load(stop.get_token());
  stopper.join();
  ASSERT_FALSE(job);
  EXPECT_EQ(job.error().kind, ErrorKind::cancelled);
}

TEST(JobCache, AFailureIsForThatEntryAlone) {
  int loads = 0;
  const auto loader = [&](const JobDocument& document) -> Result<LoadedJobPtr> {
    if (++loads == 1) return Error{ErrorKind::bad_input, "mesh.ply: no triangles"};
    return empty_job(document);
  };
  JobCache cache(loader, room());
  const auto first = cache.entry({1, 1});
  first->provide({{}, "text"});
  EXPECT_FALSE(first->load({}));
  EXPECT_TRUE(first->failed());

  const auto second = cache.entry({1, 1});
  EXPECT_NE(first, second);
  EXPECT_FALSE(second->document());
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
    JobEntry entry({1, 1}, loader, no_states(), 5ms);
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
  JobCache cache(empty_job, room());
  cache.entry({0, 1})->provide({{}, "text"});
  cache.entry({0, 2})->provide({{}, "text"});
  for (std::uint64_t i = 3; i <= limits::kMaxCachedJobs; ++i) (void)cache.entry({0, i});
  EXPECT_TRUE(cache.entry({0, 1})->document());
  (void)cache.entry({9, 9});
  EXPECT_TRUE(cache.entry({0, 1})->document());
  EXPECT_FALSE(cache.entry({0, 2})->document());
}

// A task waits for its job's document. However many jobs come meanwhile, the document must reach
// the entry that the task holds, or the task would wait for ever.
TEST(JobCache, AJobInUseIsNotForgotten) {
  JobCache cache(empty_job, room());
  std::vector<std::shared_ptr<JobEntry>> held;
  for (std::uint64_t i = 0; i < 3 * limits::kMaxCachedJobs; ++i)
    held.push_back(cache.entry({0, i}));
  for (std::uint64_t i = 0; i < held.size(); ++i) {
    cache.entry({0, i})->provide({{}, "text"});
    EXPECT_TRUE(held[i]->document()) << i;
  }

  // Once nobody holds them, they are forgotten like all others.
  held.clear();
  for (std::uint64_t i = 0; i < limits::kMaxCachedJobs; ++i) (void)cache.entry({1, i});
  for (std::uint64_t i = 0; i < 3 * limits::kMaxCachedJobs; ++i)
    EXPECT_FALSE(cache.entry({0, i})->document()) << i;
}

/// A cache of jobs whose states are one pixel each.
class JobCacheStates : public testing::Test {
 protected:
  JobCacheStates() {
    SampleState state;
    state.resize(sample_format(), {0, 0, 1, 1}, 1);
    state_ = std::make_shared<const SampleState>(std::move(state));
    share_ = room(2 * state_->size_bytes());
    cache_.emplace(empty_job, share_);
  }
  LoadedJobPtr load(const Digest& job) {
    const auto entry = cache_->entry(job);
    entry->provide({job, "text"});
    return entry->load({}).value();
  }
  /// Loads jobs until the scenes of all others are gone.
  void load_others(std::uint64_t first) {
    for (std::uint64_t i = 0; i < 2 * limits::kMaxCachedJobs; ++i) (void)load({first, i});
  }
  bool hold(const LoadedJobPtr& job, std::int32_t tile) {
    return job->states->hold(ref_of(job->digest, tile), state_);
  }
  static BlobRef ref_of(const Digest& job, std::int32_t tile) {
    return {BlobKind::state, 0, tile, held_state_name(job, Step(0), tile)};
  }
  std::size_t num_held() const {
    std::size_t count = 0;
    for (const auto& [job, states] : cache_->states()) count += states->held().size();
    return count;
  }

  StatePtr state_;
  MemorySharePtr share_;
  std::optional<JobCache> cache_;
};

// What a job holds is nowhere else: its scene may go, its states not.
TEST_F(JobCacheStates, OutliveTheScene) {
  ASSERT_TRUE(hold(load({1, 1}), 0));
  load_others(2);
  EXPECT_FALSE(cache_->entry({1, 1})->document()) << "its scene is gone";
  EXPECT_EQ(load({1, 1})->states->find(ref_of({1, 1}, 0)), state_);

  // Without being loaded again it can still publish them.
  load_others(3);
  EXPECT_EQ(num_held(), 1u);
  EXPECT_EQ(share_->used(), state_->size_bytes());
}

// Nobody says whether a job has ended: what it holds is in the way of none that is at work.
TEST_F(JobCacheStates, WithoutASceneMakeRoomForThoseAtWork) {
  for (std::int32_t tile = 0; tile < 2; ++tile) ASSERT_TRUE(hold(load({1, 1}), tile));
  load_others(2);
  const LoadedJobPtr at_work = load({3, 3});
  EXPECT_EQ(num_held(), 2u);
  EXPECT_FALSE(hold(at_work, 0)) << "this one goes into the store";
  (void)cache_->entry({3, 3});
  EXPECT_TRUE(hold(at_work, 1));
  EXPECT_EQ(num_held(), 1u);

  // Those at work make no room for each other.
  ASSERT_TRUE(hold(load({4, 4}), 0));
  EXPECT_FALSE(hold(at_work, 2));
  (void)cache_->entry({3, 3});
  EXPECT_EQ(num_held(), 2u);
}

// One job, one list: also where an attempt of it has failed, and where it has nothing any more.
TEST_F(JobCacheStates, AreListedOnce) {
  const LoadedJobPtr job = load({1, 1});
  ASSERT_TRUE(hold(job, 0));
  load_others(2);
  ASSERT_TRUE(hold(load({1, 1}), 1));
  EXPECT_EQ(num_held(), 2u);
  EXPECT_EQ(load({1, 1})->states, job->states);
  job->states->release_before(Step(1));
  load_others(3);
  EXPECT_FALSE(cache_->states().contains({1, 1}));
  EXPECT_EQ(share_->used(), 0u);
}

// Its folders may be mounted by the time that a task of it comes again.
TEST(JobCache, AJobThatWasNotSeenIsLookedForAgain) {
  int loads = 0;
  const auto loader = [&](const JobDocument& document) -> Result<LoadedJobPtr> {
    auto job = std::make_shared<LoadedJob>(LoadedJob{{}, document.job, {}, nullptr});
    if (++loads == 1) job->unseen = "/shows: not there";
    return LoadedJobPtr(std::move(job));
  };
  JobCache cache(loader, room());
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

// The coordinator has let it in; another worker may see it.
TEST(JobCache, AJobOutsideTheRootsOfAWorkerIsNotSeenByIt) {
  const std::string json = make_job_document(test::box_job()).value();
  AssetShelf shelf;
  const Machine machine{.roots = {"/nonexistent"}};
  const Digest digest = parse_job_document(json).value().digest;
  const Result<LoadedJobPtr> job = load_job_document({digest, json}, machine, shelf);
  ASSERT_TRUE(job) << job.error().message;
  EXPECT_NE((*job)->unseen.find("lies outside what --root allows: /nonexistent"), std::string::npos)
      << (*job)->unseen;
}

TEST(AssetShelf, JobsOfOneSceneShareItWhileOneOfThemLives) {
  JobSpec job = test::box_job();
  const std::vector<KnownAsset> files{{{"map.exr", {1, 2}}, {}}};
  AssetShelf shelf;
  const MemoryBudget memory = MemoryBudget::of_machine();
  const auto get = [&](const JobSpec& of, const std::vector<KnownAsset>& with) {
    return shelf.get(of, with, memory, memory.scene_bytes);
  };
  auto first = get(job, files).value();
  job.seed = 7;
  job.sampling.num_particles = 3;
  EXPECT_EQ(get(job, files).value(), first);

  // Another file content or another scene is loaded anew.
  EXPECT_EQ(get(job, {{{"map.exr", {1, 2}}, {.size_bytes = 5}}}).value(), first);
  EXPECT_NE(get(job, {{{"map.exr", {1, 3}}, {}}}).value(), first);
  job.scene.ground->size += 1;
  EXPECT_NE(get(job, files).value(), first);
  job.scene.ground->size -= 1;

  // Nothing is kept for its own sake.
  const std::weak_ptr<const SharedAssets> gone = first;
  first.reset();
  EXPECT_TRUE(gone.expired());
}

// A file that stands as it did is not read again to see what is in it.
TEST(KnownAsset, IsReadAgainWhereItStandsOtherwise) {
  const std::string path = (test::test_folder() / "plate.png").string();
  ASSERT_TRUE(write_file_atomic(path, as_bytes_view("1234")));
  KnownAsset known{{path, digest_of("not this")}, *stamp_of(path).value()};
  EXPECT_TRUE(verify_asset({known}, path)) << "it is not read";
  EXPECT_TRUE(verify_asset({known}, "another.png"));
  known.stamp.time_ns -= 1;
  const Status changed = verify_asset({known}, path);
  ASSERT_FALSE(changed);
  EXPECT_EQ(changed.error().kind, ErrorKind::bad_input);
  EXPECT_NE(changed.error().message.find("plate.png: changed since the job was submitted"),
            std::string::npos);
  known.file.digest = digest_of("1234");
  EXPECT_TRUE(verify_asset({known}, path));
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

// By its header, before anything is taken for it.
TEST(MapCache, AMapThatDoesNotFitIsRefused) {
  const std::string path = testing::TempDir() + "huge.hdr";
  ASSERT_TRUE(write_file_atomic(path, as_bytes_view("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
                                                    "-Y 8192 +X 16384\n"))
                  .ok());
  const MemoryBudget memory = MemoryBudget::of(std::uint64_t{800} << 20);
  MapCache maps(memory.maps, MapCache::read_within(memory.pictures()));
  const auto map = maps.get(path, {}, false);
  ASSERT_FALSE(map.ok());
  EXPECT_EQ(map.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(map.error().message,
            path +
                ": 16384 x 8192 pixels, expected at most 19.1 million, 44 bytes each, of the "
                "worker's (--memory) 800 MiB");
}

// An error of the moment is waited for; what is wrong with a map stays wrong.
TEST(MapCache, AMapThatCannotBeReadIsReadAgain) {
  const JobSpec job = test::box_job();
  int reads = 0;
  ErrorKind kind = ErrorKind::io;
  MapCache maps(room(std::uint64_t{1} << 30), [&](const std::string& path) -> Result<RgbImage> {
    if (++reads == 1) return Error{kind, path + ": Input/output error"};
    return read_rgb_image(path);
  });
  const std::string& path = job.environment.keys.front().map;
  EXPECT_TRUE(maps.get(path, job.environment, false));
  EXPECT_EQ(reads, 2);
  reads = 0;
  kind = ErrorKind::bad_input;
  EXPECT_FALSE(maps.get(path, job.environment, true));
  EXPECT_EQ(reads, 1);
}

}  // namespace
}  // namespace baton
