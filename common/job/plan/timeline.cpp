#include "common/job/plan/timeline.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/job/job_facts.h"
#include "common/job/motion.h"

namespace baton {

Timeline::Timeline(const JobSpec& job)
    : num_frames_(static_cast<std::int32_t>(job.frames.size())),
      num_steps_(baton::num_steps(job)),
      starts_(job.leading_runs) {
  std::erase_if(starts_, [&](Step start) { return start.value() >= num_steps_; });
  if (starts_.empty()) starts_.emplace_back();
  const std::int32_t length = frames_per_run(job);
  while (true) {
    const std::int32_t frame = frame_of(starts_.back()).value();
    const std::int32_t end_in_sweep = std::min((frame / length + 1) * length, num_frames_);
    const Step next = starts_.back() + (end_in_sweep - frame);
    if (next.value() >= num_steps_) return;
    starts_.push_back(next);
  }
}

StepSpan Timeline::steps_of(Run run) const {
  BATON_CHECK(run.value() >= 0 && run.value() < num_runs());
  const Step end = run.value() + 1 < num_runs() ? starts_[run.index() + 1] : Step(num_steps_);
  return {starts_[run.index()], end - 1};
}

Run Timeline::run_of(Step step) const {
  const auto after = std::upper_bound(starts_.begin(), starts_.end(), step);
  return Run(static_cast<std::int32_t>(after - starts_.begin()) - 1);
}

std::int32_t frames_per_run(const JobSpec& job) {
  return shares_history(job) && carries_state(job) ? 1 : job.state.checkpoint_every;
}

std::int32_t num_steps(const JobSpec& job) {
  return static_cast<std::int32_t>(job.frames.size()) * job.quality.sweeps;
}

std::int32_t num_runs(const JobSpec& job) {
  if (!job.leading_runs.empty()) return Timeline(job).num_runs();
  const auto frames = static_cast<std::int32_t>(job.frames.size());
  return (frames + frames_per_run(job) - 1) / frames_per_run(job) * job.quality.sweeps;
}

std::int32_t runs_per_checkpoint(const JobSpec& job) {
  return (job.state.checkpoint_every + frames_per_run(job) - 1) / frames_per_run(job);
}

bool ends_in_checkpoint(const JobSpec& job, Run run) {
  return carries_state(job) &&
         ((run.value() + 1) % runs_per_checkpoint(job) == 0 || run.value() + 1 == num_runs(job));
}

std::int32_t num_common_frames(const JobSpec& a, const JobSpec& b) {
  const auto end =
      std::mismatch(a.frames.begin(), a.frames.end(), b.frames.begin(), b.frames.end());
  return static_cast<std::int32_t>(end.first - a.frames.begin());
}

}  // namespace baton
