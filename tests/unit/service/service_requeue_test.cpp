#include <gmock/gmock.h>

#include "common/store/frame_locks.h"
#include "tests/unit/service/fake_farm.h"

/// Frames that are rendered once more because somebody wants it, and where a job's frames are seen.
namespace baton::testing_service {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

struct RequeueTest : ServiceTest {
  RequeuePlan plan(const std::string& endpoint, std::vector<FrameNumber> frames) {
    return ask<RequeuePlan>(endpoint, AskRequeue{"test", std::move(frames)});
  }
  JobAccepted submit(const std::string& endpoint, std::vector<FrameNumber> again = {}) {
    return ask<JobAccepted>(endpoint, SubmitJob{document, false, true, std::move(again)});
  }
  /// Until the coordinator has taken note of it.
  static void do_one_task(FakeWorker& worker) {
    const LeaseId lease = worker.do_one_task();
    EXPECT_EQ(worker.expect<ReportReceived>().lease, lease);
  }
  /// Does tasks until the job has ended, also those that its last look at the frames brings;
  /// returns how many there were.
  int finish(const std::string& endpoint, FakeWorker& worker, const Digest& id) {
    int count = 0;
    for (; !HasFailure(); ++count) {
      JobDetail job_now = show(endpoint, id);
      for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
           job_now.summary.tasks_done == kNumTasks &&
           job_now.summary.status == JobStatus::running &&
           std::chrono::steady_clock::now() < deadline;
           job_now = show(endpoint, id))
        std::this_thread::sleep_for(5ms);
      if (job_now.summary.tasks_done == kNumTasks) {
        EXPECT_EQ(job_now.summary.status, JobStatus::done);
        break;
      }
      do_one_task(worker);
    }
    return count;
  }
  /// A coordinator that has the job, and a worker.
  struct Busy {
    explicit Busy(RequeueTest& test)
        : service(test.options),
          endpoint(service.endpoint()),
          worker(endpoint, test.store(), test.job) {
      worker.hello();
      id = test.submit(endpoint).version;
    }
    RunningService service;
    const std::string& endpoint;
    FakeWorker worker;
    Digest id;
  };
  std::vector<FarmEvent> requeues(const std::string& endpoint) {
    return ask<EventList>(endpoint,
                          ListEvents{"test", {.kinds = bit_of(FarmEventKind::frames_requeued)}})
        .events;
  }
};

// Frames 1-2 and 3-4 are runs of two tiles, and states of the first are not kept. What is promised
// is what is done.
TEST_F(RequeueTest, ADoneJobRendersFramesAgain) {
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    id = submit(service.endpoint()).version;
    EXPECT_EQ(finish(service.endpoint(), worker, id), kNumTasks);
  }
  // In the archive it is another coordinator's, too.
  const RunningService service(options);
  const std::string& endpoint = service.endpoint();
  const RequeuePlan second = plan(endpoint, {FrameNumber(3)});
  EXPECT_THAT(second.plan, HasSubstr("frame 3 is rendered again, from the first frame on"));
  EXPECT_THAT(second.plan,
              HasSubstr("frames 1-2,4 are rendered once more with them, and not written"));
  EXPECT_EQ(show(endpoint, id).summary.status, JobStatus::done) << "it was only asked";
  EXPECT_THAT(requeues(endpoint), IsEmpty());

  FakeWorker worker(endpoint, store(), job);
  worker.hello();
  submit(endpoint, {FrameNumber(3)});
  EXPECT_EQ(show(endpoint, id).summary.status, JobStatus::running);
  EXPECT_EQ(show(endpoint, id).frames_done.size(), 3u);
  EXPECT_EQ(finish(endpoint, worker, id), static_cast<int>(second.num_tasks));
  ASSERT_THAT(requeues(endpoint), SizeIs(1));
  EXPECT_EQ(requeues(endpoint)[0].reason, "frames 3");

  // All of them: from the first one on.
  const std::vector<FrameNumber> all{FrameNumber(1), FrameNumber(2), FrameNumber(3),
                                     FrameNumber(4)};
  EXPECT_THAT(plan(endpoint, all).plan, HasSubstr("1-4 are rendered again, from the first frame"));
  EXPECT_EQ(plan(endpoint, all).num_tasks, static_cast<std::uint64_t>(kNumTasks));
  submit(endpoint, all);
  EXPECT_EQ(finish(endpoint, worker, id), kNumTasks);
}

