#include "coordinator/service/service.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "tests/unit/service/fake_farm.h"

namespace baton {
namespace {

using namespace testing_service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

std::size_t count_blobs(const fs::path& store) {
  std::size_t count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(store))
    count += entry.path().extension() == ".blob" ? 1 : 0;
  return count;
}

TEST_F(ServiceTest, AJobGoesFromSubmissionToItsLastFrame) {
  const RunningService service(options);
  const auto accepted = ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_EQ(accepted.version, digest_of(document));
  EXPECT_FALSE(accepted.already_there);
  EXPECT_TRUE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);

  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  const WorkerWelcome welcome = worker.expect<WorkerWelcome>();
  EXPECT_EQ(welcome.epoch, 1u);
  EXPECT_EQ(welcome.heartbeat_ms, kHeartbeat.count());
  EXPECT_TRUE(fs::equivalent(welcome.store_directory, store()));
  worker.say(JobDocumentRequest{accepted.version});
  EXPECT_EQ(worker.expect<JobDocument>().json, document);
  for (int i = 0; i < kNumTasks; ++i) worker.do_one_task();
  worker.say(LeaseRequest{1});
  worker.expect<NoWork>();

  const JobDetail detail = show_end(service.endpoint(), accepted.version);
  EXPECT_EQ(detail.summary.status, JobStatus::done);
  EXPECT_EQ(detail.summary.tasks_done, 8u);
  EXPECT_EQ(detail.summary.stats.pixels, 8u);
  EXPECT_THAT(detail.frames_done,
              ElementsAre(FrameNumber(1), FrameNumber(2), FrameNumber(3), FrameNumber(4)));
  EXPECT_EQ(count_blobs(store()), 2u) << "the last states are kept, all else is gone";

  // What the sampler did: frame by frame in the answer, tile by tile in the file.
  ASSERT_THAT(detail.frames, SizeIs(4));
  EXPECT_EQ(detail.frames[3].frame, FrameNumber(4));
  EXPECT_EQ(detail.frames[3].sampling.pixels_carried, 10u + 11u);
  const Result<std::string> csv = read_text_file(folder / "out/diagnostics.csv", 1 << 20);
  ASSERT_TRUE(csv.ok());
  EXPECT_EQ(std::count(csv->begin(), csv->end(), '\n'), 1 + 4 * 3);
  EXPECT_THAT(*csv, HasSubstr("\n4,all,21,21,0"));
  EXPECT_THAT(*csv, HasSubstr("\n4,1,11,11,0"));

  const auto list = ask<JobList>(service.endpoint(), ListJobs{.all = true});
  ASSERT_THAT(list.jobs, SizeIs(1));
  EXPECT_EQ(list.jobs[0].summary.name, "test");
  ASSERT_THAT(list.workers, SizeIs(1));
  EXPECT_EQ(list.workers[0].num_threads, 2);
}

TEST_F(ServiceTest, ARestartedCoordinatorGoesOnWithWhatItsWorkersHold) {
  LeaseId held;
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    for (int i = 0; i < 3; ++i) worker.do_one_task();
    worker.say(LeaseRequest{1});
    held = worker.expect<LeaseGrant>().lease;
  }
  const RunningService service(options);
  EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, 3u);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.say(worker.work(held));
  worker.expect<HelloAgain>();
  worker.hello({held});
  EXPECT_EQ(worker.expect<WorkerWelcome>().epoch, 2u);
  worker.say(worker.work(held));
  for (int i = 4; i < kNumTasks; ++i) EXPECT_NE(worker.do_one_task().task, held.task);
  worker.say(LeaseRequest{1});
  worker.expect<NoWork>();
  EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
  EXPECT_EQ(count_blobs(store()), 2u);
}

TEST_F(ServiceTest, ASilentWorkerIsForgottenAndItsTaskGoesOn) {
  const RunningService service(options);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  FakeWorker silent(service.endpoint(), store(), job, "silent");
  silent.hello();
  silent.say(LeaseRequest{2});
  const LeaseId lost = silent.expect<LeaseGrant>().lease;

  FakeWorker other(service.endpoint(), store(), job, "other");
  other.hello();
  other.say(LeaseRequest{1});
  for (int i = 0; i < 8; ++i) {
    std::this_thread::sleep_for(kHeartbeat / 2);
    other.say(Heartbeat{});
  }
  EXPECT_EQ(other.expect<LeaseGrant>().lease.task, lost.task);
  silent.say(LeaseRequest{1});
  silent.expect<HelloAgain>();
}

