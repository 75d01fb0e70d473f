#include "coordinator/service/plan_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/job/aov.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"

namespace baton {
namespace {

/// What the render tasks that are open have before them.
struct OpenRuns {
  std::set<Run> runs;
  bool cuts = false;  ///< states are cut into other tiles first
};

OpenRuns find_open_runs(const JobTasks& tasks) {
  const JobGraph& graph = tasks.graph();
  OpenRuns open;
  for (TaskIndex task = graph.num_tasks() - 1; task >= 0; --task) {
    const TaskKey key = graph.key(task);
    if (key.kind != TaskKind::render) break;
    if (!is_open(tasks.book().status(task))) continue;
    if (tasks.ledger().is_cut(task)) {
      open.cuts = true;
    } else {
      open.runs.insert(key.run());
    }
  }
  return open;
}

}  // namespace

std::string frames_text(const JobSpec& job, const std::set<FrameIndex>& frames) {
  std::vector<FrameNumber> numbers;
  for (const FrameIndex frame : frames) numbers.push_back(job.frames[frame.index()]);
  std::ranges::sort(numbers);
  return fmt::format("{} {}", numbers.size() == 1 ? "frame" : "frames", format_frames(numbers));
}

std::string plan_text(const Scheduler::Job& job, const std::vector<std::string>& reasons) {
  const JobGraph& graph = job.tasks.graph();
  const JobSpec& spec = job.spec;
  const Timeline& timeline = graph.timeline();
  const auto is_written = [&](FrameIndex frame) {
    return job.tasks.book().status(*graph.find(assemble_task(frame))) == TaskStatus::done;
  };
  std::set<FrameIndex> kept, left, again;
  for (FrameIndex frame{0}; frame < FrameIndex(graph.num_frames()); ++frame)
    (is_written(frame) ? kept : left).insert(frame);
  const OpenRuns open = find_open_runs(job.tasks);
  const bool some_work = kept.size() + left.size() > 0 && job.tasks.book().counts().done > 0;
  if (kept.empty() && reasons.empty() && !some_work) return {};
  for (const Run run : open.runs) {
    const StepSpan steps = timeline.steps_of(run);
    for (Step step = steps.first; step <= steps.last; ++step) {
      const FrameIndex frame = timeline.frame_of(step);
      if (is_written(frame)) again.insert(frame);
    }
  }

  std::string text;
  if (!kept.empty()) text += fmt::format("{} {} kept\n", frames_text(spec, kept), are(kept));
  if (!left.empty()) {
    text += fmt::format("{} {} {}", frames_text(spec, left), are(left),
                        open.runs.empty() ? "put together from what is rendered" : "rendered");
    const Step first = open.runs.empty() ? Step(0) : timeline.steps_of(*open.runs.begin()).first;
    if (const Sweep sweep = timeline.sweep_of(first); sweep > Sweep(0))
      text += fmt::format(" from sweep {} of {} on", sweep + 1, spec.quality.sweeps);
    if (graph.carries_state() && first > Step(0)) {
      text += fmt::format(", going on from the states of {}",
                          frames_text(spec, {timeline.frame_of(first - 1)}));
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
