#include <gmock/gmock.h>

#include <fstream>

#include "tests/unit/service/frames_fixture.h"

/// Pictures of others, or painted ones, in a frame's place.
namespace baton {
namespace {

using namespace testing_service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

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

  void say_taken(FakeWorker& worker, const LeaseId& lease, const std::string& writer) const {
    worker.say(LeaseReturn{lease, {}, {}, digest_of(picture), writer});
  }
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

// Once a worker was granted a frame it may have written it, and be late to report it.
TEST_F(PlaceTest, WhatAFormerJobHasLeftMayGo) {
  const RunningService service(options);
  const Digest former = submit_former(service.endpoint());
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  wait_for_frame_2(worker);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  put(2, picture);
  const LeaseId lease = wait_for_frame_2(worker);
  say_taken(worker, lease, writer_of(former));
  const LeaseId again = wait_for_frame_2(worker);
  EXPECT_NE(again, lease);
  EXPECT_THAT(granted, ElementsAre(digest_of(picture)));
  worker.say(worker.work(again));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::done);
}

TEST_F(PlaceTest, WhatNobodyWasGrantedIsNoFormerJobs) {
  const RunningService service(options);
  const Digest former = submit_former(service.endpoint());
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  put(2, picture);
  say_taken(worker, wait_for_frame_2(worker), writer_of(former));
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::failed);
}

// Of the same document, as another coordinator has it rendered.
TEST_F(PlaceTest, WhatAnotherRendererMadeStays) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  put(2, picture);
  say_taken(worker, wait_for_frame_2(worker), id.hex() + " OTHER, " + build_identity());
  EXPECT_EQ(finish(service.endpoint(), worker, id).summary.status, JobStatus::failed);
}

}  // namespace
}  // namespace baton
