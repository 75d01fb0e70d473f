#include <gmock/gmock.h>

#include "tests/unit/service/fake_farm.h"

namespace baton::testing_service {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

struct AnswersTest : ServiceTest {
  JobId submit(const std::string& endpoint, const JobSpec& spec) {
    return ask<JobAccepted>(endpoint, SubmitJob{make_job_document(spec).value()}).identity.id;
  }
  std::vector<Reason> why(const std::string& endpoint, const AskWhy& question) {
    return ask<ReasonChain>(endpoint, question).reasons;
  }
  std::vector<Reason> why_job(const std::string& endpoint, const JobId& id) {
    return why(endpoint, {id.hex(), ""});
  }
  JobNow now_of(const std::string& endpoint, const JobId& id) {
    for (const ListedJob& listed : ask<JobList>(endpoint, ListJobs{true}).jobs) {
      if (listed.identity.id == id) return listed.now;
    }
    ADD_FAILURE() << "not listed";
    return {};
  }
};

TEST_F(AnswersTest, AJobSaysWhatItDoesAndWhy) {
  const RunningService service(options);
  const std::string& endpoint = service.endpoint();
  const JobId id = submit(endpoint, job);
  EXPECT_EQ(now_of(endpoint, id), (JobNow{JobActivity::waiting, "no worker is connected"}));
  std::vector<Reason> chain = why_job(endpoint, id);
  ASSERT_THAT(chain, SizeIs(2));
  EXPECT_EQ(chain[0].text, "frame 1 waits for its tile 0");
  EXPECT_EQ(chain[1].kind, ReasonKind::no_worker);
  EXPECT_GT(chain[1].since_ms, 0) << "since the coordinator was started";

  FakeWorker worker(endpoint, store(), job);
  worker.hello();
  worker.expect<WorkerWelcome>();
  worker.do_one_task();
  worker.say(LeaseRequest{1});
  worker.expect<LeaseGrant>();
  EXPECT_EQ(now_of(endpoint, id).activity, JobActivity::rendering);
  chain = why(endpoint, {id.hex(), "", true, FrameNumber(4), 1});
  ASSERT_THAT(chain, SizeIs(2));
  EXPECT_EQ(chain[0].text, "frames 3-4, tile 1 waits for the state of frames 1-2, tile 1");
  EXPECT_EQ(chain[1].text, "frames 1-2, tile 1 is with worker w");
  EXPECT_EQ(chain[1].usual.count, 1);
  EXPECT_GT(chain[1].seconds, 0);
  EXPECT_THAT(refused(endpoint, AskWhy{id.hex(), "", true, FrameNumber(9)}).message,
              HasSubstr("has no frame 9: it has 1-4"));
  EXPECT_THAT(refused(endpoint, AskWhy{id.hex(), "", true, FrameNumber(1), 2}).message,
              HasSubstr("has no tile 2: it has 0 to 1"));

  // Another one waits for its turn.
  JobSpec second = job;
  second.name = "second";
  second.output.directory += "-second";
  const JobId later = submit(endpoint, second);
  EXPECT_EQ(now_of(endpoint, later).activity, JobActivity::queued);
  EXPECT_THAT(now_of(endpoint, later).reason,
              HasSubstr("the only worker that could do it has tasks of job " + id.short_hex()));
  chain = why(endpoint, {"", "w"});
  ASSERT_THAT(chain, SizeIs(1));
  EXPECT_EQ(chain[0].kind, ReasonKind::running);

  ask<ShownJob>(endpoint, PauseJob{later.hex()});
  EXPECT_EQ(now_of(endpoint, later), (JobNow{JobActivity::paused, "by a person"}));
  ask<ShownJob>(endpoint, CancelJob{later.hex()});
  EXPECT_EQ(now_of(endpoint, later).activity, JobActivity::cancelled);
  EXPECT_EQ(why_job(endpoint, later).at(0).text, "the job is cancelled");
}

TEST_F(AnswersTest, WorkersSayWhatTheyDoAndTheLostAreListed) {
  {
    const RunningService service(options);
    const std::string& endpoint = service.endpoint();
    FakeWorker worker(endpoint, store(), job);
    worker.hello();
    worker.expect<WorkerWelcome>();
    auto list = ask<JobList>(endpoint, ListJobs{});
    ASSERT_THAT(list.workers, SizeIs(1));
    EXPECT_EQ(list.workers[0].activity, WorkerActivity::idle);
    EXPECT_EQ(list.workers[0].renderer, "TEST");
    EXPECT_EQ(list.workers[0].build, build_identity());
    EXPECT_EQ(why(endpoint, {"", "w"}).at(0).kind, ReasonKind::no_job);

    const JobId id = submit(endpoint, job);
    worker.say(LeaseRequest{1});
    const LeaseId lease = worker.expect<LeaseGrant>().lease;
    list = ask<JobList>(endpoint, ListJobs{});
    EXPECT_EQ(list.workers[0].activity, WorkerActivity::rendering);
    const auto tasks = ask<TaskList>(endpoint, ListTasks{}).tasks;
    ASSERT_THAT(tasks, SizeIs(1));
    EXPECT_EQ(tasks[0].worker, "w");
    EXPECT_EQ(place_text(tasks[0].task), "frames 1-2, tile 0");

    worker.say(LeaseReturn{lease, "/shows"});
    worker.say(LeaseRequest{0});
    for (list = ask<JobList>(endpoint, ListJobs{}); list.workers[0].blind.empty();)
      list = ask<JobList>(endpoint, ListJobs{});
    EXPECT_EQ(list.workers[0].blind[0].job, id);
    EXPECT_EQ(list.workers[0].blind[0].folder, "/shows");
    EXPECT_EQ(now_of(endpoint, id), (JobNow{JobActivity::waiting, "worker w does not see /shows"}));
    EXPECT_EQ(why(endpoint, {"", "w"}).at(0).kind, ReasonKind::blind);

    // It says nothing any more.
    for (const auto end = std::chrono::steady_clock::now() + kPatience;
         list.lost.empty() && std::chrono::steady_clock::now() < end;
         std::this_thread::sleep_for(20ms))
      list = ask<JobList>(endpoint, ListJobs{});
    EXPECT_THAT(list.workers, IsEmpty());
    ASSERT_THAT(list.lost, SizeIs(1));
    EXPECT_EQ(list.lost[0].worker_id, "w");
    EXPECT_THAT(list.lost[0].about, HasSubstr("2 threads on host, TEST"));
    EXPECT_EQ(now_of(endpoint, id).reason, "no worker is connected");
    EXPECT_EQ(why(endpoint, {"", "w"}).at(0).kind, ReasonKind::gone);
  }
  const RunningService again(options);
  EXPECT_THAT(ask<JobList>(again.endpoint(), ListJobs{}).lost, SizeIs(1)) << "for a day";
  FakeWorker back(again.endpoint(), store(), job);
  back.hello();
  back.expect<WorkerWelcome>();
  EXPECT_THAT(ask<JobList>(again.endpoint(), ListJobs{}).lost, IsEmpty()) << "it is here";
}

TEST_F(AnswersTest, APriorityIsSetWithoutANewVersionUntilAFileIsSubmitted) {
  JobId id;
  const auto priority = [&](const std::string& endpoint) {
    return ask<ShownJob>(endpoint, ShowJob{id.hex()}).detail.summary.priority;
  };
  {
    const RunningService service(options);
    id = submit(service.endpoint(), job);
    const auto shown = ask<ShownJob>(service.endpoint(), SetPriority{id.hex(), 90});
    EXPECT_EQ(shown.identity.version, 1);
    EXPECT_EQ(shown.detail.summary.priority, 90);
    EXPECT_EQ(refused(service.endpoint(), SetPriority{id.hex(), 101}).kind, ErrorKind::usage);
    const auto told = ask<EventList>(service.endpoint(), ListEvents{id.hex(), {}}).events;
    EXPECT_EQ(told.back().kind, FarmEventKind::priority_changed);
    EXPECT_EQ(told.back().reason, "90, it was 50");
  }
  const RunningService service(options);
  EXPECT_EQ(priority(service.endpoint()), 90) << "after a restart";
  ask<JobAccepted>(service.endpoint(), SubmitJob{document, false, /*keep_priority=*/true});
  EXPECT_EQ(priority(service.endpoint()), 90) << "no file was submitted";
  submit(service.endpoint(), job);
  EXPECT_EQ(priority(service.endpoint()), 50) << "the same document again";
  ask<ShownJob>(service.endpoint(), SetPriority{id.hex(), 90});
  JobSpec longer = job;
  longer.frames.emplace_back(5);
  submit(service.endpoint(), longer);
  EXPECT_EQ(priority(service.endpoint()), 50) << "a longer job";
  EXPECT_EQ(ask<EventList>(service.endpoint(), ListEvents{id.hex(), {}}).events.back().reason,
            "frames 1-5, it was 1-4; priority 50, it was 90");
  longer.priority = 20;
  submit(service.endpoint(), longer);
  EXPECT_EQ(priority(service.endpoint()), 20) << "what was written last counts";
  submit(service.endpoint(), job);
  EXPECT_EQ(priority(service.endpoint()), 50) << "what was set before is forgotten";
  ask<ShownJob>(service.endpoint(), CancelJob{id.hex()});
  EXPECT_THAT(refused(service.endpoint(), SetPriority{id.hex(), 1}).message,
              HasSubstr("has ended"));
}

TEST(RecentPast, UsualIsTheMedianOfTheLastTasks) {
  RecentPast past;
  const auto add = [&](double seconds, TaskKind kind = TaskKind::render) {
    past.add({.kind = FarmEventKind::task_done,
              .job = {7},
              .has_task = true,
              .task = {.kind = kind},
              .seconds = seconds});
  };
  EXPECT_EQ(past.usual({7}, TaskKind::render).count, 0);
  for (int i = 0; i < 100; ++i) add(1000);
  for (int i = 1; i <= 32; ++i) add(i);
  add(0.1, TaskKind::assemble);
  EXPECT_EQ(past.usual({7}, TaskKind::render), (UsualTime{16.5, 7.75, 32}));
  EXPECT_EQ(past.usual({7}, TaskKind::assemble).median_s, 0.1);
  EXPECT_EQ(past.usual({8}, TaskKind::render).count, 0);
  past.add({.kind = FarmEventKind::job_deleted, .job = {7}});
  EXPECT_EQ(past.usual({7}, TaskKind::render).count, 0);
}

TEST_F(AnswersTest, WhateverAWorkerIsCalledItIsShown) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job, "bad\xff\n\x1b[31m");
  worker.hello();
  worker.expect<WorkerWelcome>();
  const std::string shown = "bad\ufffd\\n\\x1b[31m";
  const auto list = ask<JobList>(service.endpoint(), ListJobs{});
  ASSERT_THAT(list.workers, SizeIs(1));
  EXPECT_EQ(list.workers[0].worker_id, shown);
  EXPECT_EQ(ask<EventList>(service.endpoint(), ListEvents{}).events.back().worker, shown);
  EXPECT_EQ(why(service.endpoint(), {"", shown}).at(0).kind, ReasonKind::no_job);
  EXPECT_EQ(why(service.endpoint(), {"", "bad\xff\n\x1b[31m"}).at(0).kind, ReasonKind::no_job)
      << "as it was given";
}

TEST(RecentPast, NobodyIsThereSinceTheLastOneWentWhoeverWasTheCoordinator) {
  RecentPast past;
  std::int64_t time = 0;
  const auto add = [&](FarmEventKind kind, const std::string& worker = {}) {
    past.add({.time_ms = ++time, .kind = kind, .worker = worker});
  };
  using enum FarmEventKind;
  add(coordinator_started);
  EXPECT_EQ(past.alone_since_ms(), 1);
  add(worker_joined, "a");
  EXPECT_EQ(past.alone_since_ms(), 0);
  add(worker_drained, "a");
  add(worker_left, "a");
  add(coordinator_started);
  EXPECT_EQ(past.alone_since_ms(), 4) << "not since the start";
  ASSERT_NE(past.absent("a"), nullptr);
  EXPECT_EQ(past.absent("a")->absence, Absence::left);
  EXPECT_EQ(past.absent("a")->reason, "it was told to finish");
  EXPECT_THAT(past.lost(0), IsEmpty());
  add(worker_joined, "a");
  EXPECT_EQ(past.absent("a"), nullptr);
  add(coordinator_started);
  EXPECT_EQ(past.alone_since_ms(), 7) << "it went with the coordinator before";
}

}  // namespace
}  // namespace baton::testing_service