// A worker that has waited too long for an answer says hello while its lease is on the way.
TEST_F(ServiceTest, ASecondHelloOfAProcessLosesNoLease) {
  options.heartbeat = std::chrono::minutes(1);
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.say(LeaseRequest{1});
  const LeaseId lease = worker.expect<LeaseGrant>().lease;
  worker.hello();
  worker.say(worker.work(lease));
  worker.expect<WorkerWelcome>();
  worker.say(Heartbeat{});
  worker.expect<Heartbeat>();
  const JobSummary summary = show(service.endpoint(), id).summary;
  EXPECT_EQ(summary.attempts_lost, 0u);
  EXPECT_EQ(summary.tasks_done, 1u);
}

TEST_F(ServiceTest, HeartbeatsAreAnswered) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.say(Heartbeat{});
  worker.expect<Heartbeat>();
}

TEST_F(ServiceTest, AFailureIsToldWithItsPlace) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.say(LeaseRequest{2});
  const LeaseId first = worker.expect<LeaseGrant>().lease;
  const LeaseId second = worker.expect<LeaseGrant>().lease;
  worker.say(TaskFailed{second, "mesh.ply: cannot open", true});
  EXPECT_EQ(worker.expect<LeaseRevoke>().lease, first);
  const JobDetail detail = show(service.endpoint(), id);
  EXPECT_EQ(detail.summary.status, JobStatus::failed);
  EXPECT_THAT(detail.failures, ElementsAre("frames 1-2, tile 1 on w: mesh.ply: cannot open"));
}

TEST_F(ServiceTest, AReportWithoutItsBlobsGivesTheTaskBackWithoutBlame) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.say(LeaseRequest{1});
  TaskDone report = worker.work(worker.expect<LeaseGrant>().lease);
  report.made.outputs[0].digest = digest_of("never published");
  worker.say(report);
  worker.say(LeaseRequest{1});
  worker.expect<LeaseGrant>();
  const JobDetail detail = show(service.endpoint(), id);
  EXPECT_THAT(detail.failures, SizeIs(0));
  EXPECT_EQ(detail.summary.attempts_lost, 1u);
}

TEST_F(ServiceTest, ACancelledJobGoesOnWhenItIsSubmittedAgain) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.do_one_task();
  worker.say(LeaseRequest{1});
  const LeaseId held = worker.expect<LeaseGrant>().lease;
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), CancelJob{id.short_hex()}).detail.summary.status,
            JobStatus::cancelled);
  EXPECT_EQ(worker.expect<LeaseRevoke>().lease, held);

  EXPECT_FALSE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);
  EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, 1u);
  for (int i = 1; i < kNumTasks; ++i) worker.do_one_task();
  worker.say(LeaseRequest{1});
  worker.expect<NoWork>();
  EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
}

TEST_F(ServiceTest, ADeletedJobLeavesNeitherStatesNorALineOfTheJournal) {
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    FakeWorker worker(service.endpoint(), store(), job);
    worker.hello();
    EXPECT_THAT(refused(service.endpoint(), DeleteJob{id.hex()}).message,
                HasSubstr("is running: cancel it first"));
    for (int i = 0; i < kNumTasks; ++i) worker.do_one_task();
    worker.say(LeaseRequest{1});
    worker.expect<NoWork>();
    EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
    EXPECT_THAT(ask<JobList>(service.endpoint(), DeleteJob{id.hex()}).jobs, SizeIs(0));
    EXPECT_EQ(refused(service.endpoint(), ShowJob{id.hex()}).kind, ErrorKind::bad_input);
    EXPECT_EQ(count_blobs(store()), 0u);
  }
  const RunningService service(options);
  EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{}).jobs, SizeIs(0));
  EXPECT_FALSE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);
  EXPECT_EQ(show(service.endpoint(), id).summary.tasks_done, 0u);
}

TEST_F(ServiceTest, APausedJobIsPausedAfterARestartAndResumedBySubmission) {
  Digest id;
  {
    const RunningService service(options);
    id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
    EXPECT_EQ(ask<ShownJob>(service.endpoint(), PauseJob{id.hex()}).detail.summary.status,
              JobStatus::paused);
  }
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.say(LeaseRequest{1});
  worker.expect<NoWork>();
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), ResumeJob{id.hex()}).detail.summary.status,
            JobStatus::running);
  worker.expect<LeaseGrant>();
  EXPECT_EQ(ask<ShownJob>(service.endpoint(), PauseJob{id.hex()}).detail.summary.status,
            JobStatus::paused);
  EXPECT_TRUE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);
  EXPECT_EQ(show(service.endpoint(), id).summary.status, JobStatus::running);
}

TEST_F(ServiceTest, AWorkerIsDrainedByItsName) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job, "mill");
  worker.hello();
  worker.expect<WorkerWelcome>();
  EXPECT_THAT(ask<JobList>(service.endpoint(), OrderWorker{"mill"}).workers, SizeIs(1));
  worker.expect<Drain>();
  const Error unknown = refused(service.endpoint(), OrderWorker{"mil"});
  EXPECT_EQ(unknown.kind, ErrorKind::bad_input);
  EXPECT_EQ(unknown.message, "worker 'mil': no worker has this name");
}

