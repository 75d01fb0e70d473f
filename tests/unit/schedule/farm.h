#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/schedule/adoption.h"
#include "coordinator/schedule/scheduler.h"

namespace baton::testing_farm {

using namespace std::chrono_literals;

inline constexpr auto kSilence = std::chrono::milliseconds(4000);

/// A job of `tiles` tiles in one row and `frames` frames, `per_run` of them in a lease.
inline JobSpec small_job(int tiles, int frames, int per_run, bool carry = true) {
  JobSpec job;
  job.sampling.method = Method::sequential;
  job.image = {.width = 8 * tiles, .height = 8, .sites = 1, .tile_size = 8};
  job.frames.clear();
  for (int i = 0; i < frames; ++i) job.frames.emplace_back(i + 1);
  job.state.carry = carry;
  job.state.checkpoint_every = per_run;
  return job;
}

/// The same with a camera that moves, so that history is followed `reach_px` pixels to either side.
inline JobSpec moving_job(int tiles, int frames, int reach_px) {
  JobSpec job = small_job(tiles, frames, 2);
  job.camera.keys = {{.frame = 1, .position = {0, 0, 5}, .look_at = {}, .up = {0, 1, 0}}};
  job.motion.max_px = reach_px;
  return job;
}

/// The same, so many times over.
inline JobSpec with_sweeps(JobSpec job, int sweeps, bool refinable = true) {
  job.quality.sweeps = sweeps;
  job.quality.refinable = refinable;
  return job;
}

/// The one right output of a task; `variant` makes another, wrong one.
inline Digest blob_digest(const Digest& job, const BlobRef& blob, int variant = 0) {
  return digest_of(job.hex() + std::to_string(static_cast<int>(blob.kind)) + "/" +
                   std::to_string(blob.position) + "/" + std::to_string(blob.tile) + "/" +
                   std::to_string(variant));
}

inline std::vector<BlobRef> outputs_of(const JobSpec& spec, const Digest& job, const TaskKey& task,
                                       int variant = 0) {
  std::vector<BlobRef> outputs;
  if (task.kind == TaskKind::assemble) {
    outputs.push_back({BlobKind::image, task.position, 0, {}, 100});
  } else if (task.kind == TaskKind::second_pass) {
    outputs.push_back({BlobKind::film, task.position, task.tile, {}, 11});
  } else {
    const StepSpan steps = tile_run(spec, task.tile, task.run()).steps;
    for (Step s = steps.first; s <= steps.last; ++s)
      outputs.push_back({BlobKind::film, s.value(), task.tile, {}, 10});
    for (Step s = steps.first; spec.visibility.correlated && s <= steps.last; ++s)
      outputs.push_back({BlobKind::first_pass, s.value(), task.tile, {}, 30});
    if (carries_state(spec))
      outputs.push_back({BlobKind::state, steps.last.value(), task.tile, {}, 20});
  }
  const bool second = task.kind == TaskKind::second_pass;  // its film is another
  for (BlobRef& blob : outputs) blob.digest = blob_digest(job, blob, variant + (second ? 100 : 0));
  return outputs;
}

/// What of these a task makes that was granted these steps: a cut renders no film.
inline std::vector<BlobRef> outputs_of_grant(const JobSpec& spec, const Digest& job,
                                             const TaskKey& task, const StepSpan& steps) {
  std::vector<BlobRef> outputs = outputs_of(spec, job, task);
  if (steps.empty())
    std::erase_if(outputs, [](const BlobRef& blob) { return blob.kind != BlobKind::state; });
  return outputs;
}

/// As the journal has it, with a sky.
inline ParsedJobDocument document_of(JobSpec job) {
  job.environment.keys = {{.frame = 1, .map = "/sky.exr"}};
  const Digest picture = picture_digest(job, {});
  const Digest digest = digest_of(to_json(job));
  return {std::move(job), {}, digest, picture};
}

/// What a journal holds of these.
inline Completions completions_of(const std::vector<Completion>& all) {
  Completions completions;
  for (const Completion& completion : all) completions.add(completion);
  return completions;
}

template <class T>
std::vector<T> all_of(const std::vector<Action>& actions) {
  std::vector<T> result;
  for (const Action& action : actions) {
    if (const T* match = std::get_if<T>(&action)) result.push_back(*match);
  }
  return result;
}

/// The states that are in the store, with their steps, as far as the actions tell.
class StoredStates {
 public:
  void note(const std::vector<Action>& actions) {
    for (const RecordCompletion& done : all_of<RecordCompletion>(actions)) {
      for (const BlobRef& blob : done.completion.made.outputs) {
        if (blob.kind == BlobKind::state && !blob.is_held()) steps_[blob.digest] = blob.position;
      }
    }
    for (const RemoveBlobs& removed : all_of<RemoveBlobs>(actions)) {
      for (const Digest& blob : removed.blobs) steps_.erase(blob);
    }
  }
  std::size_t size() const { return steps_.size(); }
  std::set<int> steps() const {
    std::set<int> steps;
    for (const auto& [digest, step] : steps_) steps.insert(step);
    return steps;
  }

