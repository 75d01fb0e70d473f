#include <gmock/gmock.h>

#include "coordinator/service/service.h"
#include "tests/unit/service/fake_farm.h"

/// Jobs after their end: in the archive, or as what another one goes on from.
namespace baton {
namespace {

using namespace testing_service;
using testing::HasSubstr;
using testing::SizeIs;

std::size_t num_blobs(const fs::path& store) {
  std::size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(store))
    count += entry.path().extension() == ".blob" ? 1 : 0;
  return count;
}

// What is in memory is what `list` shows without --all.
TEST_F(ServiceTest, HundredsOfJobsThatHaveEndedAreInTheArchiveAlone) {
  constexpr std::size_t kJobs = 300;
  Digest last;
  {
    const RunningService service(options);
    for (std::size_t i = 0; i < kJobs; ++i) {
      JobSpec one = job;
      one.name = "job " + std::to_string(i);
      one.output.directory = (folder / one.name).string();
      last =
          ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(one).value()}).version;
      EXPECT_EQ(ask<ShownJob>(service.endpoint(), CancelJob{last.hex()}).detail.summary.status,
                JobStatus::cancelled);
    }
  }
  const RunningService service(options);
  const auto open = ask<JobList>(service.endpoint(), ListJobs{});
  EXPECT_THAT(open.jobs, SizeIs(0));
  EXPECT_EQ(open.num_ended, kJobs);
  const auto all = ask<JobList>(service.endpoint(), ListJobs{.all = true});
  ASSERT_THAT(all.jobs, SizeIs(kJobs));
  EXPECT_EQ(all.jobs.back().summary.version, last);
  const JobDetail detail = ask<ShownJob>(service.endpoint(), ShowJob{"job 77"}).detail;
  EXPECT_EQ(detail.summary.name, "job 77");
  EXPECT_EQ(detail.summary.status, JobStatus::cancelled);
  EXPECT_EQ(detail.summary.tasks_total, static_cast<std::uint64_t>(kNumTasks));

  // One of them lives again, and another one is forgotten.
  JobSpec one = job;
  one.name = "job 299";
  one.output.directory = (folder / one.name).string();
  EXPECT_EQ(ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(one).value()}).version,
            last);
  EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{}).jobs, SizeIs(1));
  ask<JobList>(service.endpoint(), DeleteJob{"job 77"});
  EXPECT_THAT(refused(service.endpoint(), ShowJob{"job 77"}).message, HasSubstr("no job has"));
  EXPECT_EQ(ask<JobList>(service.endpoint(), ListJobs{}).num_ended, kJobs - 2);
}

// What a done job shows is what it showed before; its last states stay until it is deleted.
TEST_F(ServiceTest, ADoneJobShowsWhatItDidAndKeepsItsStates) {
  const auto notes = testing::ElementsAre("a.exr: black", "b.exr: black");
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    for (const char* note : {"a.exr: black", "a.exr: black", "b.exr: black"}) {
      worker.say(LeaseRequest{1});
      TaskDone done = worker.work(worker.expect<LeaseGrant>().lease);
      done.notes = {note};
      worker.say(done);
    }
    EXPECT_THAT(show(service.endpoint(), id).notes, notes);
    for (int i = 3; i < kNumTasks; ++i) worker.do_one_task();
    worker.say(LeaseRequest{0});
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
    show_end(service.endpoint(), id);
    EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{}).jobs, SizeIs(0));
  }
  const RunningService service(options);
  const JobDetail detail = show(service.endpoint(), id);
  EXPECT_EQ(detail.summary.status, JobStatus::done);
  EXPECT_EQ(detail.summary.stats.pixels, static_cast<std::uint64_t>(kNumTasks));
  EXPECT_THAT(detail.frames_done,
              testing::ElementsAre(FrameNumber(1), FrameNumber(2), FrameNumber(3), FrameNumber(4)));
  EXPECT_THAT(detail.frames, SizeIs(4));
  EXPECT_THAT(detail.notes, notes);
  EXPECT_EQ(num_blobs(store()), 2u) << "a state of each tile";
  ask<JobList>(service.endpoint(), DeleteJob{id.hex()});
  ask<JobList>(service.endpoint(), ListJobs{});
  EXPECT_EQ(num_blobs(store()), 0u);
}

TEST_F(ServiceTest, MoreFramesGoOnFromTheStatesOfADoneJob) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  {
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    for (int i = 0; i < kNumTasks; ++i) worker.do_one_task();
    worker.say(WorkerGoodbye{});
  }
  show_end(service.endpoint(), id);
  JobSpec longer = job;
  for (const int frame : {5, 6}) longer.frames.emplace_back(frame);
  const auto accepted =
      ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(longer).value()});
  EXPECT_EQ(accepted.plan,
            "frames 1-4 are kept\n"
            "frames 5-6 are rendered, going on from the states of frame 4\n");
  FakeWorker worker(service.endpoint(), store(), longer, "v");
  worker.hello();
  for (int i = 0; i < 2; ++i) {
    worker.say(LeaseRequest{1});
    const LeaseGrant grant = worker.expect<LeaseGrant>();
    EXPECT_EQ(grant.steps, (StepSpan{Step(4), Step(5)}));
    ASSERT_FALSE(grant.inputs.empty());
    EXPECT_EQ(grant.inputs.front().step(), Step(3));
    worker.say(worker.work(grant.lease));
  }
  for (int i = 0; i < 2; ++i) worker.do_one_task();
  worker.say(LeaseRequest{0});
  worker.say(Heartbeat{});
  worker.expect<Heartbeat>();
  const JobDetail detail = show_end(service.endpoint(), accepted.version);
  EXPECT_EQ(detail.summary.status, JobStatus::done);
  EXPECT_EQ(detail.summary.stats.pixels, static_cast<std::uint64_t>(kNumTasks + 4))
      << "what the first job counted is its own, too";
  EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
  EXPECT_EQ(num_blobs(store()), 2u) << "the states of frame 4 went to the longer job";
}

}  // namespace
}  // namespace baton
