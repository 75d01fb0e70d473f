#include <gmock/gmock.h>

#include <fstream>

#include "common/store/folder_token.h"
#include "coordinator/service/service.h"
#include "tests/unit/service/fake_farm.h"

/// Frames that were reported, and are gone or others before their job is done.
namespace baton {
namespace {

using namespace testing_service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

/// A file that begins so is a whole picture; the rest names the job that wrote it.
constexpr std::string_view kPicture = "picture of ";

struct FramesTest : ServiceTest {
  std::atomic<int> num_read{0};
  /// File name of a frame that gives an error when it is read.
  std::atomic<const char*> broken = "";

  void SetUp() override {
    ServiceTest::SetUp();
    options.disk.digest = [this](const fs::path& path) -> Result<Digest> {
      if (path.filename() == broken.load())
        return Error{ErrorKind::io, path.string() + ": cannot read: Input/output error"};
      if (path.extension() == ".exr") ++num_read;
      return digest_of_file(path);
    };
    options.disk.picture_writer = [](const fs::path& path) -> std::optional<std::string> {
      const std::string text = read_text_file(path, 1 << 20).value();
      if (!text.starts_with(kPicture)) return std::nullopt;
      return text.substr(kPicture.size());
    };
  }

  fs::path frame(int number) const {
    return fs::path(job.output.directory) / ("frame.000" + std::to_string(number) + ".exr");
  }
  void put(int number, const std::string& text) const {
    ASSERT_TRUE(write_file_atomic(frame(number), as_bytes_view(text)).ok());
  }
  fs::path mark(const Digest& id) const {
    return fs::path(job.output.directory) / (".baton-" + id.short_hex());
  }

  /// Submits the job, has its folder marked, and does all but its last task.
  Digest begin(const std::string& endpoint, FakeWorker& worker) {
    const Digest id = ask<JobAccepted>(endpoint, SubmitJob{document}).version;
    worker.hello();
    worker.say(JobDocumentRequest{id});
    EXPECT_FALSE(worker.expect<JobDocument>().token.empty());
    for (int i = 0; i < kNumTasks - 1; ++i) worker.do_one_task();
    sync(worker);
    return id;
  }
  /// Does what there is, until the job has ended.
  JobDetail finish(const std::string& endpoint, FakeWorker& worker, const Digest& id) {
    for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
         std::chrono::steady_clock::now() < deadline;) {
      sync(worker);  // what it has said is known
      const JobDetail detail = show(endpoint, id);
      if (detail.summary.status != JobStatus::running) return detail;
      if (detail.summary.tasks_done == detail.summary.tasks_total) continue;
      worker.do_one_task();
      sync(worker);
    }
    ADD_FAILURE() << "the job does not end";
    return show(endpoint, id);
  }
  std::vector<FrameNumber> locked_frames(const std::string& endpoint, const Digest& id) {
    return ask<ShownJob>(endpoint, ShowJob{id.hex()}).locked;
  }
  static void sync(FakeWorker& worker) {
    worker.say(LeaseRequest{0});
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
  }
};

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
  JobSpec urgent = job;
  urgent.priority = 7;
  const Digest former =
      ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(urgent).value()}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  put(2, std::string(kPicture) + former.hex());
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
  const fs::path mark = output_token_file(job.output.directory, id);
  EXPECT_TRUE(fs::exists(mark));
  ask<ShownJob>(service.endpoint(), CancelJob{id.hex()}).detail;
  fs::remove_all(job.output.directory);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_TRUE(fs::exists(mark));
}

// ---- locked frames ------------------------------------------------------------------------------

