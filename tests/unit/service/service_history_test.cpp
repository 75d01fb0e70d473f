#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/unit/service/fake_farm.h"

namespace baton::testing_service {
namespace {

using testing::Contains;
using testing::Each;
using testing::Gt;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

struct HistoryTest : ServiceTest {
  JobAccepted submit(const std::string& endpoint, const JobSpec& spec, bool restart = false) {
    return ask<JobAccepted>(endpoint, SubmitJob{make_job_document(spec).value(), restart});
  }
  std::vector<FarmEvent> events(const std::string& endpoint, const std::string& of = {}) {
    return ask<EventList>(endpoint, ListEvents{of, {}}).events;
  }
  static std::size_t count(const std::vector<FarmEvent>& events, FarmEventKind kind) {
    return static_cast<std::size_t>(std::ranges::count(events, kind, &FarmEvent::kind));
  }
  void finish_all(const std::string& endpoint, FakeWorker& worker, const Digest& version) {
    for (int i = 0; i < kNumTasks; ++i) worker.do_one_task();
    EXPECT_EQ(show_end(endpoint, version).summary.status, JobStatus::done);
  }
};

// Documents are versions of a job: the same name, folder and owner is the same job.
TEST_F(HistoryTest, AJobStaysItselfWhileItsDocumentChanges) {
  JobId id;
  {
    const RunningService service(options);
    const JobAccepted first = submit(service.endpoint(), job);
    id = first.identity.id;
    EXPECT_FALSE(id.empty());
    EXPECT_EQ(submit(service.endpoint(), job).identity.id, id) << "the same document";

    // Settings, frames, names of files, even the picture.
    std::vector<JobSpec> edits(5, job);
    edits[0].priority = 7;
    edits[1].frames.emplace_back(9);
    edits[2].output.pattern = "other.####.exr";
    edits[3].frames = {FrameNumber(20)};
    edits[4].seed = 99;
    std::int32_t version = 1;
    for (const JobSpec& edit : edits) {
      const JobAccepted accepted = submit(service.endpoint(), edit, edit.seed == 99);
      EXPECT_EQ(accepted.identity.id, id);
      EXPECT_EQ(accepted.identity.version, ++version);
      EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{true}).jobs, SizeIs(1));
    }
    // A former one again, found by its ID, its name, and what its documents were called.
    EXPECT_EQ(submit(service.endpoint(), job, true).identity,
              (JobIdentity{id, 7, show_identity(service.endpoint(), id.hex()).times}));
    for (const std::string& text :
         {id.hex(), id.short_hex(), job.name, first.version.hex(), first.version.short_hex()})
      EXPECT_EQ(show_identity(service.endpoint(), text).id, id) << text;

    JobSpec other = job;
    other.name = "another";
    other.output.directory += "-other";
    EXPECT_NE(submit(service.endpoint(), other).identity.id, id);
    EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{true}).jobs, SizeIs(2));
  }
  const RunningService again(options);
  EXPECT_EQ(show_identity(again.endpoint(), job.name).id, id);
  ask<ShownJob>(again.endpoint(), CancelJob{id.hex()});
  EXPECT_THAT(ask<JobList>(again.endpoint(), DeleteJob{id.hex()}).jobs, SizeIs(1));
  EXPECT_NE(submit(again.endpoint(), job).identity.id, id) << "it was forgotten with its versions";
}

TEST_F(HistoryTest, WhatHappensIsToldOnce) {
  JobId id;
  {
    const RunningService service(options);
    FakeWorker lost(service.endpoint(), store(), job, "lost");
    lost.hello();
    const JobAccepted accepted = submit(service.endpoint(), job);
    id = accepted.identity.id;
    EXPECT_EQ(show_identity(service.endpoint(), id.hex()).times.started_ms, 0);
    lost.say(LeaseRequest{1});
    lost.expect<LeaseGrant>();
    const auto list = ask<JobList>(service.endpoint(), ListJobs{});
    ASSERT_THAT(list.workers, SizeIs(1));
    ASSERT_THAT(list.workers[0].tasks, SizeIs(1));
    EXPECT_EQ(list.workers[0].tasks[0].job, id);
    EXPECT_EQ(place_text(list.workers[0].tasks[0].task), "frames 1-2, tile 0");
    lost.say(WorkerGoodbye{});

    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    finish_all(service.endpoint(), worker, accepted.version);

    const std::vector<FarmEvent> told = events(service.endpoint(), id.hex());
    EXPECT_EQ(count(told, FarmEventKind::job_submitted), 1u);
    EXPECT_EQ(count(told, FarmEventKind::task_granted), kNumTasks + 1u);
    EXPECT_EQ(count(told, FarmEventKind::task_done), static_cast<std::size_t>(kNumTasks));
    EXPECT_EQ(count(told, FarmEventKind::task_returned), 1u);
    EXPECT_EQ(count(told, FarmEventKind::job_done), 1u);
    EXPECT_EQ(told.back().kind, FarmEventKind::job_done);
    EXPECT_TRUE(std::ranges::is_sorted(told, {}, &FarmEvent::sequence));
    EXPECT_TRUE(std::ranges::is_sorted(told, {}, &FarmEvent::time_ms));
    for (const FarmEvent& event : told) EXPECT_EQ(event.job, id);
    const JobTimes times = show_identity(service.endpoint(), id.hex()).times;
    EXPECT_THAT(times.submitted_ms, Gt(0));
    EXPECT_LE(times.submitted_ms, times.started_ms);
    EXPECT_LE(times.started_ms, times.ended_ms);

    const std::vector<FarmEvent> all = events(service.endpoint());
    EXPECT_EQ(all.front().kind, FarmEventKind::coordinator_started);
    EXPECT_EQ(count(all, FarmEventKind::worker_joined), 2u);
    EXPECT_EQ(count(all, FarmEventKind::worker_left), 1u);
    const auto newer =
        ask<EventList>(service.endpoint(), ListEvents{{}, {.after_sequence = all.back().sequence}});
    EXPECT_THAT(newer.events, IsEmpty());
    const auto newest = ask<EventList>(service.endpoint(), ListEvents{{}, {.count = 1}}).events;
    ASSERT_THAT(newest, SizeIs(1));
    EXPECT_EQ(newest[0].sequence, all.back().sequence);
    EXPECT_EQ(refused(service.endpoint(), ListEvents{"nobody", {}}).kind, ErrorKind::bad_input);
  }
  // What happened stays, when the job was done, too.
  const RunningService again(options);
  const std::vector<FarmEvent> all = events(again.endpoint());
  EXPECT_EQ(count(all, FarmEventKind::coordinator_started), 2u);
  EXPECT_EQ(count(all, FarmEventKind::coordinator_stopped), 1u);
  EXPECT_EQ(count(all, FarmEventKind::job_done), 1u);
  EXPECT_THAT(show_identity(again.endpoint(), id.hex()).times.ended_ms, Gt(0));
}

