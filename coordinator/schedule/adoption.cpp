#include "coordinator/schedule/adoption.h"

#include <algorithm>
#include <compare>
#include <map>
#include <set>

#include "common/base/limits.h"
#include "common/job/aov.h"
#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {
namespace {

bool films_alike(const JobSpec& a, const JobSpec& b) {
  const auto shows_map = [](const JobSpec& job) {
    return job.output.background == Background::environment;
  };
  return a.output.aovs == b.output.aovs && shows_map(a) == shows_map(b) && mattes_alike(a, b);
}

/// Looks for the frames of the wanted job that a former one has written.
class KeptFrames {
 public:
  KeptFrames(const ParsedJobDocument& wanted, const KeptFiles& files)
      : wanted_(wanted), files_(files), frames_(wanted.job.frames.size()) {
    FrameIndex index{0};
    for (const FrameNumber frame : wanted.job.frames) {
      index_[frame] = index;
      ++index;
    }
  }

  /// place: of the former job among all, in their order.
  void collect(const FormerJob& former, std::size_t place, const FrameComparison& comparison) {
    const bool is_alike = writes_alike(former.document.job, wanted_.job);
    for (const Completions::Task& task : former.tasks) {
      if (task.task.kind != TaskKind::assemble || task.outputs.size() != 1) continue;
      const FrameIndex old = task.task.frame();
      const auto found = index_.find(former.document.job.frames.at(old.index()));
      if (found == index_.end()) continue;
      const FrameIndex frame = found->second;
      if (!is_alike) {
        if (files_.has_frame(frame, task.outputs.front())) {
          overwritten_.insert(frame);
          overwrites_ = place;
        }
        continue;
      }
      if (has(frame)) {
        add_stats(former, old, task.outputs.front().digest, *frames_[frame.index()]);
        continue;
      }
      if (!comparison.are_equal(old, frame)) continue;
      if (!comparison.have_one_plate(old, frame)) {
        other_plates_ = true;
        continue;
      }

      // The same pixels: is the file as it was written?
      BlobRef image = task.outputs.front();
      const bool is_there = files_.locked.contains(frame) || files_.has_frame(frame, image);
      image.position = frame.value();
      if (is_there) {
        frames_[frame.index()] = Completion{assemble_task(frame), {{image}}};
        add_stats(former, old, image.digest, *frames_[frame.index()]);
        if (!files_.locked.contains(frame)) kept_of_.insert(place);
      }
      if (!is_there) lost_.insert(frame);

      // Which job wrote it? The headers of another job's frame differ from this one's.
      const std::vector<FrameIndex>& others = former.plan.others_frames;
      const bool is_own = former.document.digest == wanted_.digest &&
                          std::find(others.begin(), others.end(), frame) == others.end();
      if (!is_own) others_.insert(frame);
      if (is_own && is_there) others_.erase(frame);
    }
  }

  /// After all former jobs: what none of them has recorded of a locked frame needs no record.
  void add_locked() {
    for (const FrameIndex frame : files_.locked) {
      if (!has(frame))
        frames_[frame.index()] = Completion{assemble_task(frame), {{BlobRef::any_image(frame)}}};
    }
  }

  bool has(FrameIndex frame) const { return frames_[frame.index()].has_value(); }
  /// Whether the frames of all these steps are kept.
  bool has_all(const Timeline& timeline, const StepSpan& steps) const {
    for (Step step = steps.first; step <= steps.last; ++step) {
      if (!has(timeline.frame_of(step))) return false;
    }
    return true;
  }
  /// The number of frames where all are kept.
  FrameIndex first_open() const {
    const auto open = std::ranges::find_if(frames_, [](const auto& frame) { return !frame; });
    return FrameIndex(static_cast<std::int32_t>(open - frames_.begin()));
  }
  void write_to(Adoption& adoption) const {
    for (const auto& frame : frames_) {
      if (frame) adoption.frames.push_back(*frame);
    }
    adoption.other_plates = other_plates_;
    adoption.plan.others_frames.assign(others_.begin(), others_.end());
    for (const FrameIndex frame : lost_) {
      if (has(frame)) continue;
      adoption.lost.push_back(frame);
      if (overwritten_.contains(frame)) adoption.overwritten.insert(frame);
    }
    adoption.beside = overwrites_;
    if (!overwrites_ && !kept_of_.empty()) adoption.beside = *kept_of_.rbegin();
    adoption.kept_of = kept_of_;
  }

