#include <gmock/gmock.h>

#include <fstream>

#include "tests/unit/service/frames_fixture.h"

/// Frames that are locked.
namespace baton {
namespace {

using namespace testing_service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

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

// Nothing replaces a locked frame, so nothing is gained by --restart where it cannot be read.
TEST_F(FramesTest, ALockedFrameThatCannotBeReadIsInTheWayOfRestartsToo) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}});
  fs::remove(frame(2));
  fs::create_directory(frame(2));
  for (const bool restart : {false, true}) {
    const Error refusal = refused(service.endpoint(), SubmitJob{document, restart});
    EXPECT_THAT(refusal.message, HasSubstr(frame(2).string())) << restart;
  }
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

// The work folder is put back from a copy that is older than a lock: the output folder knows
// better.
TEST_F(FramesTest, ALockThatIsNewerThanTheJournalStays) {
  const fs::path journal = options.work_dir / "journal.sqlite", copy = folder / "copy.sqlite";
  const auto put_back = [&] {
    for (const char* const rest : {"-wal", "-shm"}) fs::remove(journal.string() + rest);
    fs::copy_file(copy, journal, fs::copy_options::overwrite_existing);
  };
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    id = begin(service.endpoint(), worker);
  }
  fs::copy_file(journal, copy);
  // Of an open job.
  put(4, std::string(kPicture));
  {
    const RunningService service(options);
    ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(4)}});
  }
  put_back();
  {
    const RunningService service(options);
    EXPECT_THAT(locked_frames(service.endpoint(), id), ElementsAre(FrameNumber(4)));
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  }
  EXPECT_EQ(read_text_file(frame(4), 100).value(), kPicture);

  // Of one that is done: what is unlocked here stays locked there, and the other way round.
  fs::copy_file(journal, copy, fs::copy_options::overwrite_existing);
  put(2, std::string(kPicture));
  {
    const RunningService service(options);
    ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}});
    ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(4)}, /*off=*/true});
  }
  put_back();
  JobSpec other = job;
  other.name = "other";
  const RunningService service(options);
  const std::string refusal =
      refused(service.endpoint(), SubmitJob{make_job_document(other).value(), true}).message;
  EXPECT_THAT(refusal, HasSubstr("frames 2,4 in"));
  const JobAccepted accepted =
      ask<JobAccepted>(service.endpoint(), SubmitJob{document, /*restart=*/true});
  EXPECT_THAT(accepted.plan, HasSubstr("frames 2,4 are locked"));
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  EXPECT_EQ(read_text_file(frame(2), 100).value(), kPicture);

  // Once it is known it is unlocked like any other.
  ask<ShownJob>(service.endpoint(),
                LockFrames{id.hex(), {FrameNumber(2), FrameNumber(4)}, /*off=*/true});
  ask<JobAccepted>(service.endpoint(), SubmitJob{document, /*restart=*/true});
  EXPECT_THAT(locked_frames(service.endpoint(), id), SizeIs(0));
}

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

}  // namespace
}  // namespace baton