 private:
  std::map<Digest, int> steps_;
};

/// Of random farms: 1,000, or as the environment says: 20,000 are some ten million events.
inline std::uint32_t num_seeds() {
  const char* const text = std::getenv("BATON_MODEL_SEEDS");
  return text != nullptr ? static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)) : 1000;
}

inline TaskKey render(int run, int tile) { return render_task(Run(run), tile); }
inline TaskKey assemble(int frame) { return assemble_task(FrameIndex(frame)); }

inline std::vector<TaskKey> tasks_of(const std::vector<GrantLease>& grants) {
  std::vector<TaskKey> tasks;
  for (const GrantLease& grant : grants) tasks.push_back(grant.lease.task);
  return tasks;
}

/// A scheduler with a clock and one job, driven by the words of a test.
class Farm {
 public:
  explicit Farm(JobSpec spec, std::uint32_t epoch = 1, std::uint64_t store_limit = 0,
                bool may_take_over = false)
      : spec_(std::move(spec)),
        scheduler({epoch, kSilence, store_limit, may_take_over}),
        job(digest_of("job")) {}

  std::vector<Action> submit() { return step(JobAdded{job, spec_, JobStatus::running, {}, {}}); }
  /// Frames that are to be inspected are all there.
  std::vector<Action> step(const Event& event) {
    std::vector<Action> actions = scheduler.step(event, now);
    for (const InspectFrames& all : all_of<InspectFrames>(actions)) {
      const std::vector<Action> more = scheduler.step(FramesInspected{all.job}, now);
      actions.insert(actions.end(), more.begin(), more.end());
    }
    return actions;
  }
  std::vector<GrantLease> ask(const std::string& worker, int count) {
    return all_of<GrantLease>(step(WorkRequested{worker, count}));
  }
  GrantLease ask_one(const std::string& worker) {
    const auto grants = ask(worker, 1);
    return grants.empty() ? GrantLease{} : grants.front();
  }
  std::vector<Action> finish(const GrantLease& grant, int variant = 0) {
    return step(TaskCompleted{
        grant.worker, grant.lease, {outputs_of(spec_, job, grant.lease.task, variant)}});
  }
  std::vector<Action> fail(const GrantLease& grant, bool permanent = false) {
    return step(AttemptFailed{{grant.lease, grant.worker, "boom", permanent}});
  }
  /// Lets the worker do whatever it is given until nothing is left. Returns every action on the
  /// way.
  std::vector<Action> work_off(const std::string& worker) {
    std::vector<Action> seen = step(WorkRequested{worker, 10});
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const GrantLease* found = std::get_if<GrantLease>(&seen[i]);
      if (!found) continue;
      const GrantLease grant = *found;
      for (const Event& event :
           {Event(TaskCompleted{
                grant.worker, grant.lease, {outputs_of(spec_, job, grant.lease.task)}}),
            Event(WorkRequested{worker, 10})}) {
        const std::vector<Action> more = step(event);
        seen.insert(seen.end(), more.begin(), more.end());
      }
    }
    return seen;
  }
  JobProgress progress() const { return scheduler.find_job(job)->tasks.progress(); }
  JobStatus status() const { return scheduler.find_job(job)->status; }
  const JobSpec& spec() const { return spec_; }

 private:
  JobSpec spec_;

 public:
  Scheduler scheduler;
  Digest job;
  TimePoint now{};
};

/// One job of 2 tiles, 4 frames, 2 frames a run; workers "a" and "b" are there.
struct SchedulerTest : testing::Test {
  Farm farm{small_job(2, 4, 2)};

  void SetUp() override {
    farm.submit();
    farm.step(WorkerJoined{"a", {}});
    farm.step(WorkerJoined{"b", {}});
  }
};

}  // namespace baton::testing_farm