// A name is for people: two processes of one name on one host work side by side.
TEST_F(ServiceTest, AHeldWorkerGetsNothingUntilItIsReleased) {
  std::optional<RunningService> service(options);
  ask<JobAccepted>(service->endpoint(), SubmitJob{document});
  {
    FakeWorker worker(service->endpoint(), store(), job);
    worker.hello();
    worker.do_one_task();
    const OrderWorker hold{"w", WorkerOrder::hold};
    const WorkerSummary held = ask<JobList>(service->endpoint(), hold).workers.at(0);
    EXPECT_TRUE(held.is_held);
    EXPECT_EQ(held.activity, WorkerActivity::held);
    worker.say(LeaseRequest{1});
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
    EXPECT_FALSE(worker.answers<LeaseGrant>(kHeartbeat));
    EXPECT_THAT(ask<ReasonChain>(service->endpoint(), AskWhy{{}, "w"}).reasons.back().text,
                HasSubstr("worker w is held, and takes nothing new"));
    EXPECT_THAT(refused(service->endpoint(), OrderWorker{"x", WorkerOrder::hold}).message,
                HasSubstr("no worker has this name"));
  }

  // Whoever is the coordinator then.
  service.reset();
  service.emplace(options);
  FakeWorker worker(service->endpoint(), store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  worker.say(LeaseRequest{1});
  EXPECT_FALSE(worker.answers<LeaseGrant>(2 * kHeartbeat));
  EXPECT_TRUE(ask<JobList>(service->endpoint(), ListJobs{}).workers.at(0).is_held);
  const OrderWorker release{"w", WorkerOrder::release};
  EXPECT_FALSE(ask<JobList>(service->endpoint(), release).workers.at(0).is_held);
  worker.do_one_task();
}

TEST_F(ServiceTest, TwoWorkersOfOneNameWorkSideBySide) {
  const RunningService service(options);
  FakeWorker first(service.endpoint(), store(), job), second(service.endpoint(), store(), job);
  first.hello({}, 1);
  first.expect<WorkerWelcome>();
  second.hello({}, 2);
  second.expect<WorkerWelcome>();
  const JobAccepted accepted = ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  first.say(LeaseRequest{1});
  second.say(LeaseRequest{1});
  const LeaseId one = first.expect<LeaseGrant>().lease, other = second.expect<LeaseGrant>().lease;
  EXPECT_NE(one, other);

  // A hello of either takes nothing from the other.
  first.hello({one}, 1);
  first.expect<WorkerWelcome>();
  const JobList list = ask<JobList>(service.endpoint(), ListJobs{});
  ASSERT_THAT(list.workers, SizeIs(2));
  EXPECT_EQ(list.workers[0].worker_id, "w");
  EXPECT_EQ(list.workers[1].worker_id, "w#00000002");
  for (const WorkerSummary& worker : list.workers) EXPECT_EQ(worker.tasks.size(), 1u);
  EXPECT_EQ(show(service.endpoint(), accepted.version).summary.attempts_lost, 0u);
}

TEST_F(ServiceTest, AWorkerOfAnotherBuildIsRefusedUnlessBuildsMayMix) {
  for (const bool mixed : {false, true}) {
    options.mixed_builds = mixed;
    options.work_dir = folder / (mixed ? "mixed" : "one");
    const RunningService service(options);
    const fs::path blobs = options.work_dir / "store";
    FakeWorker first(service.endpoint(), blobs, job), second(service.endpoint(), blobs, job, "v"),
        third(service.endpoint(), blobs, job, "u");
    first.hello();
    first.expect<WorkerWelcome>();
    second.hello({}, 2, "OTHER");
    third.say(WorkerHello{"u", "host", 3, 3, 2, "baton 0", "TEST", {}});
    if (mixed) {
      second.expect<WorkerWelcome>();
      third.expect<WorkerWelcome>();
      continue;
    }
    const Refused build = third.expect<Refused>();
    EXPECT_EQ(build.kind, static_cast<std::uint8_t>(ErrorKind::version));
    EXPECT_THAT(build.message, HasSubstr("worker u is baton 0, the coordinator baton "));
    // Who is there may be gone: only once it has shown itself for long enough is that the last
    // word.
    Refused renderer = second.expect<Refused>();
    EXPECT_EQ(renderer.kind, static_cast<std::uint8_t>(ErrorKind::timeout));
    while (renderer.kind == static_cast<std::uint8_t>(ErrorKind::timeout)) {
      first.say(Heartbeat{});
      second.hello({}, 2, "OTHER");
      renderer = second.expect<Refused>();
    }
    EXPECT_EQ(renderer.kind, static_cast<std::uint8_t>(ErrorKind::version));
    EXPECT_THAT(renderer.message, HasSubstr("worker v renders with OTHER, worker w with TEST"));
  }
}

// Also one that comes twice, or of a lease that is over.
TEST_F(ServiceTest, EveryReportIsConfirmed) {
  const RunningService service(options);
  ask<JobAccepted>(service.endpoint(), SubmitJob{document});
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.say(LeaseRequest{2});
  const LeaseId first = worker.expect<LeaseGrant>().lease,
                second = worker.expect<LeaseGrant>().lease;
  const TaskDone done = worker.work(first);
  for (int time = 0; time < 2; ++time) {
    worker.say(done);
    EXPECT_EQ(worker.expect<ReportReceived>().lease, first);
  }
  for (int time = 0; time < 2; ++time) {
    worker.say(TaskFailed{second, "boom"});
    EXPECT_EQ(worker.expect<ReportReceived>().lease, second);
  }
}

TEST_F(ServiceTest, QuestionsThatCannotBeAnsweredAreRefused) {
  const RunningService service(options);
  EXPECT_THAT(refused(service.endpoint(), ShowJob{"abc"}).message,
              HasSubstr("job 'abc': no job has this name or ID"));
  EXPECT_EQ(refused(service.endpoint(), SubmitJob{"{"}).kind, ErrorKind::bad_input);
  EXPECT_THAT(refused(service.endpoint(), JobDocumentRequest{}).message,
              HasSubstr("not known here"));
  EXPECT_THAT(refused(service.endpoint(), JobList{}).message, HasSubstr("not for a coordinator"));
  EXPECT_THAT(refused(service.endpoint(), WorkerHello{}).message, HasSubstr("needs a name"));
}

TEST_F(ServiceTest, BadMessagesAreRefusedAndHarmNobody) {
  const RunningService service(options);
  Socket stranger = Socket::connect(service.endpoint(), 0ms).value();
  std::vector<Bytes> frames = encode_message(ListJobs{});
  frames[0][5] ^= std::byte{0x40};
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(stranger.send(frames));
    const auto answer = stranger.receive(kPatience);
    ASSERT_TRUE(answer.has_value());
    const auto refusal = std::get<Refused>(decode_message(*answer).value());
    EXPECT_EQ(refusal.kind, static_cast<std::uint8_t>(ErrorKind::version));
  }
  ASSERT_TRUE(stranger.send({{}, {}}));
  EXPECT_TRUE(stranger.receive(kPatience).has_value());
  EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{}).jobs, SizeIs(0));
}

