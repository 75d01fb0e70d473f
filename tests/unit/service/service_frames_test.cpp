#include <gmock/gmock.h>

#include <fstream>

#include "tests/unit/service/frames_fixture.h"

/// Frames that were reported, and are gone or others before their job is done.
namespace baton {
namespace {

using namespace testing_service;
using testing::HasSubstr;

TEST_F(FramesTest, WhatIsGoneCutOrDamagedIsMadeAgainBeforeTheJobIsDone) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const std::string image = "image of seed " + std::to_string(job.seed);
  for (const std::string harm : {"gone", "cut", "changed", "none"}) {
    SCOPED_TRACE(harm);
    ask<JobList>(service.endpoint(), ListJobs{});
    const Digest id = begin(service.endpoint(), worker);
    if (harm == "gone") fs::remove(frame(1));
    if (harm == "cut") fs::resize_file(frame(1), 3);
    if (harm == "changed") put(1, "imagE" + image.substr(5));
    const JobDetail detail = finish(service.endpoint(), worker, id);
    EXPECT_EQ(detail.summary.status, JobStatus::done);
    EXPECT_EQ(detail.summary.frames_done, 4u);
    for (int number = 1; number <= 4; ++number)
      EXPECT_EQ(read_text_file(frame(number), 100).value(), image);
    EXPECT_EQ(num_read, harm == "gone" || harm == "none" ? 0 : 1) << "only what has changed";
    EXPECT_FALSE(fs::exists(mark(id)));
    num_read = 0;
    ask<JobList>(service.endpoint(), DeleteJob{id.hex()});
    fs::remove_all(job.output.directory);
  }
}

// Whatever happens between the last report and the end.
TEST_F(FramesTest, ACoordinatorThatEndsWhileItLooksLooksAgain) {
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    id = begin(service.endpoint(), worker);
  }
  fs::remove(frame(2));
  fs::resize_file(frame(3), 3);
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_TRUE(fs::exists(frame(2)));
  EXPECT_GT(fs::file_size(frame(3)), 3u);
  EXPECT_EQ(num_read, 1) << "how the others stood is in the journal";
}

TEST_F(FramesTest, ThePictureOfSomebodyElseIsKeptAndTheJobFails) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  put(2, std::string(kPicture));
  JobDetail detail = finish(service.endpoint(), worker, id);
  EXPECT_EQ(detail.summary.status, JobStatus::failed);
  EXPECT_THAT(detail.waits, HasSubstr("frame.0002.exr is not what a job has written"));
  EXPECT_THAT(detail.waits, HasSubstr("--restart"));
  EXPECT_EQ(read_text_file(frame(2), 100).value(), kPicture);

  // It stays until somebody says otherwise; and the same picture with other settings keeps it, too.
  JobSpec urgent = job;
  urgent.priority = 7;
  for (const std::string& again : {document, make_job_document(urgent).value()}) {
    const Error refusal = refused(service.endpoint(), SubmitJob{again});
    EXPECT_EQ(refusal.kind, ErrorKind::io);
    EXPECT_THAT(refusal.message, HasSubstr("frame.0002.exr is not what a job has written"));
  }
  EXPECT_EQ(read_text_file(frame(2), 100).value(), kPicture);
  EXPECT_EQ(ask<JobAccepted>(service.endpoint(), SubmitJob{document, true}).version, id);
  detail = finish(service.endpoint(), worker, id);
  EXPECT_EQ(detail.summary.status, JobStatus::done);
  EXPECT_THAT(read_text_file(frame(2), 100).value(), HasSubstr("image of seed"));
}

// Its worker was late: the header names a job that has not reported the frame.
TEST_F(FramesTest, ThePictureOfAFormerJobOfTheFolderIsMadeAgain) {
  const RunningService service(options);
  const Digest former = submit_former(service.endpoint());
  FakeWorker worker(service.endpoint(), store(), job),
      late(service.endpoint(), store(), job, "late");
  late.hello();
  wait_for_frame_2(late);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  worker.hello();
  while (show(service.endpoint(), id).summary.tasks_done + 1 < kNumTasks) {
    worker.do_one_task();
    sync(worker);
  }
  put(2, std::string(kPicture) + writer_of(former));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_THAT(read_text_file(frame(2), 100).value(), HasSubstr("image of seed"));
}