TEST_F(FramesTest, ALockedFrameStaysWhateverComes) {
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    id = begin(service.endpoint(), worker);
    put(2, std::string(kPicture));
    const ShownJob locked =
        ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}});
    EXPECT_THAT(locked.locked, ElementsAre(FrameNumber(2)));
    EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  }
  // Through a restart of the coordinator, another version and another picture.
  const RunningService service(options);
  EXPECT_THAT(locked_frames(service.endpoint(), id), ElementsAre(FrameNumber(2)));
  job.priority = 7;
  for (const std::uint64_t seed : {job.seed, job.seed + 1}) {
    job.seed = seed;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    const JobAccepted accepted = ask<JobAccepted>(
        service.endpoint(), SubmitJob{make_job_document(job).value(), /*restart=*/true});
    EXPECT_THAT(locked_frames(service.endpoint(), accepted.version), ElementsAre(FrameNumber(2)));
    EXPECT_THAT(accepted.plan, HasSubstr("frame 2 is locked and stays as it is"));
    EXPECT_EQ(finish(service.endpoint(), worker, accepted.version).summary.status, JobStatus::done);
    EXPECT_EQ(read_text_file(frame(2), 100).value(), kPicture);
    EXPECT_EQ(read_text_file(frame(3), 100).value(), "image of seed " + std::to_string(seed));
  }
  EXPECT_EQ(num_read, 3) << "the others once; a locked frame is not read";

  // A job of another name does not write it either, until it is unlocked.
  JobSpec other = job;
  other.name = "other";
  const Error refusal =
      refused(service.endpoint(), SubmitJob{make_job_document(other).value(), /*restart=*/true});
  EXPECT_THAT(refusal.message, HasSubstr("frames 2 in"));
  EXPECT_THAT(refusal.message, HasSubstr("--off --frames 2` unlocks them"));
  ask<JobList>(service.endpoint(), DeleteJob{"test"});
  ask<JobAccepted>(service.endpoint(),
                   SubmitJob{make_job_document(other).value(), /*restart=*/true});
}

TEST_F(FramesTest, AFrameThatIsStillToBeRenderedCanBeLocked) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  put(4, std::string(kPicture));
  const JobDetail detail =
      ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(4)}}).detail;
  EXPECT_EQ(detail.summary.frames_done, 4u);
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_EQ(read_text_file(frame(4), 100).value(), kPicture);

  // Unlocked, it is nobody's picture again; once it is gone the job has a frame to make.
  ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(4)}, /*off=*/true});
  const std::string strange = refused(service.endpoint(), SubmitJob{document}).message;
  EXPECT_THAT(strange, HasSubstr("frame.0004.exr is not what a job has written"));
  EXPECT_THAT(strange, HasSubstr("--frames 4` keeps it for good"));
  fs::remove(frame(4));
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_THAT(read_text_file(frame(4), 100).value(), HasSubstr("image of seed"));
}

TEST_F(FramesTest, ALockedFrameThatIsGoneIsToldOf) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(1), FrameNumber(3)}});
  fs::remove(frame(3));
  const JobDetail detail = finish(service.endpoint(), worker, id);
  EXPECT_EQ(detail.summary.status, JobStatus::failed);
  const std::string words = "frame.0003.exr is locked and not there: put it back";
  EXPECT_THAT(detail.waits, HasSubstr(words));
  for (const bool restart : {false, true}) {
    const Error refusal = refused(service.endpoint(), SubmitJob{document, restart});
    EXPECT_EQ(refusal.kind, ErrorKind::io);
    EXPECT_THAT(refusal.message, HasSubstr(words));
  }
  EXPECT_FALSE(fs::exists(frame(3)));
  ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(3)}, /*off=*/true});
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_TRUE(fs::exists(frame(3)));
}

TEST_F(FramesTest, OnlyFramesThatAreThereCanBeLocked) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  const std::vector<FrameNumber> unknown{FrameNumber(1), FrameNumber(9)};
  Error refusal = refused(service.endpoint(), LockFrames{id.hex(), unknown});
  EXPECT_EQ(refusal.kind, ErrorKind::bad_input);
  EXPECT_THAT(refusal.message, HasSubstr("it has no frames 9, expected some of 1-4"));
  refusal = refused(service.endpoint(), LockFrames{id.hex(), {FrameNumber(4)}});
  EXPECT_THAT(refusal.message, HasSubstr("frame.0004.exr: is not there, and cannot be locked"));
  refusal = refused(service.endpoint(), LockFrames{id.hex(), {FrameNumber(1)}, /*off=*/true});
  EXPECT_THAT(refusal.message, HasSubstr("frames 1 are not locked"));
  EXPECT_THAT(locked_frames(service.endpoint(), id), SizeIs(0));

  // One that a worker is writing: the client asks again.
  worker.say(LeaseRequest{1});
  const TaskDone report = worker.work(worker.expect<LeaseGrant>().lease);
  const fs::path path = frame(report.lease.task.frame().value() + 1);
  EXPECT_EQ(refused(service.endpoint(), LockFrames{id.hex(), {FrameNumber(4)}}).kind,
            ErrorKind::timeout);
  worker.say(report);
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_TRUE(fs::exists(path));
}

