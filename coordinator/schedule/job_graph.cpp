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
      starts_(run_starts(job)),
      num_frames_(static_cast<std::int32_t>(job.frames.size())),
      num_steps_(baton::num_steps(job)),
      num_runs_(static_cast<std::int32_t>(starts_.size())),
      num_tiles_(grid_.count()),
      runs_per_checkpoint_(baton::runs_per_checkpoint(job)),
      reach_px_(history_reach_px(job)),
      carries_state_(baton::carries_state(job)),
      shares_history_(baton::shares_history(job)),
      has_second_pass_(job.visibility.correlated),
      exchange_reach_px_(baton::exchange_reach_px(job.visibility)) {
  BATON_CHECK(count_tasks(job) <= limits::kMaxTasksPerJob);
  first_render_ = num_frames_ + (has_second_pass_ ? num_frames_ * num_tiles_ : 0);
}

std::optional<TaskIndex> JobGraph::find(const TaskKey& key) const {
  const bool known = key.kind != TaskKind::second_pass || has_second_pass_;
  const std::int32_t num_steps = key.kind == TaskKind::render ? num_runs_ : num_frames_;
  const std::int32_t tiles_of_step = key.kind == TaskKind::assemble ? 1 : num_tiles_;
  if (!known || key.step < 0 || key.step >= num_steps || key.tile < 0 || key.tile >= tiles_of_step)
    return std::nullopt;
  switch (key.kind) {
    case TaskKind::assemble:
      return key.step;
    case TaskKind::second_pass:
      return second_pass_index(key.step, key.tile);
    case TaskKind::render:
      return render_index(key.step, key.tile);
  }
  return std::nullopt;
}

TaskKey JobGraph::key(TaskIndex index) const {
  BATON_CHECK(index >= 0 && index < num_tasks());
  if (index < num_frames_) return {TaskKind::assemble, index, 0};
  const bool second = index < first_render_;
  const std::int32_t place = index - (second ? num_frames_ : first_render_);
  return {second ? TaskKind::second_pass : TaskKind::render, place / num_tiles_,
          place % num_tiles_};
}

std::int32_t JobGraph::num_inputs(const TaskKey& key) const {
  if (key.kind == TaskKind::assemble) return num_tiles_;
  if (key.kind == TaskKind::second_pass)
    return static_cast<std::int32_t>(grid_.tiles_near(key.tile, exchange_reach_px_).size());
  if (first_frame(key.step) >= num_frames_) return static_cast<std::int32_t>(inputs(key).size());
  if (!carries_state_ || key.step == 0) return 0;
  return static_cast<std::int32_t>(grid_.tiles_near(key.tile, reach_px_).size());
}

std::vector<TaskIndex> JobGraph::dependents(const TaskKey& key) const {
  std::vector<TaskIndex> result;
  if (key.kind == TaskKind::assemble) return result;
  if (key.kind == TaskKind::second_pass) return {key.step};
  const FrameSpan steps = frames(key);
  const bool is_last_sweep = steps.first >= last_step_of(0);
  for (std::int32_t step = steps.first; is_last_sweep && step <= steps.last; ++step) {
    const std::int32_t frame = step - last_step_of(0);
    if (!has_second_pass_) {
      result.push_back(frame);
      continue;
    }
    for (const std::int32_t near : grid_.tiles_near(key.tile, exchange_reach_px_))
      result.push_back(second_pass_index(frame, near));
  }
  if (carries_state_ && key.step + 1 < num_runs_) add_neighbours(key.step + 1, key.tile, result);
  if (!is_last_sweep)
    add_same_frames({steps.first + num_frames_, steps.last + num_frames_}, key.tile, result);
  return result;
}

std::vector<TaskIndex> JobGraph::inputs(const TaskKey& key) const {
  std::vector<TaskIndex> result;
  if (key.kind == TaskKind::assemble) {
    const std::int32_t run = run_of(last_step_of(key.step));
    for (std::int32_t tile = 0; tile < num_tiles_; ++tile)
      result.push_back(has_second_pass_ ? second_pass_index(key.step, tile)
                                        : render_index(run, tile));
  } else if (key.kind == TaskKind::second_pass) {
    for (const std::int32_t near : grid_.tiles_near(key.tile, exchange_reach_px_))
      result.push_back(render_index(run_of(key.step), near));
  } else {
    if (carries_state_ && key.step > 0) add_neighbours(key.step - 1, key.tile, result);
    if (const FrameSpan steps = frames(key); steps.first >= num_frames_)
      add_same_frames({steps.first - num_frames_, steps.last - num_frames_}, key.tile, result);
  }
  return result;
}

std::int32_t JobGraph::last_frame(std::int32_t run) const {
  return (run + 1 < num_runs_ ? first_frame(run + 1) : num_steps_) - 1;
}

std::int32_t JobGraph::run_of(std::int32_t step) const {
  return static_cast<std::int32_t>(std::upper_bound(starts_.begin(), starts_.end(), step) -
                                   starts_.begin()) -
         1;
}

FrameSpan JobGraph::frames(const TaskKey& key) const {
  if (key.kind != TaskKind::render) return {key.step, key.step};
  return {first_frame(key.step), last_frame(key.step)};
}

