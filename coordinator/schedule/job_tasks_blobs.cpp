#include <algorithm>

#include "common/base/check.h"
#include "coordinator/schedule/job_tasks.h"

namespace baton {

// ---- who needs which blob -----------------------------------------------------------------------

void JobTasks::release_all(BlobReferences& blobs) {
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) release_outputs(task, blobs);
  while (!cuts_.empty()) drop_cut(cuts_.begin()->first, blobs);
}

std::vector<BlobRef> JobTasks::live_blobs(TaskIndex task) const {
  std::vector<BlobRef> live;
  for (const BlobRef& output : outputs(task)) {
    if (num_needs(task, output) > 0) live.push_back(output);
  }
  return live;
}

std::vector<BlobRef> JobTasks::spare_blobs(TaskIndex task) const {
  std::vector<BlobRef> spare;
  for (const BlobRef& output : outputs(task)) {
    if (num_needs(task, output) == 0 && num_uses(task, output) > 0) spare.push_back(output);
  }
  return spare;
}

/// How many still need an output of a task that is done: the tasks that take it as input, and with
/// state.keep "all" the job's result. Completing a dependent makes it one less (release_inputs).
std::int32_t JobTasks::num_needs(TaskIndex task, const BlobRef& output) const {
  if (output.kind == BlobKind::image) return 0;
  std::int32_t uses = 0;
  const TaskKey maker = graph_.key(task);
  for (const TaskIndex dependent : graph_.dependents(maker)) {
    if (!graph_.takes(graph_.key(dependent), maker, output)) continue;
    const bool needs = status(dependent) != TaskStatus::done && !cuts_.contains(dependent);
    uses += needs ? 1 : 0;
  }
  const bool kept = keep_all_states_ && output.kind == BlobKind::state;
  return uses + (kept ? 1 : 0);
}

/// Whether it stays for what may be lost or come after the job. Between checkpoints only what
/// workers have read of others stays: the rest of what a lost worker has made is lost with it.
bool JobTasks::stays(TaskIndex task, const BlobRef& output) const {
  if (output.kind == BlobKind::film) {
    const bool is_last_sweep = output.step() >= graph_.timeline().last_step_of(FrameIndex(0));
    return keep_films_ && is_last_sweep && !record(task).films_let_go;
  }
  if (output.kind != BlobKind::state || output.is_held()) return false;
  const TaskKey key = graph_.key(task);
  return checkpoints_.keeps(key) || (record(task).is_shared && checkpoints_.keeps_between(key));
}

/// The number of needs, and one more for what stays.
std::int32_t JobTasks::num_uses(TaskIndex task, const BlobRef& output) const {
  return num_needs(task, output) + (stays(task, output) ? 1 : 0);
}

/// made: whether it is there now, or there no longer. (Unsigned sums wrap to what they were.)
void JobTasks::count_output(const BlobRef& output, bool made) {
  const std::uint64_t sign = made ? 1 : ~std::uint64_t{0};
  if (output.kind == BlobKind::image) progress_.frames_done += made ? 1u : ~0u;
  if (output.kind == BlobKind::state) {
    progress_.state_bytes += sign * output.size_bytes;
    if (!output.is_held()) progress_.state_pixels += sign * graph_.num_pixels(output.tile);
  }
  if (output.is_held()) num_held_ += made ? 1u : ~std::size_t{0};
}

/// Counts everybody's need of what a done task made. Images are files of the output folder, not
/// blobs of the store.
void JobTasks::add_outputs(TaskIndex task, BlobReferences& blobs) const {
  for (const BlobRef& output : outputs(task)) {
    const std::int32_t uses = num_uses(task, output);
    for (std::int32_t use = 0; use < uses; ++use) blobs.add(output);
    if (uses == 0 && output.kind != BlobKind::image) blobs.discard(output.digest);
  }
}

void JobTasks::release_outputs(TaskIndex task, BlobReferences& blobs) const {
  for (const BlobRef& output : outputs(task)) {
    for (std::int32_t use = num_uses(task, output); use > 0; --use) blobs.release(output.digest);
  }
}

/// States that have stayed need not stay any more.
void JobTasks::let_go(const std::vector<TaskKey>& renders, BlobReferences& blobs) {
  for (const TaskKey& key : renders) {
    const TaskIndex task = *graph_.find(key);
    for (const BlobRef& output : outputs(task)) {
      const bool stayed = output.kind == BlobKind::state && !output.is_held() &&
                          (checkpoints_.is_checkpoint(key) || record(task).is_shared);
      if (stayed) blobs.release(output.digest);
    }
  }
}

void JobTasks::let_between_go(BlobReferences& blobs) {
  let_go(checkpoints_.let_between_go(), blobs);
}

/// Of inputs that were opened again meanwhile nothing is left to release.
void JobTasks::release_inputs(TaskIndex task, BlobReferences& blobs) const {
  const TaskKey key = graph_.key(task);
  for (const TaskIndex input : graph_.inputs(key)) {
    if (status(input) != TaskStatus::done) continue;
    for (const std::size_t position : graph_.taken_outputs(key, graph_.key(input))) {
      if (position < outputs(input).size()) blobs.release(outputs(input)[position].digest);
    }
  }
}

// ---- cuts ---------------------------------------------------------------------------------------

/// Whether an open task takes films of it.
bool JobTasks::needs_films(TaskIndex task) const {
  const std::vector<TaskIndex> dependents = graph_.dependents(graph_.key(task));
  return std::any_of(dependents.begin(), dependents.end(), [&](TaskIndex dependent) {
    return graph_.key(dependent).kind != TaskKind::render && is_open(status(dependent));
  });
}

/// An open task needs what it is cut from.
void JobTasks::use_cut(TaskIndex task, BlobReferences& blobs) const {
  for (const BlobRef& state : cuts_.at(task)) blobs.add(state);
}

/// Of an open task; false: it is no cut.
bool JobTasks::drop_cut(TaskIndex task, BlobReferences& blobs) {
  const auto cut = cuts_.find(task);
  if (cut == cuts_.end()) return false;
  for (const BlobRef& state : cut->second) blobs.release(state.digest);
  cuts_.erase(cut);
  return true;
}

}  // namespace baton