// In a renamed file, through a restart of the coordinator, and back when it is unlocked: workers
// ask the mark before a frame gets its name.
TEST_F(FramesTest, TheMarkSaysWhichFramesAreLocked) {
  Digest id;
  const auto marked = [&] { return read_text_file(mark(id), 1000).value(); };
  std::string token;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    id = begin(service.endpoint(), worker);
    token = marked();
    ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2), FrameNumber(3)}});
    EXPECT_EQ(marked(), token + "\n2-3");
    ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}, /*off=*/true});
    EXPECT_EQ(marked(), token + "\n3");
  }
  // Whoever was killed between the lock and its commit leaves a mark that says too much.
  ASSERT_TRUE(write_token(mark(id), token, "1-4"));
  const RunningService service(options);
  EXPECT_EQ(marked(), token + "\n3");
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_FALSE(fs::exists(mark(id))) << "all is done";
}

// ---- pictures in the places of frames -----------------------------------------------------------

/// Painted over, with the headers of the job that wrote the frame.
TEST_F(FramesTest, APaintedFrameThatNamesItsJobIsKeptWithoutRestart) {
  const RunningService service(options);
  for (const std::string how : {"done", "failed", "cancelled", "unlocked"}) {
    SCOPED_TRACE(how);
    FakeWorker worker(service.endpoint(), store(), job, "w" + how);
    const Digest id = begin(service.endpoint(), worker);
    const std::string painted = std::string(kPicture) + id.hex();
    if (how == "failed") put(2, painted);
    if (how == "cancelled") ask<ShownJob>(service.endpoint(), CancelJob{id.hex()});
    const JobStatus status = how == "cancelled"
                                 ? JobStatus::cancelled
                                 : finish(service.endpoint(), worker, id).summary.status;
    EXPECT_EQ(status, how == "failed"      ? JobStatus::failed
                      : how == "cancelled" ? JobStatus::cancelled
                                           : JobStatus::done);
    put(2, painted);
    if (how == "unlocked") {
      ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}});
      ask<JobAccepted>(service.endpoint(), SubmitJob{document});
      ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}, /*off=*/true});
    }
    const Error refusal = refused(service.endpoint(), SubmitJob{document});
    EXPECT_EQ(refusal.kind, ErrorKind::io);
    EXPECT_THAT(refusal.message, HasSubstr("frame.0002.exr is not what a job has written"));
    EXPECT_EQ(read_text_file(frame(2), 100).value(), painted);
    ask<JobAccepted>(service.endpoint(), SubmitJob{document, true});
    finish(service.endpoint(), worker, id);
    EXPECT_THAT(read_text_file(frame(2), 100).value(), HasSubstr("image of seed"));
    ask<JobList>(service.endpoint(), DeleteJob{id.hex()});
    fs::remove_all(job.output.directory);
    worker.say(WorkerGoodbye{});
  }
}

/// Does all but the assembly of frame 2, which a worker of its own has.
struct PlaceTest : FramesTest {
  std::string picture = "picture of somebody";

