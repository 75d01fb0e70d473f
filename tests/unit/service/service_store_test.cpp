#include <gmock/gmock.h>

#include "coordinator/service/service.h"
#include "tests/unit/service/fake_farm.h"

/// What is in the store: leftovers of earlier runs, and a limit.
namespace baton {
namespace {

using namespace testing_service;
using testing::HasSubstr;

struct ServiceStoreTest : ServiceTest {
  /// Nobody has touched what is in the store for long.
  void age_all() const {
    const auto long_ago = fs::file_time_type::clock::now() - 2 * BlobStore::kLeftoverAge;
    for (const auto& entry : fs::recursive_directory_iterator(store())) {
      if (entry.is_regular_file()) fs::last_write_time(entry, long_ago);
    }
  }
  fs::path put_leftover(const std::string& text) const {
    BlobStore blobs = BlobStore::open(store()).value();
    return blobs.path(blobs.put(as_bytes_view(text)).value());
  }
  void do_tasks(const std::string& endpoint, int count) {
    FakeWorker worker(endpoint, store(), job);
    worker.hello();
    for (int i = 0; i < count; ++i) worker.do_one_task();
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
  }
  std::size_t num_blobs() const { return BlobStore::open(store()).value().old_blobs().size(); }
};

TEST_F(ServiceStoreTest, AStartRemovesWhatNoJobNeedsAndNothingElse) {
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    do_tasks(service.endpoint(), 2);
  }
  const fs::path orphan = put_leftover("of a worker that was killed");
  const BlobStore blobs = BlobStore::open(store()).value();
  const fs::path job_file = blobs.job_file(id), gone = blobs.job_file(digest_of("gone"));
  for (const fs::path& path : {job_file, gone})
    ASSERT_TRUE(write_file_atomic(path, as_bytes_view("{}")).ok());
  age_all();
  const fs::path young = put_leftover("of a worker that will report it");
  ASSERT_EQ(num_blobs(), 7u) << "two states, four films, the orphan";

  // Of the open job everything stays, however old.
  {
    const RunningService service(options);
    EXPECT_EQ(num_blobs(), 6u);
    EXPECT_FALSE(fs::exists(orphan));
    EXPECT_TRUE(fs::exists(young));
    EXPECT_TRUE(fs::exists(job_file));
    EXPECT_FALSE(fs::exists(gone));
    EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, 2u);
    do_tasks(service.endpoint(), kNumTasks - 2);
    EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
  }

  // Of one that has ended its last states, which a longer job goes on from.
  age_all();
  {
    const RunningService service(options);
    EXPECT_EQ(num_blobs(), 2u);
    EXPECT_FALSE(fs::exists(young)) << "it has grown old";
    JobSpec longer = job;
    longer.frames.emplace_back(5);
    const auto accepted =
        ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(longer).value()});
    EXPECT_THAT(accepted.plan, HasSubstr("going on from the states of frame 4"));
  }
}

TEST_F(ServiceStoreTest, ARunningCoordinatorSweepsFromTimeToTime) {
  options.clean_up_every = std::chrono::milliseconds(1);
  const RunningService service(options);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  do_tasks(service.endpoint(), 2);
  const fs::path orphan = put_leftover("of a worker that was killed");
  age_all();
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (fs::exists(orphan) && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_FALSE(fs::exists(orphan));
  EXPECT_EQ(num_blobs(), 6u) << "of the open job";
}

// A job that cannot be read may need any blob.
TEST_F(ServiceStoreTest, NothingIsSweptBesideAJobThatCannotBeRead) {
  const fs::path orphan = put_leftover("of a worker that was killed");
  age_all();
  {
    Journal journal = Journal::open(options.work_dir / "journal.sqlite").value();
    ASSERT_TRUE(journal.add_job(digest_of("other"), "of a later version").ok());
    ASSERT_TRUE(journal.commit().ok());
  }
  const RunningService service(options);
  EXPECT_TRUE(fs::exists(orphan));
}

// A blob of the fake worker has 5 bytes: a task makes 15.
struct FullStoreTest : ServiceStoreTest {
  FullStoreTest() { options.store_limit = 45; }

  /// The first job leaves two tasks' blobs, so the other one has room for one task's.
  Digest fill(const std::string& endpoint, FakeWorker& worker, const SubmitJob& other) {
    first = ask<JobAccepted>(endpoint, SubmitJob{document}).version;
    worker.hello();
    for (int i = 0; i < 2; ++i) worker.do_one_task();
    // What it has said is known before others are asked.
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
    ask<ShownJob>(endpoint, CancelJob{first.hex()});
    const Digest second = ask<JobAccepted>(endpoint, other).version;
    worker.do_one_task();
    worker.say(LeaseRequest{1});
    return second;
  }

  Digest first;
};

TEST_F(FullStoreTest, AJobWaitsForRoomAndGoesOnWhenAnotherIsDeleted) {
  JobSpec other = job;
  other.name = "other";
  other.output.directory = (folder / "other").string();
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest second =
      fill(service.endpoint(), worker, SubmitJob{make_job_document(other).value()});
  worker.expect<NoWork>();
  const JobDetail waiting = show(service.endpoint(), second);
  EXPECT_EQ(waiting.summary.status, JobStatus::running);
  EXPECT_TRUE(waiting.lacks_room);
  EXPECT_THAT(waiting.waits,
              HasSubstr("of the 45 B that --store-limit allows, 30 B of them of jobs"));
  ask<JobList>(service.endpoint(), DeleteJob{first.hex()});
  EXPECT_EQ(worker.expect<LeaseGrant>().lease.job, second);
  EXPECT_FALSE(show(service.endpoint(), second).lacks_room);
}

// Nobody could ask for it by a name, so it goes before the worker is told that there is no work, or
// soon after. What the newest version of an ended job left stays.
TEST_F(FullStoreTest, WhatAnEarlierVersionLeftGoes) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  ++job.seed;
  const Digest second =
      fill(service.endpoint(), worker, SubmitJob{make_job_document(job).value(), /*restart=*/true});
  EXPECT_EQ(worker.expect<LeaseGrant>().lease.job, second);
  EXPECT_FALSE(show(service.endpoint(), second).lacks_room);
}

}  // namespace
}  // namespace baton
