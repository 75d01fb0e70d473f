#include "coordinator/schedule/job_graph.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/job/motion.h"

namespace baton {

std::int64_t count_tasks(const JobSpec& job) {
  const auto frames = static_cast<std::int64_t>(job.frames.size());
  const std::int64_t tiles = TileGrid(job.image).count();
  return frames + (job.visibility.correlated ? frames * tiles : 0) +
         static_cast<std::int64_t>(num_runs(job)) * tiles;
}

JobGraph::JobGraph(const JobSpec& job)
    : grid_(job.image),
      timeline_(job),
      num_tiles_(grid_.count()),
      runs_per_checkpoint_(baton::runs_per_checkpoint(job)),
      reach_px_(history_reach_px(job)),
      carries_state_(baton::carries_state(job)),
      shares_history_(baton::shares_history(job)),
      has_second_pass_(job.visibility.correlated),
      exchange_reach_px_(baton::exchange_reach_px(job.visibility)) {
  BATON_CHECK(count_tasks(job) <= limits::kMaxTasksPerJob);
  first_render_ = num_frames() + (has_second_pass_ ? num_frames() * num_tiles_ : 0);
}

std::optional<TaskIndex> JobGraph::find(const TaskKey& key) const {
  const bool known = key.kind != TaskKind::second_pass || has_second_pass_;
  const std::int32_t positions = key.kind == TaskKind::render ? num_runs() : num_frames();
  const std::int32_t tiles = key.kind == TaskKind::assemble ? 1 : num_tiles_;
  if (!known || key.position < 0 || key.position >= positions || key.tile < 0 || key.tile >= tiles)
    return std::nullopt;
  switch (key.kind) {
    case TaskKind::assemble:
      return key.frame().value();
    case TaskKind::second_pass:
      return second_pass_index(key.step(), key.tile);
    case TaskKind::render:
      return render_index(key.run(), key.tile);
  }
  return std::nullopt;
}

TaskKey JobGraph::key(TaskIndex index) const {
  BATON_CHECK(index >= 0 && index < num_tasks());
  if (index < num_frames()) return assemble_task(FrameIndex(index));
  const bool is_render = index >= first_render_;
  const std::int32_t place = index - (is_render ? first_render_ : num_frames());
  const std::int32_t position = place / num_tiles_, tile = place % num_tiles_;
  return is_render ? render_task(Run(position), tile) : second_pass_task(Step(position), tile);
}

std::int32_t JobGraph::num_inputs(const TaskKey& key) const {
  if (key.kind == TaskKind::assemble) return num_tiles_;
  if (key.kind == TaskKind::second_pass)
    return static_cast<std::int32_t>(grid_.tiles_near(key.tile, exchange_reach_px_).size());
  if (timeline_.sweep_of(steps(key).first) > Sweep(0))
    return static_cast<std::int32_t>(inputs(key).size());
  if (!carries_state_ || key.run() == Run(0)) return 0;
  return static_cast<std::int32_t>(grid_.tiles_near(key.tile, reach_px_).size());
}

std::vector<TaskIndex> JobGraph::dependents(const TaskKey& key) const {
  std::vector<TaskIndex> result;
  if (key.kind == TaskKind::assemble) return result;
  if (key.kind == TaskKind::second_pass) return {timeline_.frame_of(key.step()).value()};
  const StepSpan rendered = steps(key);
  const bool is_last_sweep = rendered.first >= timeline_.last_step_of(FrameIndex(0));
  for (Step step = rendered.first; is_last_sweep && step <= rendered.last; ++step) {
    if (!has_second_pass_) {
      result.push_back(timeline_.frame_of(step).value());
      continue;
    }
    for (const std::int32_t near : grid_.tiles_near(key.tile, exchange_reach_px_))
      result.push_back(second_pass_index(step, near));
  }
  if (const Run next = key.run() + 1; carries_state_ && next.value() < num_runs())
    add_neighbours(next, key.tile, result);
  if (!is_last_sweep)
    add_renders_of({rendered.first + num_frames(), rendered.last + num_frames()}, key.tile, result);
  return result;
}

std::vector<TaskIndex> JobGraph::inputs(const TaskKey& key) const {
  std::vector<TaskIndex> result;
  if (key.kind == TaskKind::assemble) {
    const Step step = timeline_.last_step_of(key.frame());
    for (std::int32_t tile = 0; tile < num_tiles_; ++tile)
      result.push_back(has_second_pass_ ? second_pass_index(step, tile)
                                        : render_index(timeline_.run_of(step), tile));
  } else if (key.kind == TaskKind::second_pass) {
    for (const std::int32_t near : grid_.tiles_near(key.tile, exchange_reach_px_))
      result.push_back(render_index(timeline_.run_of(key.step()), near));
  } else {
    if (carries_state_ && key.run() > Run(0)) add_neighbours(key.run() - 1, key.tile, result);
    if (const StepSpan rendered = steps(key); timeline_.sweep_of(rendered.first) > Sweep(0)) {
      const std::int32_t sweep = num_frames();
      add_renders_of({rendered.first - sweep, rendered.last - sweep}, key.tile, result);
    }
  }
  return result;
}

StepSpan JobGraph::steps(const TaskKey& key) const {
  return key.kind == TaskKind::render ? timeline_.steps_of(key.run())
                                      : StepSpan{key.step(), key.step()};
}

std::uint64_t JobGraph::num_pixels(std::int32_t tile) const {
  return static_cast<std::uint64_t>(grid_.rect(tile).area());
}

std::vector<BlobRef> JobGraph::expected_outputs(const TaskKey& key) const {
  const auto blob = [&](BlobKind kind, std::int32_t position) {
    return BlobRef{.kind = kind, .position = position, .tile = key.tile, .digest = {}};
  };
  if (key.kind == TaskKind::assemble) return {blob(BlobKind::image, key.position)};
  if (key.kind == TaskKind::second_pass) return {blob(BlobKind::film, key.position)};
  std::vector<BlobRef> expected;
  const auto [first, last] = steps(key);
  if (carries_state_) expected.push_back(blob(BlobKind::state, last.value()));
  for (Step step = first; step <= last; ++step)
    expected.push_back(blob(BlobKind::film, step.value()));
  for (Step step = first; has_second_pass_ && step <= last; ++step)
    expected.push_back(blob(BlobKind::first_pass, step.value()));
  return expected;
}

std::optional<std::string> JobGraph::check_outputs(const TaskKey& key,
                                                   std::vector<BlobRef>& outputs,
                                                   Extent extent) const {
  std::vector<BlobRef> expected = expected_outputs(key);
  if (extent == Extent::state && key.kind == TaskKind::render && carries_state_) expected.resize(1);

  // Compare kind, position and tile one by one.
  std::sort(outputs.begin(), outputs.end());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const BlobRef& e = expected[i];
    if (i >= outputs.size() || outputs[i].kind != e.kind || outputs[i].position != e.position ||
        outputs[i].tile != e.tile) {
      return fmt::format("the report lacks the {} of frame index {}, tile {}",
                         blob_kind_name(e.kind), e.position, e.tile);
    }
  }
  if (outputs.size() > expected.size()) {
    return fmt::format("the report has {} outputs, expected {}", outputs.size(), expected.size());
  }
  return std::nullopt;
}