  LeaseId wait_for_frame_2(FakeWorker& worker) {
    for (int i = 0; i < 20; ++i) {
      worker.say(LeaseRequest{1});
      const LeaseGrant grant = worker.expect<LeaseGrant>();
      granted = grant.may_replace;
      if (grant.lease.task == assemble_task(FrameIndex(1))) return grant.lease;
      worker.say(worker.work(grant.lease));
    }
    ADD_FAILURE() << "frame 2 is not asked for";
    return {};
  }
  void say_taken(FakeWorker& worker, const LeaseId& lease, const std::string& writer) const {
    worker.say(LeaseReturn{lease, {}, {}, digest_of(picture), writer});
  }
  /// LeaseGrant::may_replace of the last grant.
  std::vector<Digest> granted;
};

TEST_F(PlaceTest, ThePictureOfSomebodyElseStaysAndTheJobFails) {
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    put(2, picture);
    const LeaseId lease = wait_for_frame_2(worker);
    EXPECT_THAT(granted, SizeIs(0));
    say_taken(worker, lease, "somebody");
    const JobDetail detail = finish(service.endpoint(), worker, id);
    EXPECT_EQ(detail.summary.status, JobStatus::failed);
    EXPECT_THAT(detail.waits, HasSubstr("frame.0002.exr is not what a job has written"));
    EXPECT_EQ(detail.summary.tasks_failed, 0u);
    EXPECT_EQ(read_text_file(frame(2), 100).value(), picture);
    EXPECT_THAT(refused(service.endpoint(), SubmitJob{document}).message,
                HasSubstr("frame.0002.exr is not what a job has written"));

    // Somebody gives it up, and the coordinator ends before it is replaced.
    ask<JobAccepted>(service.endpoint(), SubmitJob{document, true});
  }
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  const LeaseId lease = wait_for_frame_2(worker);
  EXPECT_THAT(granted, testing::Contains(digest_of(picture)));
  worker.say(worker.work(lease));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);

  // What was given up was that picture there, once.
  put(2, picture);
  EXPECT_THAT(refused(service.endpoint(), SubmitJob{document}).message,
              HasSubstr("frame.0002.exr is not what a job has written"));
}

TEST_F(PlaceTest, OnceItIsGoneTheFrameIsMade) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  put(2, picture);
  say_taken(worker, wait_for_frame_2(worker), {});
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::failed);
  fs::remove(frame(2));
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_THAT(read_text_file(frame(2), 100).value(), HasSubstr("image of seed"));
}

// A worker of a former version was late.
TEST_F(PlaceTest, WhatAFormerJobHasLeftMayGo) {
  const RunningService service(options);
  JobSpec urgent = job;
  urgent.priority = 7;
  const Digest former =
      ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(urgent).value()}).version;
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  put(2, picture);
  const LeaseId lease = wait_for_frame_2(worker);
  say_taken(worker, lease, former.hex());
  const LeaseId again = wait_for_frame_2(worker);
  EXPECT_NE(again, lease);
  EXPECT_THAT(granted, ElementsAre(digest_of(picture)));
  worker.say(worker.work(again));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
}

// ---- jobs that grow -----------------------------------------------------------------------------

struct GrowthTest : FramesTest {
  void SetUp() override {
    FramesTest::SetUp();
    job.sampling.method = Method::pool;
    job.state.carry = false;
    job.quality = {.rounds = 1, .sweeps = 2};
  }
  std::string document_of(int first, int last) {
    job.frames.clear();
    for (int frame = first; frame <= last; ++frame) job.frames.emplace_back(frame);
    return make_job_document(job).value();
  }
  /// Has the frames rendered, each as noisy as its number says.
  JobDetail render(const std::string& text, bool restart = false) {
    const Digest id = ask<JobAccepted>(endpoint, SubmitJob{text, restart}).version;
    FakeWorker worker(endpoint, store(), job, "w" + std::to_string(++num_workers));
    worker.hello();
    for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
         std::chrono::steady_clock::now() < deadline;) {
      const JobDetail detail = show(endpoint, id);
      if (detail.summary.status != JobStatus::running) return detail;
      if (detail.summary.tasks_done == detail.summary.tasks_total) continue;
      worker.say(LeaseRequest{1});
      const LeaseGrant grant = worker.expect<LeaseGrant>();
      TaskDone done = worker.work(grant.lease);
      if (grant.lease.task.kind == TaskKind::assemble) {
        const std::int32_t place = grant.lease.task.frame().value();
        const int number = job.frames[grant.lease.task.frame().index()].value();
        FrameStats stats{place, 0, {}};
        stats.quality.pixels = 1;
        stats.quality.cycles_noise = static_cast<float>(number);
        done.made.frames = {stats};
      }
      worker.say(done);
      sync(worker);
    }
    ADD_FAILURE() << "the job does not end";
    return {};
  }
  std::vector<std::string> growth() { return ask<ShownJob>(endpoint, ShowJob{job.name}).growth; }
  int num_workers = 0;
  std::string endpoint;
};