TEST_F(RequeueTest, AnOpenJobDoesTheSameAndAPausedOneStaysPaused) {
  Busy farm(*this);
  auto& [service, endpoint, worker, id] = farm;
  EXPECT_EQ(plan(endpoint, {FrameNumber(1)}).num_tasks, 0u) << "nothing is done";
  EXPECT_THAT(plan(endpoint, {FrameNumber(1)}).plan, HasSubstr("frame 1 is not written yet"));
  while (show(endpoint, id).frames_done.size() < 2) do_one_task(worker);
  const std::uint64_t done = show(endpoint, id).summary.tasks_done;
  const RequeuePlan wanted = plan(endpoint, {FrameNumber(2)});
  EXPECT_THAT(wanted.plan, HasSubstr("frame 2 is rendered again, from the first frame on"));
  ask<ShownJob>(endpoint, PauseJob{"test"});
  submit(endpoint, {FrameNumber(2)});
  EXPECT_EQ(show(endpoint, id).summary.status, JobStatus::paused);
  EXPECT_EQ(show(endpoint, id).summary.tasks_done, done - wanted.num_tasks);
  ask<ShownJob>(endpoint, ResumeJob{"test"});
  finish(endpoint, worker, id);
}

// What is in work for these frames was made of what is not wanted: its result counts for nothing.
TEST_F(RequeueTest, WhatIsInWorkIsTakenBack) {
  Busy farm(*this);
  auto& [service, endpoint, worker, id] = farm;
  LeaseId lease;
  for (;;) {
    worker.say(LeaseRequest{1});
    lease = worker.expect<LeaseGrant>().lease;
    if (lease.task.kind == TaskKind::assemble) break;
    worker.say(worker.work(lease));
  }
  const TaskDone late = worker.work(lease);
  submit(endpoint, {FrameNumber(1), FrameNumber(2)});
  EXPECT_EQ(worker.expect<LeaseRevoke>().lease, lease);
  worker.say(late);
  worker.expect<ReportReceived>();
  EXPECT_TRUE(show(endpoint, id).frames_done.empty());
  finish(endpoint, worker, id);
  for (const FarmEvent& event : ask<EventList>(endpoint, ListEvents{"test"}).events)
    EXPECT_NE(event.kind, FarmEventKind::task_lost) << event.reason;
}

// Nobody has changed the frame while it was locked: it is the job's again, and rendered.
TEST_F(RequeueTest, AFrameThatWasLockedMeanwhileIsTheJobsAgain) {
  for (const bool has_ended : {false, true}) {
    Busy farm(*this);
    auto& [service, endpoint, worker, id] = farm;
    finish(endpoint, worker, id);
    submit(endpoint, {FrameNumber(3)});
    ask<ShownJob>(endpoint, LockFrames{"test", {FrameNumber(3)}});
    if (has_ended) finish(endpoint, worker, id);
    ask<ShownJob>(endpoint, LockFrames{"test", {FrameNumber(3)}, /*off=*/true});
    finish(endpoint, worker, id);
  }
}

// A job that has ended before its end goes on with all that is left, and says so.
TEST_F(RequeueTest, ACancelledJobSaysThatItGoesOn) {
  Busy farm(*this);
  auto& [service, endpoint, worker, id] = farm;
  while (show(endpoint, id).frames_done.size() < 2) do_one_task(worker);
  ask<ShownJob>(endpoint, CancelJob{"test"});
  const RequeuePlan wanted = plan(endpoint, {FrameNumber(1)});
  EXPECT_THAT(wanted.plan,
              HasSubstr("frames 3-4 are rendered, too: the job is cancelled and goes on"));
  submit(endpoint, {FrameNumber(1)});
  EXPECT_EQ(finish(endpoint, worker, id), static_cast<int>(wanted.num_tasks));
}

