#include "coordinator/schedule/blob_ledger.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {

BlobLedger::BlobLedger(const JobSpec& spec, const JobGraph& graph)
    : checkpoints_(graph),
      keep_all_states_(spec.state.keep == StateKeep::all),
      keep_films_(spec.quality.refinable),
      records_(static_cast<std::size_t>(graph.num_tasks())) {}

// ---- questions ----------------------------------------------------------------------------------

std::vector<BlobRef> BlobLedger::inputs(const JobView& job, TaskIndex task) const {
  if (const auto cut = cuts_.find(task); cut != cuts_.end()) return cut->second;
  BATON_CHECK(job.tasks.has_inputs(task));
  const TaskKey key = job.graph.key(task);
  std::vector<BlobRef> result;
  for (const TaskIndex input : job.graph.inputs(key)) {
    const std::vector<BlobRef>& made = job.made.outputs(input);
    for (const std::size_t position : job.graph.taken_outputs(key, job.graph.key(input)))
      result.push_back(made.at(position));
  }
  return result;
}

bool BlobLedger::is_needed(const JobView& job, TaskIndex task, const BlobRef& output) const {
  return num_needs(job, task, output) > 0;
}

std::vector<BlobRef> BlobLedger::live_blobs(const JobView& job, TaskIndex task) const {
  std::vector<BlobRef> live;
  for (const BlobRef& output : job.made.outputs(task)) {
    if (num_needs(job, task, output) > 0) live.push_back(output);
  }
  return live;
}

std::vector<BlobRef> BlobLedger::spare_blobs(const JobView& job, TaskIndex task) const {
  std::vector<BlobRef> spare;
  for (const BlobRef& output : job.made.outputs(task)) {
    if (num_needs(job, task, output) == 0 && num_uses(job, task, output) > 0)
      spare.push_back(output);
  }
  return spare;
}

bool BlobLedger::lacks_needed_output(const JobView& job, TaskIndex task) const {
  const TaskKey maker = job.graph.key(task);
  const std::vector<TaskIndex> dependents = job.graph.dependents(maker);
  return std::any_of(dependents.begin(), dependents.end(), [&](TaskIndex dependent) {
    if (!is_open(job.tasks.status(dependent)) || is_cut(dependent)) return false;
    const std::vector<std::size_t> taken = job.graph.taken_outputs(job.graph.key(dependent), maker);
    return std::any_of(taken.begin(), taken.end(), [&](std::size_t position) {
      return position >= job.made.outputs(task).size();
    });
  });
}

/// How many still need an output of a task that is done: the tasks that take it as input, and with
/// state.keep "all" the job's result. Completing a dependent makes it one less (release_inputs).
std::int32_t BlobLedger::num_needs(const JobView& job, TaskIndex task,
                                   const BlobRef& output) const {
  if (output.kind == BlobKind::image) return 0;
  std::int32_t uses = 0;
  const TaskKey maker = job.graph.key(task);
  for (const TaskIndex dependent : job.graph.dependents(maker)) {
    if (!job.graph.takes(job.graph.key(dependent), maker, output)) continue;
    const bool needs = job.tasks.status(dependent) != TaskStatus::done && !is_cut(dependent);
    uses += needs ? 1 : 0;
  }
  const bool kept = keep_all_states_ && output.kind == BlobKind::state;
  return uses + (kept ? 1 : 0);
}

/// Whether it stays for what may be lost or come after the job. Between checkpoints only what
/// workers have read of others stays: the rest of what a lost worker has made is lost with it.
bool BlobLedger::stays(const JobView& job, TaskIndex task, const BlobRef& output) const {
  if (output.kind == BlobKind::film) {
    const Step last_sweep = job.graph.timeline().last_step_of(FrameIndex(0));
    return keep_films_ && output.step() >= last_sweep && !record(task).films_let_go;
  }
  if (output.kind != BlobKind::state || output.is_held()) return false;
  const TaskKey key = job.graph.key(task);
  return checkpoints_.keeps(key) || (record(task).is_shared && checkpoints_.keeps_between(key));
}

/// The number of needs, and one more for what stays.
std::int32_t BlobLedger::num_uses(const JobView& job, TaskIndex task, const BlobRef& output) const {
  return num_needs(job, task, output) + (stays(job, task, output) ? 1 : 0);
}

