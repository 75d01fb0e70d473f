#include <gmock/gmock.h>

#include <algorithm>
#include <map>

#include "common/base/files.h"
#include "coordinator/service/service.h"
#include "tests/unit/service/fake_farm.h"

/// Files that are gone, damaged, or another job's.
namespace baton {
namespace {

using namespace testing_service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

// The films of a frame are gone once it is written, and so are the states before them: the tiles of
// frames 1 to 4 are rendered again, but only one frame is written.
TEST_F(ServiceTest, ADoneJobOfWhichAFrameIsGoneOrCutMakesThatFrameAgain) {
  const RunningService service(options);
  const fs::path frame = fs::path(job.output.directory) / "frame.0003.exr";
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  for (const bool cut : {false, true}) {
    for (int i = 0; i < (cut ? 5 : kNumTasks); ++i) worker.do_one_task();
    worker.say(LeaseRequest{0});
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
    EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
    EXPECT_TRUE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);

    if (cut) {
      fs::resize_file(frame, 3);
    } else {
      fs::remove(frame);
    }
    EXPECT_FALSE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);
    const JobDetail detail = show(service.endpoint(), id);
    EXPECT_THAT(detail.frames_done, ElementsAre(FrameNumber(1), FrameNumber(2), FrameNumber(4)));
    EXPECT_EQ(detail.summary.tasks_done, 3u);
  }
}

// A frame belongs to one job: another picture is refused, other settings take its place.
TEST_F(ServiceTest, AnOutputFolderBelongsToOneJob) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  JobSpec other = job;
  other.name = "other";
  other.seed = 99;
  other.sampling.num_particles += 1;
  const std::string edited = make_job_document(other).value();
  const Error refusal = refused(service.endpoint(), SubmitJob{edited});
  EXPECT_EQ(refusal.kind, ErrorKind::bad_input);
  EXPECT_THAT(refusal.message, HasSubstr("what differs: $.sampling.numParticles, $.seed"));
  EXPECT_EQ(show(service.endpoint(), id).summary.status, JobStatus::running);

  // Who wants it replaces the frames; then the first picture is the other one.
  const Digest second = ask<JobAccepted>(service.endpoint(), SubmitJob{edited, true}).version;
  EXPECT_EQ(show(service.endpoint(), id).summary.status, JobStatus::cancelled);
  FakeWorker worker(service.endpoint(), store(), other);
  worker.hello();
  for (int i = 0; i < kNumTasks; ++i) worker.do_one_task();
  worker.say(LeaseRequest{0});
  worker.say(Heartbeat{});
  worker.expect<Heartbeat>();
  EXPECT_EQ(show_end(service.endpoint(), second).summary.status, JobStatus::done);
  EXPECT_THAT(refused(service.endpoint(), SubmitJob{document}).message,
              HasSubstr("4 of the 4 frames"));
  EXPECT_FALSE(ask<JobAccepted>(service.endpoint(), SubmitJob{document, true}).already_there);
  // It was done; that its frames are gone since does not change what happened.
  const JobDetail former = show(service.endpoint(), second);
  EXPECT_EQ(former.summary.status, JobStatus::done);
  EXPECT_THAT(former.frames_done, SizeIs(0));
  EXPECT_THAT(former.notes, Contains(HasSubstr("has replaced frames 1-4")));

  // The same picture with another priority takes its place.
  JobSpec urgent = job;
  urgent.priority = 7;
  EXPECT_FALSE(ask<JobAccepted>(service.endpoint(), SubmitJob{make_job_document(urgent).value()})
                   .already_there);
  const Digest newest = digest_of(make_job_document(urgent).value());
  EXPECT_EQ(show(service.endpoint(), id).summary.version, newest) << "the same job";

  // Nobody else writes into the folder meanwhile, not even other frames.
  JobSpec later = other;
  later.frames = {FrameNumber(5), FrameNumber(6)};
  const std::string others = make_job_document(later).value();
  EXPECT_THAT(refused(service.endpoint(), SubmitJob{others}).message, HasSubstr("writes into"));
  const auto open = ask<JobList>(service.endpoint(), ListJobs{}).jobs;
  ASSERT_THAT(open, SizeIs(1));
  ask<ShownJob>(service.endpoint(), CancelJob{open.front().identity.id.hex()});
  ask<JobAccepted>(service.endpoint(), SubmitJob{others});
}

// What is read of a folder that is not mounted is not the truth.
TEST_F(ServiceTest, ARunningJobWaitsForItsOutputFolder) {
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    for (int i = 0; i < kNumTasks - 1; ++i) worker.do_one_task();
  }
  fs::rename(job.output.directory, job.output.directory + ".away");
  const RunningService service(options);
  EXPECT_EQ(show(service.endpoint(), id).summary.status, JobStatus::paused);
  EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, 7u);
  EXPECT_THAT(refused(service.endpoint(), ResumeJob{id.hex()}).message,
              HasSubstr("stays paused: " + job.output.directory));
  fs::rename(job.output.directory + ".away", job.output.directory);
  const JobDetail resumed = ask<ShownJob>(service.endpoint(), ResumeJob{id.hex()}).detail;
  EXPECT_EQ(resumed.summary.status, JobStatus::running);
  EXPECT_EQ(resumed.summary.tasks_done, 7u);
}