TEST_F(GrowthTest, FramesOfAllFormerVersionsTellTheirNoise) {
  const RunningService service(options);
  endpoint = service.endpoint();
  EXPECT_EQ(render(document_of(1, 2)).summary.status, JobStatus::done);
  EXPECT_EQ(render(document_of(3, 4)).summary.status, JobStatus::done);
  job.quality.noise_threshold = 3.5f;
  job.quality.max_rounds = 2;
  const JobDetail detail = render(document_of(1, 4));
  ASSERT_EQ(detail.frames.size(), 4u);
  for (const FrameReport& frame : detail.frames)
    EXPECT_EQ(frame.quality.cycles_noise, static_cast<float>(frame.frame.value()));
  EXPECT_THAT(growth(), ElementsAre(HasSubstr("2 rounds: noise 4 as Cycles measures it")));

  // One that does not grow says nothing of it.
  job.quality.noise_threshold.reset();
  job.quality.max_rounds = 0;
  ask<JobAccepted>(endpoint, SubmitJob{document_of(1, 4)});
  EXPECT_THAT(growth(), SizeIs(0));
}

// What is not there any more has no sweeps.
TEST_F(GrowthTest, AJobWhoseFramesAreGoneBeginsAnew) {
  const RunningService service(options);
  endpoint = service.endpoint();
  EXPECT_EQ(render(document_of(1, 2)).summary.status, JobStatus::done);
  const auto sweeps_of = [&](const JobAccepted& accepted) {
    const std::string text = ask<JobDocument>(endpoint, JobDocumentRequest{accepted.version}).json;
    return parse_job_document(text).value().job.quality.sweeps;
  };
  job.quality = {.rounds = 1, .sweeps = 1, .noise_threshold = 3.5f, .max_rounds = 2};
  const std::string text = document_of(1, 2);
  fs::remove(frame(1));
  EXPECT_EQ(sweeps_of(ask<JobAccepted>(endpoint, SubmitJob{text})), 2);
  ask<ShownJob>(endpoint, CancelJob{job.name});
  fs::remove(frame(2));
  EXPECT_EQ(sweeps_of(ask<JobAccepted>(endpoint, SubmitJob{text})), 1);
}

// ---- neighbours and patience --------------------------------------------------------------------

// The frames that two jobs share are locked: none of them says whose picture the open one is.
TEST_F(FramesTest, AnOpenJobIsNotEndedForLockedFramesAlone) {
  const RunningService service(options);
  job.frames = {FrameNumber(1), FrameNumber(3)};
  document = make_job_document(job).value();
  const Digest mine = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  EXPECT_EQ(finish(service.endpoint(), worker, mine).summary.status, JobStatus::done);
  JobSpec other = job;
  other.name = "other";
  other.seed += 1;
  other.frames = {FrameNumber(1), FrameNumber(2)};
  const Digest open =
      ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(other).value(), true})
          .version;
  ask<ShownJob>(service.endpoint(), LockFrames{mine.hex(), {FrameNumber(1)}});
  job.priority = 7;
  const std::string next = make_job_document(job).value();
  EXPECT_THAT(refused(service.endpoint(), SubmitJob{next}).message, HasSubstr("wait for its end"));
  EXPECT_EQ(show(service.endpoint(), open).summary.status, JobStatus::running);
  ask<JobAccepted>(service.endpoint(), SubmitJob{next, true});
  EXPECT_EQ(show(service.endpoint(), open).summary.status, JobStatus::cancelled);
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