std::uint64_t JobGraph::num_pixels(std::int32_t tile) const {
  return static_cast<std::uint64_t>(grid_.rect(tile).area());
}

std::vector<BlobRef> JobGraph::expected_outputs(const TaskKey& key) const {
  const auto blob = [&](BlobKind kind, std::int32_t frame) {
    return BlobRef{.kind = kind, .frame = frame, .tile = key.tile, .digest = {}};
  };
  if (key.kind == TaskKind::assemble) return {blob(BlobKind::image, key.step)};
  if (key.kind == TaskKind::second_pass) return {blob(BlobKind::film, key.step)};
  std::vector<BlobRef> expected;
  const std::int32_t last = last_frame(key.step);
  if (carries_state_) expected.push_back(blob(BlobKind::state, last));
  for (std::int32_t frame = first_frame(key.step); frame <= last; ++frame)
    expected.push_back(blob(BlobKind::film, frame));
  for (std::int32_t frame = first_frame(key.step); has_second_pass_ && frame <= last; ++frame)
    expected.push_back(blob(BlobKind::first_pass, frame));
  return expected;
}

std::optional<std::string> JobGraph::check_outputs(const TaskKey& key,
                                                   std::vector<BlobRef>& outputs,
                                                   Extent extent) const {
  std::vector<BlobRef> expected = expected_outputs(key);
  if (extent == Extent::state && key.kind == TaskKind::render && carries_state_) expected.resize(1);

  // Compare kind, frame and tile one by one.
  std::sort(outputs.begin(), outputs.end());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const BlobRef& e = expected[i];
    if (i >= outputs.size() || outputs[i].kind != e.kind || outputs[i].frame != e.frame ||
        outputs[i].tile != e.tile) {
      return fmt::format("the report lacks the {} of frame index {}, tile {}",
                         blob_kind_name(e.kind), e.frame, e.tile);
    }
  }
  if (outputs.size() > expected.size()) {
    return fmt::format("the report has {} outputs, expected {}", outputs.size(), expected.size());
  }
  return std::nullopt;
}

std::optional<std::string> JobGraph::check_frames(const TaskKey& key,
                                                  const std::vector<FrameStats>& frames) const {
  std::int32_t next = num_steps_, last = num_steps_ - 1;  // none
  if (key.kind == TaskKind::render) {
    next = first_frame(key.step);
    last = last_frame(key.step);
  } else if (key.kind == TaskKind::assemble) {
    next = last = key.step;
  }
  for (const FrameStats& stats : frames) {
    if (stats.tile != key.tile || stats.frame < next || stats.frame > last) {
      return fmt::format("the report has statistics of frame index {}, tile {}, out of place",
                         stats.frame, stats.tile);
    }
    next = stats.frame + 1;
  }
  return std::nullopt;
}

std::int32_t JobGraph::num_outputs(const TaskKey& key, BlobKind kind) const {
  if (key.kind == TaskKind::assemble) return 0;
  if (key.kind == TaskKind::second_pass) return kind == BlobKind::film ? 1 : 0;
  const std::int32_t frames = last_frame(key.step) - first_frame(key.step) + 1;
  switch (kind) {
    case BlobKind::state:
      return carries_state_ ? 1 : 0;
    case BlobKind::film:
      return frames;
    case BlobKind::first_pass:
      return has_second_pass_ ? frames : 0;
    case BlobKind::image:
      return 0;
  }
  return 0;
}

bool JobGraph::takes(const TaskKey& reader, const TaskKey& maker, const BlobRef& output) const {
  switch (reader.kind) {
    case TaskKind::render: {
      if (output.kind == BlobKind::state) return maker.step + 1 == reader.step;
      const std::int32_t step = output.frame + num_frames_;
      const FrameSpan steps = frames(reader);
      return output.kind == BlobKind::film && maker.tile == reader.tile && step >= steps.first &&
             step <= steps.last;
    }
    case TaskKind::assemble:
      return output.kind == BlobKind::film && output.frame == last_step_of(reader.step);
    case TaskKind::second_pass:
      if (output.frame != reader.step) return false;
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

void JobGraph::add_neighbours(std::int32_t run, std::int32_t tile,
                              std::vector<TaskIndex>& tasks) const {
  for (const std::int32_t near : grid_.tiles_near(tile, reach_px_))
    tasks.push_back(render_index(run, near));
}

/// The tasks that render these steps of a tile, but for those that are there.
void JobGraph::add_same_frames(const FrameSpan& steps, std::int32_t tile,
                               std::vector<TaskIndex>& tasks) const {
  for (std::int32_t run = run_of(steps.first); run <= run_of(steps.last); ++run) {
    const TaskIndex task = render_index(run, tile);
    if (std::find(tasks.begin(), tasks.end(), task) == tasks.end()) tasks.push_back(task);
  }
}

TaskIndex JobGraph::render_index(std::int32_t run, std::int32_t tile) const {
  return first_render_ + run * num_tiles_ + tile;
}

TaskIndex JobGraph::second_pass_index(std::int32_t frame, std::int32_t tile) const {
  return num_frames_ + frame * num_tiles_ + tile;
}

}  // namespace baton