// To lock and unlock a frame of a job that is done changes nothing of what happened.
TEST_F(HistoryTest, AnUnlockedFrameSubmitsNothing) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  const JobAccepted accepted = submit(service.endpoint(), job);
  const std::string id = accepted.identity.id.hex();
  finish_all(service.endpoint(), worker, accepted.version);
  const JobTimes before = show_identity(service.endpoint(), id).times;
  for (const bool off : {false, true})
    ask<ShownJob>(service.endpoint(), LockFrames{id, {FrameNumber(1)}, off});
  const std::vector<FarmEvent> told = events(service.endpoint(), id);
  EXPECT_EQ(count(told, FarmEventKind::job_submitted), 1u);
  EXPECT_EQ(count(told, FarmEventKind::job_done), 1u);
  EXPECT_EQ(told.back().kind, FarmEventKind::frames_unlocked);
  EXPECT_EQ(show_identity(service.endpoint(), id).times, before);
}

TEST_F(HistoryTest, AWorkerThatWasToldToFinishIsShownSo) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  EXPECT_FALSE(ask<JobList>(service.endpoint(), ListJobs{}).workers.at(0).is_draining);
  EXPECT_TRUE(ask<JobList>(service.endpoint(), OrderWorker{"w"}).workers.at(0).is_draining);
  EXPECT_EQ(count(events(service.endpoint()), FarmEventKind::worker_drained), 1u);
  worker.hello();  // connected again
  worker.expect<WorkerWelcome>();
  EXPECT_TRUE(ask<JobList>(service.endpoint(), ListJobs{}).workers.at(0).is_draining);
}

// Jobs of a journal from before there were identities go by the beginning of their digest.
TEST_F(HistoryTest, AnEarlierJournalIsTakenUp) {
  Digest version;
  {
    const RunningService service(options);
    version = submit(service.endpoint(), job).version;
  }
  sqlite3* journal = nullptr;
  ASSERT_EQ(sqlite3_open((options.work_dir / "journal.sqlite").c_str(), &journal), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(journal,
                         "DROP TABLE versions; DROP TABLE identities; DROP TABLE events; "
                         "DROP TABLE event_sums",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(journal);
  const RunningService service(options);
  const JobIdentity known = show_identity(service.endpoint(), version.hex());
  EXPECT_EQ(known.id.hex(), version.hex().substr(0, 16));
  EXPECT_EQ(known.times, JobTimes{});
  EXPECT_EQ(submit(service.endpoint(), job).identity.id, known.id);
}

TEST_F(HistoryTest, OldEventsBecomeSums) {
  Journal journal = Journal::open(folder / "journal.sqlite").value();
  for (int i = 1; i <= 10; ++i) {
    ASSERT_TRUE(journal.record_event({.time_ms = 1000 * i,
                                      .kind = FarmEventKind::task_done,
                                      .job = {7},
                                      .reason = "",
                                      .seconds = 2}));
  }
  ASSERT_TRUE(journal.forget_events(/*most=*/8, /*until_ms=*/5000));
  const std::vector<FarmEvent> kept = journal.events({}).value();
  ASSERT_THAT(kept, SizeIs(6));
  EXPECT_EQ(kept.front().time_ms, 5000);
  ASSERT_TRUE(journal.forget_events(3, 0));
  EXPECT_THAT(journal.events({}).value(), SizeIs(3));
  ASSERT_TRUE(journal.commit());
  EXPECT_EQ(journal.event_sums({7}).value().at(FarmEventKind::task_done).count, 7);
  EXPECT_EQ(journal.event_sums({7}).value().at(FarmEventKind::task_done).seconds, 14);
}

}  // namespace
}  // namespace baton::testing_service