// What was wanted again, and was not begun, is as it was.
TEST_F(RequeueTest, AFrameThatIsNotMadeAgainStaysTheJobs) {
  Busy farm(*this);
  auto& [service, endpoint, worker, id] = farm;
  finish(endpoint, worker, id);
  const std::vector<FrameNumber> all{FrameNumber(1), FrameNumber(2), FrameNumber(3),
                                     FrameNumber(4)};
  submit(endpoint, all);
  const auto before = ask<PictureSource>(endpoint, AskPicture{"test"});
  EXPECT_EQ(before.frame, FrameNumber(4));
  EXPECT_TRUE(before.is_written);
  EXPECT_THAT(before.note, HasSubstr("as it was before"));
  // One is gone, and one is another picture: those are not.
  fs::remove(frame_path(job, FrameIndex(0)));
  ASSERT_TRUE(write_file_atomic(frame_path(job, FrameIndex(1)), as_bytes_view("another")).ok());
  ask<ShownJob>(endpoint, CancelJob{"test"});
  const JobDetail detail = show(endpoint, id);
  EXPECT_EQ(detail.summary.status, JobStatus::cancelled);
  EXPECT_EQ(detail.frames_done, (std::vector<FrameNumber>{FrameNumber(3), FrameNumber(4)}));
  EXPECT_EQ(detail.summary.frames_done, 2u);
  EXPECT_EQ(detail.summary.tasks_done, 2u);
  EXPECT_EQ(ask<PictureSource>(endpoint, AskPicture{"test"}).frame, FrameNumber(4));
  // What is not there is made: two frames of two tiles in one run.
  submit(endpoint);
  EXPECT_EQ(show(endpoint, id).frames_done.size(), 2u);
  EXPECT_EQ(finish(endpoint, worker, id), 4);
}

TEST_F(RequeueTest, LockedAndUnknownFramesAreRefused) {
  Busy farm(*this);
  auto& [service, endpoint, worker, id] = farm;
  finish(endpoint, worker, id);
  ask<ShownJob>(endpoint, LockFrames{"test", {FrameNumber(2)}});
  for (const Message& question :
       {Message(AskRequeue{"test", {FrameNumber(2), FrameNumber(3)}}),
        Message(SubmitJob{document, false, true, {FrameNumber(2), FrameNumber(3)}})}) {
    EXPECT_THAT(refused(endpoint, question).message, HasSubstr("frame 2 is locked"));
  }
  for (const Message& question : {Message(AskRequeue{"test", {FrameNumber(9)}}),
                                  Message(SubmitJob{document, false, true, {FrameNumber(9)}})}) {
    EXPECT_THAT(refused(endpoint, question).message,
                HasSubstr("no frames 9, expected some of 1-4"));
  }
  EXPECT_EQ(show(endpoint, id).summary.status, JobStatus::done);
}

TEST_F(RequeueTest, APictureIsTheLastFrameOrTheTilesOfOneInWork) {
  Busy farm(*this);
  auto& [service, endpoint, worker, id] = farm;
  const AskPicture last{"test"}, partial{"test", false, FrameNumber(0), true};
  EXPECT_THAT(refused(endpoint, last).message, HasSubstr("no frame is written yet"));
  EXPECT_THAT(refused(endpoint, partial).message, HasSubstr("no tile of frame 1 is finished yet"));
  EXPECT_THAT(refused(endpoint, AskPicture{"test", true, FrameNumber(9)}).message,
              HasSubstr("no frames 9, expected some of 1-4"));

  do_one_task(worker);
  const auto tiles = ask<PictureSource>(endpoint, partial);
  EXPECT_EQ(tiles.frame, FrameNumber(1));
  EXPECT_FALSE(tiles.is_written);
  EXPECT_EQ(tiles.num_tiles, 2);
  ASSERT_THAT(tiles.films, SizeIs(1));
  EXPECT_TRUE(BlobStore::open(tiles.store_directory)->contains(tiles.films[0].digest));
  EXPECT_THAT(refused(endpoint, last).message, HasSubstr("no frame is written yet"));

  while (show(endpoint, id).frames_done.size() < 2) do_one_task(worker);
  EXPECT_EQ(ask<PictureSource>(endpoint, last).frame, FrameNumber(2));
  EXPECT_EQ(ask<PictureSource>(endpoint, AskPicture{"test", true, FrameNumber(1)}).file,
            frame_path(job, FrameIndex(0)).string());
  finish(endpoint, worker, id);
  for (const AskPicture& question : {last, partial}) {
    const auto written = ask<PictureSource>(endpoint, question);
    EXPECT_TRUE(written.is_written);
    EXPECT_EQ(written.frame, FrameNumber(4));
  }
}