TEST_F(ServiceTest, AFrameThatGoesBeforeItsReportIsMadeAgainWithoutBlame) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  TaskDone report;
  do {
    worker.say(LeaseRequest{1});
    report = worker.work(worker.expect<LeaseGrant>().lease);
    if (report.lease.task.kind == TaskKind::assemble) {
      fs::remove(fs::path(job.output.directory) / "frame.0001.exr");
    }
    worker.say(report);
  } while (report.lease.task.kind != TaskKind::assemble);
  worker.say(LeaseRequest{1});
  worker.expect<LeaseGrant>();
  const JobDetail detail = show(service.endpoint(), id);
  EXPECT_THAT(detail.failures, SizeIs(0));
  EXPECT_EQ(detail.summary.attempts_lost, 1u) << "after many of them somebody should look";
}

// Cut, on a bad sector, or with a folder in its place: whatever the worker says of it.
TEST_F(ServiceTest, ABlobThatIsDamagedOrCannotBeReadIsMadeAgainWithoutBlame) {
  enum class Fault { cut, unreadable, other };
  std::string broken;
  options.disk.read = [&](const fs::path& path) -> Result<Bytes> {
    if (path == broken) return Error{ErrorKind::io, broken + ": cannot read: Input/output error"};
    return read_whole_file(path);
  };
  for (const Fault fault : {Fault::cut, Fault::unreadable, Fault::other}) {
    SCOPED_TRACE(static_cast<int>(fault));
    options.work_dir = folder / std::to_string(static_cast<int>(fault));
    const RunningService service(options);
    const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    worker.say(LeaseRequest{1});
    const TaskDone first = worker.work(worker.expect<LeaseGrant>().lease);
    worker.say(first);
    worker.say(LeaseRequest{2});
    LeaseGrant reader = worker.expect<LeaseGrant>();
    if (reader.inputs.empty()) reader = worker.expect<LeaseGrant>();
    ASSERT_FALSE(reader.inputs.empty());
    const fs::path blob = BlobStore::open(store())->path(reader.inputs[0].digest);
    if (fault == Fault::cut) fs::resize_file(blob, fs::file_size(blob) - 1);
    if (fault == Fault::unreadable) broken = blob;
    if (fault == Fault::other) {
      fs::remove(blob);
      fs::create_directories(blob / "full");
    }
    worker.say(TaskFailed{reader.lease, "cannot read", fault != Fault::cut});
    worker.say(LeaseRequest{2});
    EXPECT_EQ(worker.expect<LeaseGrant>().lease.task, first.lease.task) << "made again";
    EXPECT_FALSE(fs::exists(blob));
    const JobDetail detail = show(service.endpoint(), id);
    EXPECT_THAT(detail.failures, SizeIs(0));
    EXPECT_EQ(detail.summary.status, JobStatus::running);
  }
}

TEST_F(ServiceTest, ALostTokenOfTheStoreIsWrittenAgain) {
  std::optional<RunningService> service(std::in_place, options);
  const auto token = [&] {
    const Result<std::string> text = read_text_file(store() / "token", 64);
    return text ? *text : std::string("gone");
  };
  const std::string first = token();
  for (const bool is_cut : {false, true}) {
    if (is_cut) {
      fs::resize_file(store() / "token", 0);
    } else {
      fs::remove(store() / "token");
    }
    FakeWorker worker(service->endpoint(), store(), job, is_cut ? "v" : "w");
    worker.hello({}, is_cut ? 2 : 1);
    EXPECT_EQ(worker.expect<WorkerWelcome>().token, first);
    EXPECT_EQ(token(), first);
  }

  // It is the same after a restart: workers and output folders know it.
  service.reset();
  fs::remove(store() / "token");
  service.emplace(options);
  EXPECT_EQ(token(), first);
}

// What made an input is being done again while a reader of it is leased: the reader's failure is
// nobody's fault, and it waits.
TEST_F(ServiceTest, ALeasedTaskMayLoseAnInput) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  for (int i = 0; i < 2; ++i) worker.do_one_task();
  worker.say(LeaseRequest{4});
  std::map<TaskKind, LeaseGrant> grants;
  for (int i = 0; i < 4; ++i) {
    const LeaseGrant grant = worker.expect<LeaseGrant>();
    grants.emplace(grant.lease.task.kind, grant);
  }
  const LeaseGrant& reader = grants.at(TaskKind::render);
  const fs::path state = BlobStore::open(store())->path(reader.inputs.at(0).digest);
  fs::resize_file(state, fs::file_size(state) - 1);
  worker.say(TaskFailed{reader.lease, "cannot read", false});
  worker.say(TaskFailed{grants.at(TaskKind::assemble).lease, "cannot read", false});
  worker.say(LeaseRequest{1});
  EXPECT_EQ(worker.expect<LeaseGrant>().lease.task.kind, TaskKind::render);
  EXPECT_THAT(show(service.endpoint(), id).failures, SizeIs(0));
}

// Who is ended by a signal will be started again.
TEST_F(ServiceTest, WorkersAreSentHomeOnlyByWhoeverStopsTheFarm) {
  std::optional<RunningService> service(std::in_place, options);
  FakeWorker worker(service->endpoint(), store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  service.reset();
  EXPECT_FALSE(worker.answers<Shutdown>(300ms));
}

TEST_F(ServiceTest, ARunningJobMakesAgainWhatIsGoneFromTheStore) {
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    worker.do_one_task();
    worker.say(LeaseRequest{1});
    worker.expect<LeaseGrant>();
  }
  fs::remove_all(store());
  const RunningService service(options);
  EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, 0u);
}

}  // namespace
}  // namespace baton
