#include "coordinator/service/plan_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/job/aov.h"
#include "common/job/frame_range.h"
#include "common/job/sequence.h"

namespace baton {
namespace {

std::string frames_text(const JobSpec& job, const std::vector<std::int32_t>& indices) {
  std::vector<int> numbers;
  for (const std::int32_t i : indices) numbers.push_back(job.frames[static_cast<std::size_t>(i)]);
  return fmt::format("{} {}", numbers.size() == 1 ? "frame" : "frames", format_frames(numbers));
}

const char* are(const std::vector<std::int32_t>& indices) {
  return indices.size() == 1 ? "is" : "are";
}

/// What the render tasks that are open have before them.
struct OpenRuns {
  std::set<std::int32_t> runs;
  bool cuts = false;  ///< states are cut into other tiles first
};

OpenRuns find_open_runs(const JobTasks& tasks) {
  const JobGraph& graph = tasks.graph();
  OpenRuns open;
  for (TaskIndex task = graph.num_tasks() - 1; task >= 0; --task) {
    const TaskKey key = graph.key(task);
    if (key.kind != TaskKind::render) break;
    if (!is_open(tasks.status(task))) continue;
    if (tasks.is_cut(task)) {
      open.cuts = true;
    } else {
      open.runs.insert(key.step);
    }
  }
  return open;
}

}  // namespace

std::string plan_text(const Scheduler::Job& job, const std::vector<std::string>& reasons) {
  const JobGraph& graph = job.tasks.graph();
  const JobSpec& spec = job.spec;
  std::vector<std::int32_t> kept, left, again;
  for (std::int32_t frame = 0; frame < graph.num_frames(); ++frame)
    (job.tasks.status(frame) == TaskStatus::done ? kept : left).push_back(frame);
  const OpenRuns open = find_open_runs(job.tasks);
  const bool some_work = kept.size() + left.size() > 0 && job.tasks.progress().tasks_done > 0;
  if (kept.empty() && reasons.empty() && !some_work) return {};
  for (const std::int32_t run : open.runs) {
    for (std::int32_t step = graph.first_frame(run); step <= graph.last_frame(run); ++step) {
      const std::int32_t frame = frame_of_step(spec, step);
      const bool is_written = job.tasks.status(frame) == TaskStatus::done;
      if (is_written && std::find(again.begin(), again.end(), frame) == again.end())
        again.push_back(frame);
    }
  }

  std::string text;
  if (!kept.empty()) text += fmt::format("{} {} kept\n", frames_text(spec, kept), are(kept));
  if (!left.empty()) {
    text += fmt::format("{} {} {}", frames_text(spec, left), are(left),
                        open.runs.empty() ? "put together from what is rendered" : "rendered");
    const std::int32_t first = open.runs.empty() ? 0 : graph.first_frame(*open.runs.begin());
    if (const std::int32_t sweep = first / graph.num_frames(); sweep > 0)
      text += fmt::format(" from sweep {} of {} on", sweep + 1, spec.quality.sweeps);
    if (graph.carries_state() && first > 0) {
      text += fmt::format(", going on from the states of {}",
                          frames_text(spec, {frame_of_step(spec, first - 1)}));
      if (open.cuts) text += fmt::format(", cut into tiles of {} pixels", spec.image.tile_size);
    } else if (graph.carries_state() && !open.runs.empty() && !kept.empty()) {
      text += ", from the first frame on";
    }
    text += "\n";
  }
  if (!again.empty()) {
    text += fmt::format("{} {} rendered once more for what others need of them, and not written\n",
                        frames_text(spec, again), are(again));
  }
  for (const std::string& reason : reasons) text += reason + "\n";
  return text;
}

std::vector<std::string> output_reasons(const JobSpec& former, const JobSpec& wanted,
                                        bool other_plates) {
  const OutputSpec &a = former.output, &b = wanted.output;
  std::vector<std::string> differing;
  const auto compare = [&](bool equal, const char* key) {
    if (!equal) differing.emplace_back(key);
  };
  compare(a.aovs == b.aovs, "output.aovs");
  compare(mattes_alike(former, wanted), "the name of an object");
  compare(a.background == b.background, "output.background");
  compare(!other_plates, "output.plate");
  compare(a.shadows == b.shadows, "output.shadows");
  compare(a.pattern == b.pattern, "output.pattern");
  compare(a.pixel_type == b.pixel_type, "output.pixelType");
  compare(a.compression == b.compression, "output.compression");
  compare(a.naming == b.naming, "output.naming");
  compare(a.clamp_negative == b.clamp_negative, "output.clampNegative");
  std::vector<std::string> reasons;
  if (!differing.empty()) {
    reasons.push_back(fmt::format("frames are written anew: {} {} changed",
                                  fmt::join(differing, ", "),
                                  differing.size() == 1 ? "has" : "have"));
  } else if (former.name != wanted.name || former.metadata != wanted.metadata ||
             a.frames_per_second != b.frames_per_second) {
    reasons.emplace_back(
        "frames that are kept keep their headers: name, metadata or frames per second of before");
  }
  return reasons;
}

}  // namespace baton