std::optional<std::string> JobGraph::check_frames(const TaskKey& key,
                                                  const std::vector<FrameStats>& frames) const {
  // By step, or by frame; none of a second pass.
  std::int32_t next = 0, last = -1;
  if (key.kind == TaskKind::assemble) next = last = key.frame().value();
  if (key.kind == TaskKind::render) {
    next = steps(key).first.value();
    last = steps(key).last.value();
  }
  for (const FrameStats& stats : frames) {
    if (stats.tile != key.tile || stats.position < next || stats.position > last) {
      return fmt::format("the report has statistics of {} index {}, tile {}, out of place",
                         key.kind == TaskKind::assemble ? "frame" : "step", stats.position,
                         stats.tile);
    }
    next = stats.position + 1;
  }
  return std::nullopt;
}

std::int32_t JobGraph::num_outputs(const TaskKey& key, BlobKind kind) const {
  if (key.kind == TaskKind::assemble) return 0;
  if (key.kind == TaskKind::second_pass) return kind == BlobKind::film ? 1 : 0;
  const std::int32_t count = steps(key).size();
  switch (kind) {
    case BlobKind::state:
      return carries_state_ ? 1 : 0;
    case BlobKind::film:
      return count;
    case BlobKind::first_pass:
      return has_second_pass_ ? count : 0;
    case BlobKind::image:
      return 0;
  }
  return 0;
}

bool JobGraph::takes(const TaskKey& reader, const TaskKey& maker, const BlobRef& output) const {
  switch (reader.kind) {
    case TaskKind::render: {
      if (output.kind == BlobKind::state) return maker.run() + 1 == reader.run();
      return output.kind == BlobKind::film && maker.tile == reader.tile &&
             steps(reader).contains(output.step() + num_frames());
    }
    case TaskKind::assemble:
      return output.kind == BlobKind::film &&
             output.step() == timeline_.last_step_of(reader.frame());
    case TaskKind::second_pass:
      if (output.step() != reader.step()) return false;
      return output.kind == BlobKind::first_pass ||
             (output.kind == BlobKind::film && maker.tile == reader.tile);
  }
  return false;
}

std::vector<std::size_t> JobGraph::taken_outputs(const TaskKey& reader,
                                                 const TaskKey& maker) const {
  std::vector<std::size_t> taken;
  const std::vector<BlobRef> outputs = expected_outputs(maker);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (takes(reader, maker, outputs[i])) taken.push_back(i);
  }
  return taken;
}

void JobGraph::add_neighbours(Run run, std::int32_t tile, std::vector<TaskIndex>& tasks) const {
  for (const std::int32_t near : grid_.tiles_near(tile, reach_px_))
    tasks.push_back(render_index(run, near));
}

/// The tasks that render these steps of a tile, but for those that are there.
void JobGraph::add_renders_of(const StepSpan& steps, std::int32_t tile,
                              std::vector<TaskIndex>& tasks) const {
  for (Run run = timeline_.run_of(steps.first); run <= timeline_.run_of(steps.last); ++run) {
    const TaskIndex task = render_index(run, tile);
    if (std::find(tasks.begin(), tasks.end(), task) == tasks.end()) tasks.push_back(task);
  }
}

TaskIndex JobGraph::render_index(Run run, std::int32_t tile) const {
  return first_render_ + run.value() * num_tiles_ + tile;
}

TaskIndex JobGraph::second_pass_index(Step step, std::int32_t tile) const {
  return num_frames() + step.value() * num_tiles_ + tile;
}

}  // namespace baton
