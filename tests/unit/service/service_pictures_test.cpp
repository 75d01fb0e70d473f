#include <gmock/gmock.h>

#include "tests/unit/service/frames_fixture.h"

/// Whose picture it is that stands in the place of a frame.
namespace baton {
namespace {

using namespace testing_service;
using testing::HasSubstr;
using testing::SizeIs;

// The coordinator was away, or the worker's report on its way.
TEST_F(FramesTest, AFrameThatChangesBeforeItsReportIsSeen) {
  for (const bool is_picture : {false, true}) {
    SCOPED_TRACE(is_picture);
    fs::remove_all(job.output.directory);
    job.seed += 1;
    document = make_job_document(job).value();
    const RunningService service(options);
    const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document, true}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    const TaskDone report = worker.work(wait_for_frame_2(worker));
    std::string other = is_picture ? std::string(kPicture) : std::string();
    other.resize(report.made.outputs.front().size_bytes, '\0');
    put(2, other);
    worker.say(report);
    const JobDetail detail = finish(service.endpoint(), worker, id);
    EXPECT_THAT(detail.failures, SizeIs(0));
    const std::string there = read_text_file(frame(2), 100).value();
    if (is_picture) {
      EXPECT_EQ(detail.summary.status, JobStatus::failed);
      EXPECT_THAT(detail.waits, HasSubstr("frame.0002.exr is not what a job has written"));
      EXPECT_EQ(there, other);
    } else {
      EXPECT_EQ(detail.summary.status, JobStatus::done);
      EXPECT_THAT(there, HasSubstr("image of seed"));
    }
  }
}

// Another pattern makes the same file a frame of another number.
TEST_F(FramesTest, ALockIsOfTheFileToo) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  put(2, std::string(kPicture));
  ask<ShownJob>(service.endpoint(), LockFrames{id.hex(), {FrameNumber(2)}});
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  JobSpec renumbered = job;
  renumbered.output.pattern = "frame.0##2.exr";
  renumbered.frames = {FrameNumber(0), FrameNumber(1)};
  for (const bool restart : {false, true}) {
    EXPECT_THAT(
        refused(service.endpoint(), SubmitJob{make_job_document(renumbered).value(), restart})
            .message,
        HasSubstr("frames 0 would write files"));
  }
  renumbered.frames = {FrameNumber(1)};
  ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(renumbered).value(), true});
  EXPECT_EQ(read_text_file(frame(2), 100).value(), kPicture);
}

// What a refusal advises can be done: it names frames as the job has them.
TEST_F(FramesTest, LocksAreAdvisedForFramesThatTheJobHas) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
  JobSpec longer = job;
  longer.frames.push_back(FrameNumber(5));
  put(5, std::string(kPicture));
  EXPECT_THAT(
      refused(service.endpoint(), SubmitJob{make_job_document(longer).value()}).message,
      testing::AllOf(HasSubstr("frame.0005.exr is not"), testing::Not(HasSubstr("job lock"))));
  JobSpec renumbered = job;
  renumbered.output.pattern = "frame.0##2.exr";
  renumbered.frames = {FrameNumber(0)};
  put(2, std::string(kPicture));
  EXPECT_THAT(refused(service.endpoint(), SubmitJob{make_job_document(renumbered).value()}).message,
              HasSubstr("--frames 2` keeps it"));
}

// Another job has taken a frame of this folder with --restart; its former owner's is put back.
TEST_F(FramesTest, AFormerJobsPictureThatIsPutBackIsKept) {
  take_images_for_pictures();
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  const Digest former = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  EXPECT_EQ(finish(service.endpoint(), worker, former).summary.status, JobStatus::done);
  const std::string of_former = read_text_file(frame(3), 100).value();
  JobSpec other = job;
  other.name = "other";
  other.seed += 1;
  const std::string theirs = make_job_document(other).value();
  const Digest taken = ask<JobAccepted>(service.endpoint(), SubmitJob{theirs, true}).version;
  FakeWorker next(service.endpoint(), store(), other, "next");
  next.hello();
  EXPECT_EQ(finish(service.endpoint(), next, taken).summary.status, JobStatus::done)
      << "until there is one of its own a former picture makes way";
  EXPECT_NE(read_text_file(frame(3), 100).value(), of_former);
  const auto expect_kept = [&] {
    put(3, of_former);
    EXPECT_THAT(refused(service.endpoint(), SubmitJob{theirs}).message,
                HasSubstr("frame.0003.exr is not what a job has written"));
    EXPECT_EQ(read_text_file(frame(3), 100).value(), of_former);
  };
  expect_kept();
  // Nor while its own is to be rendered once more.
  fs::remove(frame(3));
  ask<JobAccepted>(service.endpoint(), SubmitJob{theirs});
  ask<ShownJob>(service.endpoint(), CancelJob{taken.hex()});
  expect_kept();
}

// The same of a former version of the job.
TEST_F(FramesTest, AFormerVersionsPictureIsKeptThoughTheNewerOneIsGone) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  const Digest former = submit_former(service.endpoint());
  EXPECT_EQ(finish(service.endpoint(), worker, former).summary.status, JobStatus::done);
  const std::string of_former = read_text_file(frame(2), 100).value();
  JobSpec newer = job;
  newer.seed += 1;
  const std::string text = make_job_document(newer).value();
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{text, true}).version;
  FakeWorker next(service.endpoint(), store(), newer, "next");
  next.hello();
  EXPECT_EQ(finish(service.endpoint(), next, id).summary.status, JobStatus::done);
  EXPECT_NE(read_text_file(frame(2), 100).value(), of_former);
  fs::remove(frame(2));
  ask<JobAccepted>(service.endpoint(), SubmitJob{text});
  put(2, of_former);
  wait_for_frame_2(next);
  EXPECT_THAT(granted, testing::Not(testing::Contains(digest_of(of_former))));
}