 private:
  /// What a former job has seen of its frame `old`, if that is the one that is kept and nobody has
  /// told yet.
  static void add_stats(const FormerJob& former, FrameIndex old, const Digest& image,
                        Completion& kept) {
    const auto seen = former.frames.find(old);
    if (seen == former.frames.end() || !kept.made.frames.empty()) return;
    if (kept.made.outputs.front().digest != image) return;
    kept.made.frames.push_back(seen->second);
    kept.made.frames.back().position = kept.task.position;
  }

  const ParsedJobDocument& wanted_;
  const KeptFiles& files_;
  std::map<FrameNumber, FrameIndex> index_;
  std::vector<std::optional<Completion>> frames_;
  std::set<FrameIndex> lost_, others_, overwritten_;
  std::optional<std::size_t> overwrites_;  ///< a former job
  std::set<std::size_t> kept_of_;          ///< likewise
  bool other_plates_ = false;
};

/// How far the work of a former job reaches; the more, the better.
struct Reach {
  /// The one after the newest step all of whose states are there.
  Step states{0};
  bool same_tasks = false;  ///< its tasks are those of the wanted job
  /// Then the one after the newest step that a task of it has rendered.
  Step tasks{0};

  auto operator<=>(const Reach&) const = default;
};

/// One former job beside the wanted one.
class Predecessor {
 public:
  Predecessor(const ParsedJobDocument& wanted, const FormerJob& former,
              const FrameComparison& comparison)
      : job_(wanted.job),
        former_(former),
        old_(former.document.job),
        old_graph_(old_),
        common_end_(comparison.num_common_steps(end_of_tasks())) {}

  /// How far its work reaches that the wanted job can use.
  Reach reach(FrameIndex first_open, const KeptFiles& files) {
    const bool same = common_end_ > Step(0) && job_.image.tile_size == old_.image.tile_size &&
                      films_alike(job_, old_);
    // States of another tiling come without the films of their sweep.
    const bool may_cut = job_.quality.sweeps == 1 && old_.quality.sweeps == 1;
    const Step first_sweep = Timeline(job_).step_of(first_open, Sweep(0));
    const Step states = carries_state(job_) && (same || may_cut)
                            ? newest_states(same ? common_end_ : first_sweep, files)
                            : Step(0);
    if (!same && states == Step(0)) return {};
    return {states, same, same ? progress() : Step(0)};
  }

  /// Its runs up to a step, and one that begins there.
  std::vector<Step> runs_up_to(Step end) const {
    std::vector<Step> starts;
    for (const Step start : old_graph_.timeline().run_starts()) {
      if (start < end) starts.push_back(start);
    }
    starts.push_back(end);
    return starts;
  }

  /// Takes its tasks over into a job that has its runs.
  void take_tasks(const JobSpec& job, const KeptFrames& kept, const KeptFiles& files,
                  Adoption& adoption) const {
    const JobGraph graph(job);
    for (const Completions::Task& task : former_.tasks) {
      const TaskKey& key = task.task;
      if (key.kind == TaskKind::assemble || !graph.find(key) || !old_graph_.find(key)) continue;
      if (key.kind == TaskKind::render && !is_same_run(graph, key.run())) continue;
      const StepSpan steps = graph.steps(key);
      if (steps.last >= common_end_) continue;
      // States that the former job did not keep, and the new one would, are not made again.
      const bool all_kept = kept.has_all(graph.timeline(), steps);
      const bool lacks_state = job_.state.keep == StateKeep::all && !task.outputs.empty() &&
                               task.outputs.front().kind == BlobKind::state &&
                               !files.has_blob(task.outputs.front());
      if (!(all_kept && lacks_state)) adoption.tasks.push_back(key);
    }
    // A cut has no film for another sweep.
    for (const Cut& cut : former_.plan.cuts) {
      if (job.quality.sweeps == 1 && graph.find(cut.task) && is_same_run(graph, cut.task.run()))
        adoption.plan.cuts.push_back(cut);
    }
  }