TEST_F(FramesTest, AFolderThatLostItsMarkIsNotTheFolder) {
  const fs::path out = job.output.directory, away = out.string() + ".away";
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  fs::rename(out, away);
  JobDetail detail = finish(service.endpoint(), worker, id);
  EXPECT_EQ(detail.summary.status, JobStatus::paused);
  EXPECT_EQ(detail.summary.tasks_done, 7u) << "nothing is taken for lost, or for written";
  EXPECT_THAT(detail.waits, HasSubstr(out.string()));
  EXPECT_THAT(detail.waits, HasSubstr("is gone from it"));
  worker.say(JobDocumentRequest{id});
  worker.expect<JobDocument>();
  EXPECT_FALSE(fs::exists(mark(id))) << "not made anew";
  EXPECT_THAT(refused(service.endpoint(), ResumeJob{id.hex()}).message, HasSubstr("stays paused"));
  const Error refusal = refused(service.endpoint(), SubmitJob{document});
  EXPECT_EQ(refusal.kind, ErrorKind::io);
  EXPECT_THAT(refusal.message, HasSubstr("is gone from it"));

  // It is back.
  fs::remove_all(out);
  EXPECT_THAT(refused(service.endpoint(), ResumeJob{id.hex()}).message, HasSubstr("is not there"));
  fs::rename(away, out);
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), ResumeJob{id.hex()}).detail.summary.status,
            JobStatus::running);
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  for (int number = 1; number <= 4; ++number) EXPECT_TRUE(fs::exists(frame(number)));
}

// Nobody could see another in its place: the job waits, however often it is asked.
TEST_F(FramesTest, AFolderInThePlaceOfTheMarkIsSaid) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  fs::remove(mark(id));
  fs::create_directory(mark(id));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::paused);
  for (int i = 0; i < 2; ++i) {
    EXPECT_THAT(refused(service.endpoint(), ResumeJob{id.hex()}).message,
                HasSubstr(mark(id).filename().string() + " in it is another's"));
  }
  fs::remove(mark(id));
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), ResumeJob{id.hex()}).detail.summary.status,
            JobStatus::running);
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
}

// Frames without a mark are proof enough; no frames are none, but to whoever says --restart.
TEST_F(FramesTest, OnlyAFolderWithAllFramesIsMarkedAgain) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  fs::remove(mark(id));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::paused);
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), ResumeJob{id.hex()}).detail.summary.status,
            JobStatus::running);
  EXPECT_TRUE(fs::exists(mark(id)));
  fs::remove(mark(id));
  fs::remove(frame(1));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::paused);
  EXPECT_THAT(refused(service.endpoint(), ResumeJob{id.hex()}).message, HasSubstr("stays paused"));
  ask<JobAccepted>(service.endpoint(), SubmitJob{document, true});
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_TRUE(fs::exists(frame(1)));
}

// What another machine has written may be late here; the worker repeats its report.
TEST_F(FramesTest, AFileThatIsLateIsWaitedFor) {
  options.file_patience = kPatience;
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  for (int i = 0; i < 3; ++i) {
    worker.say(LeaseRequest{1});
    const TaskDone report = worker.work(worker.expect<LeaseGrant>().lease);
    const BlobRef& output = report.made.outputs.front();
    const fs::path file = output.kind == BlobKind::image
                              ? frame_path(job, output.frame())
                              : BlobStore::open(store())->path(output.digest);
    fs::rename(file, folder / "late");
    worker.say(report);
    worker.say(Heartbeat{{report.lease}});
    worker.expect<Heartbeat>();
    EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, static_cast<std::uint64_t>(i));
    fs::rename(folder / "late", file);
    worker.say(report);
    EXPECT_EQ(worker.expect<ReportReceived>().lease, report.lease);
  }
  const JobDetail detail = show(service.endpoint(), id);
  EXPECT_EQ(detail.summary.tasks_done, 3u);
  EXPECT_EQ(detail.summary.attempts_lost, 0u);
}

