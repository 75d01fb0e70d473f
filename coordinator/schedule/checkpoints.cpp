#include "coordinator/schedule/checkpoints.h"

#include <algorithm>
#include <utility>

namespace baton {

Checkpoints::Checkpoints(const JobGraph& graph)
    : runs_per_stage_(graph.runs_per_checkpoint()),
      num_runs_(graph.num_runs()),
      num_tiles_(graph.num_tiles()),
      tiles_per_stage_(graph.shares_history() ? static_cast<std::size_t>(num_tiles_) : 1),
      stages_per_row_(static_cast<std::size_t>(num_tiles_) / tiles_per_stage_) {
  if (!graph.carries_state()) return;
  const std::int32_t num_rows = (num_runs_ + runs_per_stage_ - 1) / runs_per_stage_;
  stages_.resize(static_cast<std::size_t>(num_rows) * stages_per_row_);
  for (Run run{0}; run < Run(num_runs_); ++run) {
    for (std::int32_t tile = 0; tile < num_tiles_; ++tile)
      ++stages_[stage_of(render_task(run, tile))].open;
  }
}

std::size_t Checkpoints::stage_of(const TaskKey& render) const {
  return static_cast<std::size_t>(render.run().value() / runs_per_stage_) * stages_per_row_ +
         static_cast<std::size_t>(render.tile) / tiles_per_stage_;
}

/// Whether everything in it is done, or there is no such stage.
bool Checkpoints::is_over(std::size_t stage) const {
  return stage >= stages_.size() || stages_[stage].open == 0;
}

bool Checkpoints::keeps(const TaskKey& render) const {
  if (stages_.empty()) return false;
  const std::size_t stage = stage_of(render);
  const std::int32_t end = render.run().value() + 1;
  if (end == num_runs_) return !stages_[stage].let_go;
  if (end % runs_per_stage_ != 0) return false;
  return stage + stages_per_row_ < stages_.size() && !stages_[stage].let_go;
}

bool Checkpoints::keeps_between(const TaskKey& render) const {
  return !stages_.empty() && !is_checkpoint(render) && !stages_[stage_of(render)].between_let_go;
}

void Checkpoints::let_between_go(std::size_t stage, std::vector<TaskKey>& gone) {
  if (std::exchange(stages_[stage].between_let_go, true)) return;
  const auto row = static_cast<std::int32_t>(stage / stages_per_row_);
  const auto count = static_cast<std::int32_t>(tiles_per_stage_);
  const std::int32_t first = static_cast<std::int32_t>(stage % stages_per_row_) * count;
  const Run end{std::min((row + 1) * runs_per_stage_, num_runs_)};
  for (Run run{row * runs_per_stage_}; run < end; ++run) {
    for (std::int32_t tile = first; tile < first + count; ++tile) {
      const TaskKey render = render_task(run, tile);
      if (!is_checkpoint(render)) gone.push_back(render);
    }
  }
}

std::vector<TaskKey> Checkpoints::let_between_go() {
  std::vector<TaskKey> gone;
  for (std::size_t stage = 0; stage < stages_.size(); ++stage) let_between_go(stage, gone);
  return gone;
}

std::vector<TaskKey> Checkpoints::complete(const TaskKey& render) {
  std::vector<TaskKey> gone;
  if (stages_.empty() || --stages_[stage_of(render)].open > 0) return gone;
  let_between_go(stage_of(render), gone);

  // The two checkpoints before may go where all is complete.
  for (std::int32_t back = 1; back <= 2; ++back) {
    const std::int32_t row = render.run().value() / runs_per_stage_ - back;
    if (row < 0) break;
    const Run run{(row + 1) * runs_per_stage_ - 1};
    const std::size_t stage = stage_of(render_task(run, render.tile));
    if (stages_[stage].let_go || !is_over(stage + stages_per_row_) ||
        !is_over(stage + 2 * stages_per_row_))
      continue;
    stages_[stage].let_go = true;
    const auto count = static_cast<std::int32_t>(tiles_per_stage_);
    const std::int32_t first = render.tile / count * count;
    for (std::int32_t tile = first; tile < first + count; ++tile)
      gone.push_back(render_task(run, tile));
  }
  return gone;
}

void Checkpoints::reopen(const TaskKey& render) {
  if (!stages_.empty()) ++stages_[stage_of(render)].open;
}

void Checkpoints::let_go(const TaskKey& render) {
  if (stages_.empty()) return;
  Stage& stage = stages_[stage_of(render)];
  (is_checkpoint(render) ? stage.let_go : stage.between_let_go) = true;
}

}  // namespace baton