  /// Has the states that reach() found, of the step before `end`, cut into the tiles of the job.
  void cut_states(const JobSpec& job, Step end, Adoption& adoption) const {
    const JobGraph graph(job);
    const TileGrid tiles(job_.image), old_tiles(old_.image);
    const Run run = graph.timeline().run_of(end - 1);
    for (std::int32_t tile = 0; tile < graph.num_tiles(); ++tile) {
      Cut cut{render_task(run, tile), {}};
      const PixelRect rect = tiles.rect(tile);
      for (const BlobRef& state : states_) {
        const PixelRect other = old_tiles.rect(state.tile);
        const bool meet =
            rect.x0 < other.x1 && other.x0 < rect.x1 && rect.y0 < other.y1 && other.y0 < rect.y1;
        if (meet) cut.states.push_back(state);
      }
      std::sort(cut.states.begin(), cut.states.end());
      adoption.plan.cuts.push_back(std::move(cut));
    }
  }

 private:
  /// The one after the last step of its tasks.
  Step end_of_tasks() const {
    Step end{0};
    for (const Completions::Task& task : former_.tasks) {
      if (!old_graph_.find(task.task)) continue;
      const Step last = task.task.kind == TaskKind::assemble
                            ? old_graph_.timeline().last_step_of(task.task.frame())
                            : old_graph_.steps(task.task).last;
      end = std::max(end, last + 1);
    }
    return end;
  }

  /// The end of the last step in common that one of its tasks has rendered.
  Step progress() const {
    Step end{0};
    for (const Completions::Task& task : former_.tasks) {
      if (task.task.kind == TaskKind::render && old_graph_.find(task.task))
        end = std::max(end, old_graph_.steps(task.task).last + 1);
    }
    return std::min(end, common_end_);
  }

  /// The states that are all there of the newest step before `end`; 0: there are none. Else the
  /// step after it.
  Step newest_states(Step end, const KeptFiles& files) {
    std::map<Run, std::vector<BlobRef>> states;
    for (const Completions::Task& task : former_.tasks) {
      if (task.task.kind != TaskKind::render || !old_graph_.find(task.task)) continue;
      if (task.outputs.empty() || task.outputs.front().kind != BlobKind::state) continue;
      if (old_graph_.steps(task.task).last < std::min(end, common_end_))
        states[task.task.run()].push_back(task.outputs.front());
    }
    for (auto run = states.rbegin(); run != states.rend(); ++run) {
      if (run->second.size() != static_cast<std::size_t>(old_graph_.num_tiles())) continue;
      if (!std::all_of(run->second.begin(), run->second.end(), files.has_blob)) continue;
      states_ = run->second;
      return old_graph_.timeline().steps_of(run->first).last + 1;
    }
    return Step(0);
  }

  bool is_same_run(const JobGraph& graph, Run run) const {
    return run < Run(old_graph_.num_runs()) &&
           graph.timeline().steps_of(run) == old_graph_.timeline().steps_of(run);
  }