// Each lease that a worker names is looked up and answered: millions would stop the farm for
// seconds.
// One key could say hello under new names as fast as it can write, each a line of the history.
TEST_F(ServiceTest, AConnectionIsOneWorkersAndNamesAreShort) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello({}, 1);
  worker.expect<WorkerWelcome>();
  worker.hello({}, 2);
  EXPECT_THAT(worker.expect<Refused>().message, HasSubstr("this connection is another worker's"));
  worker.hello({}, 1);
  worker.expect<WorkerWelcome>();
  FakeWorker odd(service.endpoint(), store(), job, "odd");
  odd.hello({}, 4, std::string(4097, 'r'));
  EXPECT_THAT(odd.expect<Refused>().message, HasSubstr("at most 4096 bytes"));
  FakeWorker wordy(service.endpoint(), store(), job, std::string(257, 'w'));
  wordy.hello({}, 3);
  EXPECT_THAT(wordy.expect<Refused>().message, HasSubstr("a name of at most 256 bytes"));
}

TEST_F(ServiceTest, AWorkerCannotHaveMoreLeasesInHandThanItMay) {
  const RunningService service(options);
  const std::vector<LeaseId> leases(
      limits::kMaxLeasesPerWorker + limits::kMaxUnconfirmedReports + 1, LeaseId{});
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello(leases);
  EXPECT_THAT(worker.expect<Refused>().message, HasSubstr("1281 leases in hand"));
  worker.hello();
  worker.expect<WorkerWelcome>();
  worker.say(Heartbeat{leases});
  EXPECT_THAT(worker.expect<Refused>().message, HasSubstr("1281 leases in hand"));
}

TEST_F(ServiceTest, StoppingTellsTheWorkers) {
  RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  ask<Shutdown>(service.endpoint(), StopCoordinator{});
  EXPECT_TRUE(service.join().ok());
  worker.expect<Shutdown>();
}

TEST_F(ServiceTest, TheWorkFolderBelongsToOneCoordinator) {
  const RunningService service(options);
  const Result<Service> second = Service::open(options);
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message, HasSubstr("already in use by another coordinator"));
}

}  // namespace
}  // namespace baton
