#include <gmock/gmock.h>

#include <fstream>

#include "tests/unit/service/frames_fixture.h"

/// Jobs that grow, and what their frames tell.
namespace baton {
namespace {

using namespace testing_service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

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

}  // namespace
}  // namespace baton