// An error of the disk may pass; one that stays pauses the job, and hides no other frame.
TEST_F(FramesTest, AFrameThatCannotBeReadIsWaitedForThenPausesTheJob) {
  for (const bool passes : {true, false}) {
    options.file_patience = passes ? std::chrono::milliseconds(kPatience) : 1500ms;
    options.work_dir = folder / (passes ? "passes" : "stays");
    fs::remove_all(job.output.directory);
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    broken = "frame.0002.exr";
    const Digest id = begin(service.endpoint(), worker);
    for (const int number : {1, 2})
      fs::last_write_time(frame(number), fs::last_write_time(frame(number)) + 1s);
    worker.do_one_task();
    sync(worker);
    std::this_thread::sleep_for(700ms);
    EXPECT_EQ(show(service.endpoint(), id).summary.status, JobStatus::running);
    if (passes) broken = "";
    const JobDetail detail = show_end(service.endpoint(), id);
    EXPECT_EQ(detail.summary.status, passes ? JobStatus::done : JobStatus::paused);
    if (!passes) {
      EXPECT_THAT(detail.waits, HasSubstr("frame.0002.exr: cannot read: Input/output error"));
      fs::remove(frame(3));
      EXPECT_THAT(refused(service.endpoint(), SubmitJob{document}).message,
                  HasSubstr("Input/output error"));
      broken = "";
      EXPECT_THAT(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).plan,
                  HasSubstr("frame.0003.exr is gone"));
    }
  }
}

TEST_F(FramesTest, AnotherFolderIsFoundOutAtTheStart) {
  const fs::path out = job.output.directory, away = out.string() + ".away";
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    id = begin(service.endpoint(), worker);
  }
  fs::rename(out, away);
  fs::create_directories(out);
  const RunningService service(options);
  const JobDetail detail = show(service.endpoint(), id);
  EXPECT_EQ(detail.summary.status, JobStatus::paused);
  EXPECT_EQ(detail.summary.tasks_done, 7u);
  EXPECT_THAT(detail.waits, HasSubstr("is gone from it"));
}

TEST_F(FramesTest, AThousandFramesThatStandAsReportedAreNotRead) {
  job.frames.clear();
  for (int number = 1; number <= 1000; ++number) job.frames.emplace_back(number);
  job.state.carry = false;
  job.image.tile_size = 16;
  document = make_job_document(job).value();
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  worker.hello();
  constexpr int kAtOnce = 50;
  const std::uint64_t num_tasks = show(service.endpoint(), id).summary.tasks_total;
  ASSERT_EQ(num_tasks % kAtOnce, 0u);
  for (std::uint64_t i = 0; i < num_tasks / kAtOnce; ++i) {
    worker.say(LeaseRequest{kAtOnce});
    for (int k = 0; k < kAtOnce; ++k) worker.say(worker.work(worker.expect<LeaseGrant>().lease));
  }
  sync(worker);
  EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
  EXPECT_EQ(num_read, 0);
}

// Workers that have its document from before do not ask again, and render nothing without a mark.
TEST_F(FramesTest, AnOpenJobHasItsMarkBeforeAnybodyAsksForItsDocument) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  EXPECT_TRUE(fs::exists(mark(id)));
  ask<ShownJob>(service.endpoint(), CancelJob{id.hex()}).detail;
  fs::remove_all(job.output.directory);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_TRUE(fs::exists(mark(id)));
}

// A frame that was readable meanwhile is waited for anew.
TEST_F(FramesTest, PatienceBeginsAnewOnceAFrameWasReadable) {
  options.file_patience = 1500ms;
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  ask<ShownJob>(service.endpoint(), PauseJob{id.hex()});
  const auto touch = [&] { fs::last_write_time(frame(2), fs::last_write_time(frame(2)) + 1s); };
  const auto refusal = [&] { return refused(service.endpoint(), ResumeJob{id.hex()}).kind; };
  broken = "frame.0002.exr";
  touch();
  EXPECT_EQ(refusal(), ErrorKind::timeout);
  broken = "";
  ask<ShownJob>(service.endpoint(), ResumeJob{id.hex()});
  ask<ShownJob>(service.endpoint(), PauseJob{id.hex()});
  std::this_thread::sleep_for(1600ms);
  broken = "frame.0002.exr";
  touch();
  EXPECT_EQ(refusal(), ErrorKind::timeout);
  std::this_thread::sleep_for(1600ms);
  EXPECT_EQ(refusal(), ErrorKind::io);
}

}  // namespace
}  // namespace baton