/// Whether an open task takes films of it.
bool BlobLedger::needs_films(const JobView& job, TaskIndex task) const {
  const std::vector<TaskIndex> dependents = job.graph.dependents(job.graph.key(task));
  return std::any_of(dependents.begin(), dependents.end(), [&](TaskIndex dependent) {
    return job.graph.key(dependent).kind != TaskKind::render &&
           is_open(job.tasks.status(dependent));
  });
}

// ---- what tasks make ----------------------------------------------------------------------------

void BlobLedger::restore(const JobView& job, const std::vector<TaskIndex>& done,
                         const std::vector<BlobRef>& gone, const std::vector<Cut>& cuts,
                         BlobReferences& blobs) {
  for (const TaskIndex task : done) {
    if (const TaskKey key = job.graph.key(task); key.kind == TaskKind::render)
      checkpoints_.complete(key);
  }
  for (const BlobRef& blob : gone) {
    const TaskKey key = render_task(job.graph.timeline().run_of(blob.step()), blob.tile);
    const std::optional<TaskIndex> task = job.graph.find(key);
    if (!task) continue;
    if (blob.kind == BlobKind::state) checkpoints_.let_go(key);
    if (blob.kind == BlobKind::film) record(*task).films_let_go = true;
  }
  for (const Cut& cut : cuts) {
    const auto task = job.graph.find(cut.task);
    if (!task) continue;
    const bool is_task_open = is_open(job.tasks.status(*task));
    if (!is_task_open && !job.made.outputs(*task).empty()) continue;
    cuts_[*task] = cut.states;
    if (is_task_open) use_cut(*task, blobs);
  }
  for (const TaskIndex task : done) add_outputs(job, task, blobs);
}

void BlobLedger::forget_done_cuts(const JobView& job) {
  std::erase_if(cuts_, [&](const auto& cut) { return !is_open(job.tasks.status(cut.first)); });
}

void BlobLedger::complete(const JobView& job, TaskIndex task, bool is_shared,
                          BlobReferences& blobs) {
  record(task) = {is_shared, false};
  add_outputs(job, task, blobs);
  if (!release_cut(task, blobs)) release_inputs(job, task, blobs);
  if (const TaskKey key = job.graph.key(task); key.kind == TaskKind::render)
    let_go(job, checkpoints_.complete(key), blobs);
}

void BlobLedger::reopen(const JobView& job, TaskIndex task, BlobReferences& blobs) {
  release_outputs(job, task, blobs);
  if (const TaskKey key = job.graph.key(task); key.kind == TaskKind::render)
    checkpoints_.reopen(key);
}

/// Counts everybody's need of what a done task made.
void BlobLedger::add_outputs(const JobView& job, TaskIndex task, BlobReferences& blobs) const {
  for (const BlobRef& output : job.made.outputs(task)) {
    const std::int32_t uses = num_uses(job, task, output);
    for (std::int32_t use = 0; use < uses; ++use) blobs.add(output);
    if (uses == 0 && output.kind != BlobKind::image) blobs.discard(output.digest);
  }
}

void BlobLedger::add_shared_outputs(const JobView& job, TaskIndex task, BlobReferences& blobs) {
  record(task).is_shared = true;
  add_outputs(job, task, blobs);
}

void BlobLedger::release_outputs(const JobView& job, TaskIndex task, BlobReferences& blobs) const {
  for (const BlobRef& output : job.made.outputs(task)) {
    for (std::int32_t use = num_uses(job, task, output); use > 0; --use)
      blobs.release(output.digest);
  }
}

void BlobLedger::release_all(const JobView& job, BlobReferences& blobs) {
  for (TaskIndex task = 0; task < job.graph.num_tasks(); ++task) release_outputs(job, task, blobs);
  while (!cuts_.empty()) release_cut(cuts_.begin()->first, blobs);
}

/// States that have stayed need not stay any more.
void BlobLedger::let_go(const JobView& job, const std::vector<TaskKey>& renders,
                        BlobReferences& blobs) {
  for (const TaskKey& key : renders) {
    const TaskIndex task = *job.graph.find(key);
    for (const BlobRef& output : job.made.outputs(task)) {
      const bool stayed = output.kind == BlobKind::state && !output.is_held() &&
                          (checkpoints_.is_checkpoint(key) || record(task).is_shared);
      if (stayed) blobs.release(output.digest);
    }
  }
}