// The newest version has rendered nothing itself, and a former one's frame is to be rendered once
// more, of which nothing came: another version had taken its place.
TEST_F(FramesTest, AKeptFrameIsAsNewAsWhenItWasRendered) {
  take_images_for_pictures();
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  const Digest first = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  EXPECT_EQ(finish(service.endpoint(), worker, first).summary.status, JobStatus::done);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document, false, true, {FrameNumber(2)}});
  fs::remove(frame(2));
  JobSpec next = job;
  const auto submit = [&] {
    return ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(next).value()}).version;
  };
  next.output.pixel_type = PixelType::full_float;
  const Digest second = submit();
  FakeWorker writer(service.endpoint(), store(), next, "writer");
  writer.hello();
  EXPECT_EQ(finish(service.endpoint(), writer, second).summary.status, JobStatus::done);
  for (const int tile_size : {16, 32}) {
    next.image.tile_size = tile_size;
    EXPECT_EQ(show(service.endpoint(), submit()).summary.status, JobStatus::done) << "all is kept";
  }
}

// The former one once more, which replaces the newer one's.
TEST_F(FramesTest, AFormerDocumentAgainReplacesTheNewerOnes) {
  for (const bool is_job : {false, true}) {
    SCOPED_TRACE(is_job);
    fs::remove_all(job.output.directory);
    job.seed += 10;
    document = make_job_document(job).value();
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    const Digest former = ask<JobAccepted>(service.endpoint(), SubmitJob{document, true}).version;
    EXPECT_EQ(finish(service.endpoint(), worker, former).summary.status, JobStatus::done);
    JobSpec newer = job;
    newer.seed += 1;
    if (is_job) newer.name = "other";
    const std::string text = make_job_document(newer).value();
    const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{text, true}).version;
    FakeWorker next(service.endpoint(), store(), newer, "next");
    next.hello();
    EXPECT_EQ(finish(service.endpoint(), next, id).summary.status, JobStatus::done);
    const std::string newest = read_text_file(frame(2), 100).value();
    const JobAccepted again = ask<JobAccepted>(service.endpoint(), SubmitJob{document, true});
    EXPECT_EQ(again.version, former);
    EXPECT_THAT(again.plan, testing::Not(HasSubstr("is gone")))
        << "it is there, of another picture";
    const LeaseId lease = wait_for_frame_2(worker);
    worker.say(LeaseReturn{lease, {}, {}, digest_of(newest), writer_of(id)});
    wait_for_frame_2(worker);
    EXPECT_THAT(granted, testing::Contains(digest_of(newest)));
  }
}

// Written, and never reported: what makes the same picture goes on as if it were; no other
// replaces it unasked.
TEST_F(FramesTest, WhatWasOnlyGrantedIsOfItsPicture) {
  const RunningService service(options);
  const Digest former = submit_former(service.endpoint());
  FakeWorker late(service.endpoint(), store(), job, "late");
  late.hello();
  wait_for_frame_2(late);
  const std::string written = std::string(kPicture) + writer_of(former);
  put(2, written);
  put(3, written);  // of which nobody had a lease
  JobSpec other = job;
  other.name = "other";
  const auto submit = [&](const JobSpec& what, bool restart = false) {
    return SubmitJob{make_job_document(what).value(), restart};
  };
  EXPECT_THAT(refused(service.endpoint(), submit(other)).message,
              HasSubstr("frame.0003.exr is not what a job has written"));
  fs::remove(frame(3));
  JobSpec brighter = other;
  brighter.seed += 1;
  const auto expect_kept = [&] {
    EXPECT_THAT(refused(service.endpoint(), submit(brighter)).message,
                HasSubstr("frame.0002.exr is not what a job has written"));
  };
  expect_kept();
  const Digest next = ask<JobAccepted>(service.endpoint(), submit(other)).version;
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), ShowJob{former.hex()}).detail.summary.status,
            JobStatus::cancelled);
  const LeaseId lease = wait_for_frame_2(late);
  late.say(LeaseReturn{lease, {}, {}, digest_of(written), writer_of(former)});
  wait_for_frame_2(late);
  EXPECT_THAT(granted, testing::Contains(digest_of(written)));
  ask<ShownJob>(service.endpoint(), CancelJob{next.hex()});
  expect_kept();
  ask<JobAccepted>(service.endpoint(), submit(brighter, true));
}

// Once the frame is rendered, the picture that was given up for it is somebody's again.
TEST_F(FramesTest, WhatWasGivenUpIsKeptOnceItsFrameIsRendered) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = begin(service.endpoint(), worker);
  put(2, std::string(kPicture));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::failed);
  fs::remove(frame(3));  // so that the job stays open
  ask<JobAccepted>(service.endpoint(), SubmitJob{document, true});
  const LeaseId lease = wait_for_frame_2(worker);
  EXPECT_THAT(granted, testing::Contains(digest_of(std::string(kPicture))));
  worker.say(worker.work(lease));
  sync(worker);
  put(2, std::string(kPicture));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::failed);
  EXPECT_EQ(read_text_file(frame(2), 100).value(), kPicture);
}

}  // namespace
}  // namespace baton