// When a job will be done is known as soon as the coordinator is back.
// What a task made before it was opened again is known to every coordinator, until somebody begins
// the job again.
TEST_F(RequeueTest, WhatComesOutOtherwiseIsToldWhateverCameBetween) {
  enum class Between { nothing, restart, cancel_and_retry, retry_and_restart };
  for (const Between between : {Between::nothing, Between::restart, Between::cancel_and_retry,
                                Between::retry_and_restart}) {
    options.work_dir = folder / std::to_string(static_cast<int>(between));
    job.output.directory = (options.work_dir / "frames").string();
    document = make_job_document(job).value();
    std::optional<RunningService> service(std::in_place, options);
    Digest id;
    {
      FakeWorker worker(service->endpoint(), store(), job);
      worker.hello();
      id = ask<JobAccepted>(service->endpoint(), SubmitJob{document}).version;
      finish(service->endpoint(), worker, id);
    }
    submit(service->endpoint(), {FrameNumber(3)});
    const bool is_retried =
        between == Between::cancel_and_retry || between == Between::retry_and_restart;
    if (is_retried) {
      ask<ShownJob>(service->endpoint(), CancelJob{"test"});
      submit(service->endpoint(), {FrameNumber(3)});
    }
    if (between == Between::restart || between == Between::retry_and_restart)
      service.emplace(options);

    JobSpec other = job;
    ++other.seed;
    FakeWorker evil(service->endpoint(), store(), other, "evil");
    evil.hello();
    evil.expect<WorkerWelcome>();
    while (!HasFailure() && show(service->endpoint(), id).summary.status == JobStatus::running &&
           show(service->endpoint(), id).summary.tasks_done < kNumTasks)
      do_one_task(evil);
    const JobDetail job_now = show_end(service->endpoint(), id);
    EXPECT_EQ(job_now.summary.status, JobStatus::paused) << static_cast<int>(between);
    EXPECT_THAT(job_now.waits, HasSubstr("evil")) << static_cast<int>(between);
  }
}

// What a folder says in the place of Baton's marks is that folder's matter.
TEST_F(RequeueTest, WhateverStandsInThePlaceOfALockFileEndsNoCoordinator) {
  for (const bool is_link : {false, true}) {
    options.work_dir = folder / (is_link ? "link" : "folder");
    job.output.directory = (folder / (is_link ? "beside link" : "beside folder")).string();
    document = make_job_document(job).value();
    Busy farm(*this);
    const std::string& endpoint = farm.endpoint;
    finish(endpoint, farm.worker, farm.id);
    ask<ShownJob>(endpoint, LockFrames{"test", {FrameNumber(2)}});
    const fs::path file =
        lock_folder(job.output.directory) / show_identity(endpoint, "test").id.hex();
    ASSERT_TRUE(fs::remove(file));
    if (is_link) {
      fs::create_symlink("/nowhere", file);
    } else {
      fs::create_directory(file);
    }
    {
      ServiceOptions other = options;
      other.work_dir = folder / "copy";
      fs::remove_all(other.work_dir);
      fs::copy(options.work_dir, other.work_dir, fs::copy_options::recursive);
      const RunningService again(other);
      EXPECT_EQ(show(again.endpoint(), farm.id).summary.status, JobStatus::done);
    }
    if (is_link) {
      ask<JobAccepted>(endpoint, SubmitJob{document});
    } else {
      EXPECT_THAT(refused(endpoint, SubmitJob{document}).message, HasSubstr(file.string()));
    }
    ask<ShownJob>(endpoint, LockFrames{"test", {FrameNumber(2)}, /*off=*/true});
    ask<JobList>(endpoint, DeleteJob{"test"});
  }
}

