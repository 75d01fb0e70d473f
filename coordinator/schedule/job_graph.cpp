#include "coordinator/schedule/job_graph.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/base/limits.h"
#include "common/job/motion.h"

namespace baton {
namespace {

std::string_view name_of(BlobKind kind) {
  switch (kind) {
    case BlobKind::state:
      return "state";
    case BlobKind::film:
      return "film";
    case BlobKind::image:
      return "image";
  }
  return "blob";
}

}  // namespace

std::int64_t count_tasks(const JobSpec& job) {
  return static_cast<std::int64_t>(job.frames.size()) +
         static_cast<std::int64_t>(num_runs(job)) * TileGrid(job.image).count();
}

JobGraph::JobGraph(const JobSpec& job)
    : grid_(job.image),
      num_frames_(static_cast<std::int32_t>(job.frames.size())),
      num_runs_(baton::num_runs(job)),
      num_tiles_(grid_.count()),
      frames_per_run_(baton::frames_per_run(job)),
      reach_px_(history_reach_px(job)),
      carries_state_(baton::carries_state(job)) {
  BATON_CHECK(count_tasks(job) <= limits::kMaxTasksPerJob);
}

std::optional<TaskIndex> JobGraph::find(const TaskKey& key) const {
  const std::int32_t num_steps = key.kind == TaskKind::assemble ? num_frames_ : num_runs_;
  const std::int32_t tiles_of_step = key.kind == TaskKind::assemble ? 1 : num_tiles_;
  if (key.step < 0 || key.step >= num_steps || key.tile < 0 || key.tile >= tiles_of_step)
    return std::nullopt;
  return key.kind == TaskKind::assemble ? key.step : render_index(key.step, key.tile);
}

TaskKey JobGraph::key(TaskIndex index) const {
  BATON_CHECK(index >= 0 && index < num_tasks());
  if (index < num_frames_) return {TaskKind::assemble, index, 0};
  const std::int32_t render = index - num_frames_;
  return {TaskKind::render, render / num_tiles_, render % num_tiles_};
}

std::int32_t JobGraph::num_inputs(const TaskKey& key) const {
  if (key.kind == TaskKind::assemble) return num_tiles_;
  if (!carries_state_ || key.step == 0) return 0;
  return static_cast<std::int32_t>(grid_.tiles_near(key.tile, reach_px_).size());
}

std::vector<TaskIndex> JobGraph::dependents(const TaskKey& key) const {
  std::vector<TaskIndex> result;
  if (key.kind == TaskKind::assemble) return result;
  for (std::int32_t frame = first_frame(key.step); frame <= last_frame(key.step); ++frame)
    result.push_back(frame);
  if (carries_state_ && key.step + 1 < num_runs_) add_neighbours(key.step + 1, key.tile, result);
  return result;
}

std::vector<TaskIndex> JobGraph::inputs(const TaskKey& key) const {
  std::vector<TaskIndex> result;
  if (key.kind == TaskKind::assemble) {
    const std::int32_t run = key.step / frames_per_run_;
    for (std::int32_t tile = 0; tile < num_tiles_; ++tile)
      result.push_back(render_index(run, tile));
  } else if (carries_state_ && key.step > 0) {
    add_neighbours(key.step - 1, key.tile, result);
  }
  return result;
}

std::int32_t JobGraph::last_frame(std::int32_t run) const {
  return std::min(first_frame(run) + frames_per_run_, num_frames_) - 1;
}

std::uint64_t JobGraph::num_pixels(std::int32_t tile) const {
  return static_cast<std::uint64_t>(grid_.rect(tile).area());
}

std::optional<std::string> JobGraph::check_outputs(const TaskKey& key,
                                                   std::vector<BlobRef>& outputs) const {
  // What the task must make, in sorted order.
  std::vector<BlobRef> expected;
  if (key.kind == TaskKind::assemble) {
    expected.push_back({.kind = BlobKind::image, .frame = key.step, .tile = 0, .digest = {}});
  } else {
    const std::int32_t last = last_frame(key.step);
    if (carries_state_)
      expected.push_back({.kind = BlobKind::state, .frame = last, .tile = key.tile, .digest = {}});
    for (std::int32_t frame = first_frame(key.step); frame <= last; ++frame) {
      expected.push_back({.kind = BlobKind::film, .frame = frame, .tile = key.tile, .digest = {}});
    }
  }

  // Compare kind, frame and tile one by one.
  std::sort(outputs.begin(), outputs.end());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const BlobRef& e = expected[i];
    if (i >= outputs.size() || outputs[i].kind != e.kind || outputs[i].frame != e.frame ||
        outputs[i].tile != e.tile) {
      return fmt::format("the report lacks the {} of frame index {}, tile {}", name_of(e.kind),
                         e.frame, e.tile);
    }
  }
  if (outputs.size() > expected.size()) {
    return fmt::format("the report has {} outputs, expected {}", outputs.size(), expected.size());
  }
  return std::nullopt;
}

std::optional<std::string> JobGraph::check_frames(const TaskKey& key,
                                                  const std::vector<FrameStats>& frames) const {
  std::int32_t next = key.kind == TaskKind::render ? first_frame(key.step) : num_frames_;
  for (const FrameStats& stats : frames) {
    if (stats.tile != key.tile || stats.frame < next || stats.frame > last_frame(key.step)) {
      return fmt::format("the report has statistics of frame index {}, tile {}, out of place",
                         stats.frame, stats.tile);
    }
    next = stats.frame + 1;
  }
  return std::nullopt;
}

std::size_t JobGraph::film_position(std::int32_t frame) const {
  return static_cast<std::size_t>(frame % frames_per_run_) + (carries_state_ ? 1 : 0);
}

void JobGraph::add_neighbours(std::int32_t run, std::int32_t tile,
                              std::vector<TaskIndex>& tasks) const {
  for (const std::int32_t near : grid_.tiles_near(tile, reach_px_))
    tasks.push_back(render_index(run, near));
}

TaskIndex JobGraph::render_index(std::int32_t run, std::int32_t tile) const {
  return num_frames_ + run * num_tiles_ + tile;
}

}  // namespace baton