void BlobLedger::let_between_go(const JobView& job, BlobReferences& blobs) {
  let_go(job, checkpoints_.let_between_go(), blobs);
}

void BlobLedger::let_films_go(const JobView& job, BlobReferences& blobs) {
  for (TaskIndex task = 0; task < job.graph.num_tasks(); ++task) {
    for (const BlobRef& output : job.made.outputs(task)) {
      if (output.kind == BlobKind::film && stays(job, task, output)) blobs.release(output.digest);
    }
    record(task).films_let_go = true;
  }
}

// ---- what tasks need ----------------------------------------------------------------------------

std::vector<TaskIndex> BlobLedger::need_inputs(const JobView& job, TaskIndex task,
                                               BlobReferences& blobs) {
  if (is_cut(task) && !needs_films(job, task)) {
    use_cut(task, blobs);
    return {};
  }
  cuts_.erase(task);
  return ask_inputs(job, task, blobs);
}

std::vector<TaskIndex> BlobLedger::drop_cut(const JobView& job, TaskIndex task,
                                            BlobReferences& blobs) {
  if (!release_cut(task, blobs)) return {};
  return ask_inputs(job, task, blobs);
}

/// A task that is open again takes its part in the blobs of its inputs.
std::vector<TaskIndex> BlobLedger::ask_inputs(const JobView& job, TaskIndex task,
                                              BlobReferences& blobs) const {
  std::vector<TaskIndex> gone;
  const TaskKey key = job.graph.key(task);
  for (const TaskIndex input : job.graph.inputs(key)) {
    if (job.tasks.status(input) != TaskStatus::done) {
      if (is_cut(input) && key.kind != TaskKind::render) gone.push_back(input);
      continue;
    }
    bool is_there = true;
    const std::vector<BlobRef>& made = job.made.outputs(input);
    for (const std::size_t position : job.graph.taken_outputs(key, job.graph.key(input))) {
      if (position >= made.size()) {
        is_there = false;
        continue;
      }
      is_there = is_there && blobs.is_there(made[position].digest);
      blobs.expect(made[position].digest);
    }
    if (!is_there) gone.push_back(input);
  }
  return gone;
}

/// Where inputs were opened again meanwhile nothing is left to release.
void BlobLedger::release_inputs(const JobView& job, TaskIndex task, BlobReferences& blobs) const {
  const TaskKey key = job.graph.key(task);
  for (const TaskIndex input : job.graph.inputs(key)) {
    if (job.tasks.status(input) != TaskStatus::done) continue;
    const std::vector<BlobRef>& made = job.made.outputs(input);
    for (const std::size_t position : job.graph.taken_outputs(key, job.graph.key(input))) {
      if (position < made.size()) blobs.release(made[position].digest);
    }
  }
}

void BlobLedger::share_inputs(const JobView& job, TaskIndex task, const std::string& worker,
                              BlobReferences& blobs) {
  const TaskKey key = job.graph.key(task);
  if (key.kind != TaskKind::render || !job.graph.shares_history() || is_cut(task)) return;
  for (const TaskIndex input : job.graph.inputs(key)) {
    if (record(input).is_shared || job.made.maker(input) == worker) continue;
    record(input).is_shared = true;
    // Films stay or go whoever has read the state.
    for (const BlobRef& output : job.made.outputs(input)) {
      if (output.kind == BlobKind::state && !checkpoints_.keeps(job.graph.key(input)) &&
          stays(job, input, output))
        blobs.add(output);
    }
  }
}

void BlobLedger::use_cut(TaskIndex task, BlobReferences& blobs) const {
  for (const BlobRef& state : cuts_.at(task)) blobs.add(state);
}

/// False: the task is no cut.
bool BlobLedger::release_cut(TaskIndex task, BlobReferences& blobs) {
  const auto cut = cuts_.find(task);
  if (cut == cuts_.end()) return false;
  for (const BlobRef& state : cut->second) blobs.release(state.digest);
  cuts_.erase(cut);
  return true;
}

}  // namespace baton