TEST_F(RequeueTest, AMarkThatCouldNotBeWrittenIsWrittenOnceAWorkerMissesIt) {
  Busy farm(*this);
  const std::string& endpoint = farm.endpoint;
  do_one_task(farm.worker);
  fs::path mark;
  for (const auto& entry : fs::directory_iterator(job.output.directory)) {
    if (entry.path().filename().string().starts_with(".baton-")) mark = entry.path();
  }
  ASSERT_TRUE(fs::is_regular_file(mark));
  ask<ShownJob>(endpoint, CancelJob{"test"});
  ASSERT_FALSE(fs::exists(mark));
  fs::create_directory(mark);
  submit(endpoint);
  fs::remove(mark);
  farm.worker.say(LeaseRequest{1});
  farm.worker.say(LeaseReturn{farm.worker.expect<LeaseGrant>().lease, "/frames: no mark"});
  farm.worker.say(Heartbeat{});
  farm.worker.expect<Heartbeat>();
  EXPECT_TRUE(fs::is_regular_file(mark));
}

TEST_F(RequeueTest, TimesAreThoseOfTheLastRendering) {
  Busy farm(*this);
  const std::string& endpoint = farm.endpoint;
  finish(endpoint, farm.worker, farm.id);
  const JobTimes times = show_identity(endpoint, "test").times;
  std::this_thread::sleep_for(10ms);
  submit(endpoint);
  EXPECT_EQ(show_end(endpoint, farm.id).summary.status, JobStatus::done);
  EXPECT_EQ(show_identity(endpoint, "test").times, times) << "nothing was rendered";
  submit(endpoint, {FrameNumber(3)});
  finish(endpoint, farm.worker, farm.id);
  EXPECT_GT(show_identity(endpoint, "test").times.started_ms, times.ended_ms);
}

TEST_F(RequeueTest, WorkersSayThatTheyDrain) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  worker.say(Heartbeat{{}, /*is_draining=*/true, 5u << 20});
  worker.expect<Heartbeat>();
  const JobList list = ask<JobList>(service.endpoint(), ListJobs{});
  ASSERT_THAT(list.workers, SizeIs(1));
  EXPECT_EQ(list.workers[0].activity, WorkerActivity::draining);
  EXPECT_EQ(list.workers[0].memory_bytes, 5u << 20);
}

// A worker that sees nothing of the job helps nobody, however many threads it has.
TEST_F(RequeueTest, EtasCountThoseWhoGetTasksAlone) {
  job.image = {.width = 64, .height = 32, .sites = 1, .tile_size = 8};  // 32 tiles go side by side
  job.frames.clear();
  for (int frame = 1; frame <= 16; ++frame) job.frames.emplace_back(frame);
  document = make_job_document(job).value();
  Busy farm(*this);
  const std::string& endpoint = farm.endpoint;
  FakeWorker blind(endpoint, store(), job, "blind");
  const auto likely_s = [&](bool is_blind_there) {
    for (int beat = 0; beat < 7; ++beat) {  // what was found is told for two seconds
      std::this_thread::sleep_for(300ms);
      farm.worker.say(Heartbeat{});
      farm.worker.expect<Heartbeat>();
      if (!is_blind_there) continue;
      blind.say(Heartbeat{});
      blind.expect<Heartbeat>();
    }
    return ask<ShownJob>(endpoint, ShowJob{"test"}).now.eta.likely_s;
  };
  while (show(endpoint, farm.id).frames_done.size() < 6) do_one_task(farm.worker);
  const double before_s = likely_s(false);
  ASSERT_GT(before_s, 0);
  blind.say(WorkerHello{"blind", "host", 9, 9, 64, build_identity(), "TEST", {}});
  blind.expect<WorkerWelcome>();
  blind.say(LeaseRequest{1});
  blind.say(LeaseReturn{blind.expect<LeaseGrant>().lease, "/frames: not here"});
  EXPECT_GT(likely_s(true), 0.5 * before_s);
}

TEST_F(RequeueTest, EtasOutlastTheCoordinator) {
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    id = submit(service.endpoint()).version;
    while (show(service.endpoint(), id).summary.tasks_done < kNumTasks - 1) do_one_task(worker);
  }
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  EXPECT_TRUE(ask<ShownJob>(service.endpoint(), ShowJob{id.hex()}).now.eta.is_known());
}

}  // namespace
}  // namespace baton::testing_service
