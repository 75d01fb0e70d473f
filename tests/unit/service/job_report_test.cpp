#include "coordinator/service/job_report.h"

#include <gmock/gmock.h>

#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;

std::string report_of(const JobSpec& spec, const TaskKey& task) {
  Farm farm(spec);
  farm.submit();
  const Failure failure{{farm.job, task, 1, 1}, "w", "boom"};
  const JobDetail detail = describe_job(farm.scheduler, farm.job, {failure});
  return detail.failures.empty() ? std::string() : detail.failures.front();
}

TEST(JobReport, AFailureIsToldWithTheFramesOfItsTask) {
  JobSpec job = small_job(2, 4, 2);
  for (FrameNumber& frame : job.frames) frame = frame + 1000;
  EXPECT_EQ(report_of(job, render(1, 1)), "frames 1003-1004, tile 1 on w: boom");
  EXPECT_EQ(report_of(job, assemble(3)), "frame 1004 on w: boom");
  EXPECT_EQ(report_of(job, render(9, 1)), "boom") << "no such task";
  job.visibility.correlated = true;
  EXPECT_EQ(report_of(job, second_pass_task(Step(2), 0)),
            "frame 1003, tile 0, second pass on w: boom");
}

// A cause is told once, however many tasks it hits.
TEST(JobReport, FailuresOfOneCauseAreOneLine) {
  Farm farm(small_job(3, 2, 2));
  farm.submit();
  std::vector<Failure> failures;
  for (int tile = 0; tile < 3; ++tile) {
    const std::string message = "no such folder\nto replay it alone: tile " + std::to_string(tile);
    failures.push_back({{farm.job, render(0, tile), 1, 1}, "w", message});
  }
  failures.insert(failures.begin() + 1, {{farm.job, render(0, 0), 2, 1}, "v", "no such folder"});
  failures.push_back({{farm.job, assemble(0), 1, 1}, "w", "disk full"});
  EXPECT_THAT(describe_job(farm.scheduler, farm.job, failures).failures,
              testing::ElementsAre("frames 1-2, tile 0 on v: no such folder",
                                   "3 failures, the last frames 1-2, tile 2 on w: no such folder\n"
                                   "to replay it alone: tile 2",
                                   "frame 1 on w: disk full"));
}

// Runs 0 and 1 are the first sweep, 2 and 3 the second.
TEST(JobReport, ATaskOfALaterSweepSaysWhichOne) {
  const JobSpec job = with_sweeps(small_job(2, 4, 2), 3);
  EXPECT_EQ(report_of(job, render(3, 0)), "frames 3-4, tile 0, sweep 2 on w: boom");
  EXPECT_EQ(report_of(job, render(4, 0)), "frames 1-2, tile 0, sweep 3 on w: boom");
}

}  // namespace
}  // namespace baton
