#include "common/job/plan/timeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "common/job/plan/sequence.h"

namespace baton {
namespace {

using testing::ElementsAreArray;

struct Shape {
  int frames = 1, sweeps = 1, checkpoint_every = 1;
  std::vector<int> leading;
};

JobSpec job_of(const Shape& shape) {
  JobSpec job;
  job.frames.clear();
  for (int i = 0; i < shape.frames; ++i) job.frames.emplace_back(10 + 3 * i);
  job.quality.sweeps = shape.sweeps;
  job.state.checkpoint_every = shape.checkpoint_every;
  for (const int start : shape.leading) job.leading_runs.emplace_back(start);
  return job;
}

/// The run of each step, one step after the other: a new one begins where a leading run does, and
/// after the last of these at every checkpoint of a sweep.
std::vector<int> runs_by_step(const Shape& shape) {
  std::vector<int> runs;
  for (int step = 0; step < shape.frames * shape.sweeps; ++step) {
    const int frame = step % shape.frames;
    const bool is_led = !shape.leading.empty() && step <= shape.leading.back();
    const bool begins =
        is_led ? std::ranges::count(shape.leading, step) > 0 : frame % shape.checkpoint_every == 0;
    runs.push_back(step == 0 ? 0 : runs.back() + (begins ? 1 : 0));
  }
  return runs;
}

void expect_brute_force(const Shape& shape) {
  const JobSpec job = job_of(shape);
  const Timeline timeline(job);
  const std::vector<int> runs = runs_by_step(shape);
  ASSERT_EQ(timeline.num_frames(), shape.frames);
  ASSERT_EQ(timeline.num_steps(), std::ssize(runs));
  ASSERT_EQ(num_steps(job), std::ssize(runs));
  ASSERT_EQ(timeline.num_runs(), runs.back() + 1);
  ASSERT_EQ(num_runs(job), runs.back() + 1);
  ASSERT_EQ(timeline.run_starts().size(), static_cast<std::size_t>(runs.back() + 1));

  Step step;
  for (Sweep sweep; sweep.value() < shape.sweeps; ++sweep) {
    for (FrameIndex frame; frame.value() < shape.frames; ++frame, ++step) {
      ASSERT_EQ(timeline.step_of(frame, sweep), step);
      ASSERT_EQ(timeline.frame_of(step), frame);
      ASSERT_EQ(timeline.sweep_of(step), sweep);
      ASSERT_EQ(timeline.run_of(step), Run(runs[step.index()]));
      ASSERT_EQ(timeline.last_step_of(frame) == step, sweep.value() + 1 == shape.sweeps);
    }
  }
  for (Run run; run.value() < timeline.num_runs(); ++run) {
    const StepSpan steps = timeline.steps_of(run);
    ASSERT_EQ(timeline.run_starts()[run.index()], steps.first);
    ASSERT_EQ(std::ranges::count(runs, run.value()), steps.size());
    ASSERT_EQ(runs[steps.first.index()], run.value());
    ASSERT_EQ(runs[steps.last.index()], run.value());
    ASSERT_EQ(tile_run(job, 5, run), (TileRun{5, run, steps}));
  }
}

TEST(Timeline, IsThatOfSmallJobsStepByStep) {
  for (int frames = 1; frames <= 7; ++frames) {
    for (int sweeps = 1; sweeps <= 3; ++sweeps) {
      for (int every = 1; every <= 4; ++every) {
        const int steps = frames * sweeps;
        for (const std::vector<int>& leading :
             {std::vector<int>{}, {0}, {0, 1}, {0, 2, 5}, {0, 3, 4, 8}, {0, 1, steps - 1}}) {
          std::vector<int> within;
          std::ranges::copy_if(leading, std::back_inserter(within),
                               [&](int start) { return start < steps; });
          within.erase(std::unique(within.begin(), within.end()), within.end());
          if (!std::ranges::is_sorted(within)) continue;
          SCOPED_TRACE(testing::Message() << frames << " frames, " << sweeps << " sweeps, every "
                                          << every << ", led " << testing::PrintToString(within));
          expect_brute_force({frames, sweeps, every, within});
          if (testing::Test::HasFatalFailure()) return;
        }
      }
    }
  }
}

std::vector<int> starts_of(const JobSpec& job) {
  const Timeline timeline(job);
  std::vector<int> starts;
  for (const Step start : timeline.run_starts()) starts.push_back(start.value());
  return starts;
}

// Runs of a job that was shorter stay as they were; what it led beyond the end is left out.
TEST(Timeline, LeadingRunsComeBeforeTheRegularOnes) {
  JobSpec job = job_of({.frames = 30, .checkpoint_every = 12, .leading = {}});
  EXPECT_THAT(starts_of(job), ElementsAreArray({0, 12, 24}));
  job.leading_runs = {Step(0), Step(5), Step(8)};
  EXPECT_THAT(starts_of(job), ElementsAreArray({0, 5, 8, 12, 24}));
  job.frames.resize(7);
  EXPECT_THAT(starts_of(job), ElementsAreArray({0, 5}));
  EXPECT_EQ(tile_run(job, 0, baton::Run(1)).steps.last, Step(6));
}

// Runs end with their sweep; the frames before stay as they were when there are more sweeps.
TEST(Timeline, EachSweepHasTheSameRuns) {
  JobSpec job = job_of({.frames = 5, .sweeps = 3, .checkpoint_every = 2, .leading = {}});
  job.quality.rounds = 4;
  EXPECT_THAT(starts_of(job), ElementsAreArray({0, 2, 4, 5, 7, 9, 10, 12, 14}));
  job.leading_runs = {Step(0), Step(1)};
  EXPECT_THAT(starts_of(job), ElementsAreArray({0, 1, 2, 4, 5, 7, 9, 10, 12, 14}));

  const FrameSpec step = expand_sequence(job)[8];
  EXPECT_EQ(step.step, Step(8));
  EXPECT_EQ(step.number, job.frames[3]);
  EXPECT_EQ(step.first_round, 4);
  EXPECT_EQ(step.round_of_frame(Round(-1)), 3) << "before those that are seen";
}

}  // namespace
}  // namespace baton