  const JobSpec& job_;
  const FormerJob& former_;
  const JobSpec& old_;
  const JobGraph old_graph_;
  /// The one after the last that both jobs have and that it has tasks of.
  const Step common_end_;
  std::vector<BlobRef> states_;
};

/// Runs of the first sweep whose frames are all kept, or none: at multiples of `length`, and
/// wherever that changes.
std::vector<Step> runs_between(const KeptFrames& kept, const Timeline& timeline,
                               std::int32_t length) {
  std::vector<Step> starts;
  std::size_t end = 0;
  for (FrameIndex frame{0}; frame < FrameIndex(timeline.num_frames()); ++frame) {
    const bool changes = frame > FrameIndex(0) && kept.has(frame) != kept.has(frame - 1);
    if (!changes && frame.value() % length != 0) continue;
    starts.push_back(timeline.step_of(frame, Sweep(0)));
    if (changes) end = starts.size();
  }
  starts.resize(end);
  return starts;
}

/// Tasks of runs and frames that are kept as a whole and that nobody takes over.
std::vector<TaskKey> skipped_tasks(const JobSpec& job, const KeptFrames& kept,
                                   const std::vector<TaskKey>& taken) {
  const JobGraph graph(job);
  const std::set<TaskKey> known(taken.begin(), taken.end());
  std::vector<TaskKey> skipped;
  const auto skip = [&](TaskKey key) {
    for (key.tile = 0; key.tile < graph.num_tiles(); ++key.tile) {
      if (!known.contains(key)) skipped.push_back(key);
    }
  };
  const Timeline& timeline = graph.timeline();
  for (Run run{0}; run < Run(graph.num_runs()); ++run) {
    const StepSpan steps = timeline.steps_of(run);
    for (Step step = steps.first; job.visibility.correlated && step <= steps.last; ++step) {
      if (kept.has(timeline.frame_of(step))) skip(second_pass_task(step, 0));
    }
    if (kept.has_all(timeline, steps)) skip(render_task(run, 0));
  }
  return skipped;
}

}  // namespace

bool writes_alike(const JobSpec& one, const JobSpec& other) {
  const OutputSpec &a = one.output, &b = other.output;
  return films_alike(one, other) && a.background == b.background && a.shadows == b.shadows &&
         a.pattern == b.pattern && a.pixel_type == b.pixel_type && a.compression == b.compression &&
         a.naming == b.naming && a.clamp_negative == b.clamp_negative;
}

Adoption adopt(const ParsedJobDocument& wanted, const std::vector<FormerJob>& formers,
               const KeptFiles& files) {
  Adoption adoption;
  const JobSpec& job = wanted.job;
  KeptFrames kept(wanted, files);
  std::vector<Predecessor> predecessors;
  for (const FormerJob& former : formers) {
    const FrameComparison comparison(former.document, wanted);
    kept.collect(former, predecessors.size(), comparison);
    predecessors.emplace_back(wanted, former, comparison);
  }
  kept.add_locked();
  kept.write_to(adoption);

  // The one that has come farthest: with all its states, then with single tasks.
  const FrameIndex first_open = kept.first_open();
  Reach best;
  for (std::size_t i = 0; i < predecessors.size(); ++i) {
    const Reach reach = predecessors[i].reach(first_open, files);
    if (reach == Reach{} || reach < best) continue;
    best = reach;
    adoption.former = i;
  }

  // Its runs stay as they are; or else no run has frames that are kept beside others.
  const Timeline timeline(job);
  const bool at_rest = !(shares_history(job) && carries_state(job));
  std::vector<Step> runs;
  if (adoption.former && at_rest) {
    runs = predecessors[*adoption.former].runs_up_to(best.same_tasks ? best.tasks : best.states);
  } else if (!carries_state(job)) {
    runs = runs_between(kept, timeline, frames_per_run(job));
  }
  JobSpec with_runs = job;
  with_runs.leading_runs = runs;
  if (Timeline(with_runs).run_starts() != timeline.run_starts()) adoption.plan.leading_runs = runs;
  with_runs.leading_runs = adoption.plan.leading_runs;
  if (count_tasks(with_runs) > limits::kMaxTasksPerJob) return {};

  // Its tasks, or its states.
  if (adoption.former && best.same_tasks)
    predecessors[*adoption.former].take_tasks(with_runs, kept, files, adoption);
  if (adoption.former && !best.same_tasks && best.states < Step(timeline.num_frames()))
    predecessors[*adoption.former].cut_states(with_runs, best.states, adoption);
  if (adoption.former && (!adoption.tasks.empty() || !adoption.plan.cuts.empty()))
    adoption.kept_of.insert(*adoption.former);
  adoption.skipped = skipped_tasks(with_runs, kept, adoption.tasks);
  return adoption;
}

}  // namespace baton
