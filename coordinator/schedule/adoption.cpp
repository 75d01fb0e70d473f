#include "coordinator/schedule/adoption.h"

#include <algorithm>
#include <compare>
#include <map>
#include <set>

#include "common/base/limits.h"
#include "common/job/aov.h"
#include "common/job/motion.h"
#include "common/job/sequence.h"
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
      : wanted_(wanted), files_(files), images_(wanted.job.frames.size()) {
    for (std::size_t i = 0; i < images_.size(); ++i) index_[wanted.job.frames[i]] = i;
  }

  void look(const FormerJob& former, const FrameComparison& comparison) {
    if (!writes_alike(former.document.job, wanted_.job)) return;
    for (const Completions::Task& task : former.tasks) {
      if (task.task.kind != TaskKind::assemble || task.outputs.size() != 1) continue;
      const auto old = static_cast<std::size_t>(task.task.step);
      const auto found = index_.find(former.document.job.frames.at(old));
      if (found == index_.end() || images_[found->second]) continue;
      if (!comparison.are_equal(old, found->second)) continue;
      if (!comparison.have_one_plate(old, found->second)) {
        other_plates_ = true;
        continue;
      }

      // The same pixels: is the file as it was written?
      const auto frame = static_cast<std::int32_t>(found->second);
      BlobRef image = task.outputs.front();
      const bool is_there = files_.has_frame(frame, image);
      image.frame = frame;
      if (is_there) images_[found->second] = image;
      if (!is_there) lost_.insert(frame);

      // Which job wrote it? The headers of another job's frame differ from this one's.
      const std::vector<std::int32_t>& others = former.plan.others_frames;
      const bool is_own = former.document.digest == wanted_.digest &&
                          std::find(others.begin(), others.end(), frame) == others.end();
      if (!is_own) others_.insert(frame);
      if (is_own && is_there) others_.erase(frame);
    }
  }

  bool has(std::int32_t frame) const {
    return images_[static_cast<std::size_t>(frame)].has_value();
  }
  /// Of these steps.
  bool has_all(const JobSpec& job, const FrameSpan& steps) const {
    for (std::int32_t step = steps.first; step <= steps.last; ++step) {
      if (!has(frame_of_step(job, step))) return false;
    }
    return true;
  }
  /// The number of frames where all are kept.
  std::int32_t first_open() const {
    const auto open = std::find(images_.begin(), images_.end(), std::nullopt);
    return static_cast<std::int32_t>(open - images_.begin());
  }
  void write_to(Adoption& adoption) const {
    for (const auto& image : images_) {
      if (image) adoption.images.push_back(*image);
    }
    adoption.other_plates = other_plates_;
    adoption.plan.others_frames.assign(others_.begin(), others_.end());
    for (const std::int32_t frame : lost_) {
      if (!has(frame)) adoption.lost.push_back(frame);
    }
  }

 private:
  const ParsedJobDocument& wanted_;
  const KeptFiles& files_;
  std::map<int, std::size_t> index_;
  std::vector<std::optional<BlobRef>> images_;
  std::set<std::int32_t> lost_, others_;
  bool other_plates_ = false;
};

/// How far the work of a former job reaches; the more, the better.
struct Reach {
  std::int32_t states = 0;  ///< end of the newest step all of whose states are there
  bool same_tasks = false;  ///< its tasks are those of the wanted job
  std::int32_t tasks = 0;   ///< then the end of the newest step that a task of it has rendered

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
        num_common_(static_cast<std::int32_t>(comparison.num_common_steps())) {}

  /// How far its work reaches that the wanted job can use.
  Reach reach(std::int32_t first_open, const KeptFiles& files) {
    const bool same =
        num_common_ > 0 && job_.image.tile_size == old_.image.tile_size && films_alike(job_, old_);
    // States of another tiling come without the films of their sweep.
    const bool may_cut = job_.quality.sweeps == 1 && old_.quality.sweeps == 1;
    const std::int32_t states = carries_state(job_) && (same || may_cut)
                                    ? newest_states(same ? num_common_ : first_open, files)
                                    : 0;
    if (!same && states == 0) return {};
    return {states, same, same ? progress() : 0};
  }

  /// Its runs up to a step, and one that begins there.
  std::vector<std::int32_t> runs_up_to(std::int32_t end) const {
    std::vector<std::int32_t> starts;
    for (const std::int32_t start : run_starts(old_)) {
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
      if (key.kind == TaskKind::render && !is_same_run(graph, key.step)) continue;
      const FrameSpan frames = graph.frames(key);
      if (frames.last >= num_common_) continue;
      // States that the former job did not keep, and the new one would, are not made again.
      const bool all_kept = kept.has_all(job, frames);
      const bool lacks_state = job_.state.keep == StateKeep::all && !task.outputs.empty() &&
                               task.outputs.front().kind == BlobKind::state &&
                               !files.has_blob(task.outputs.front());
      if (!(all_kept && lacks_state)) adoption.tasks.push_back(key);
    }
    // A cut has no film for another sweep.
    for (const Cut& cut : former_.plan.cuts) {
      if (job.quality.sweeps == 1 && graph.find(cut.task) && is_same_run(graph, cut.task.step))
        adoption.plan.cuts.push_back(cut);
    }
  }

  /// Has the states that reach() found, of the frame before `end`, cut into the tiles of the job.
  void cut_states(const JobSpec& job, std::int32_t end, Adoption& adoption) const {
    const JobGraph graph(job);
    const TileGrid tiles(job_.image), old_tiles(old_.image);
    const std::int32_t run = graph.run_of(end - 1);
    for (std::int32_t tile = 0; tile < graph.num_tiles(); ++tile) {
      Cut cut{{TaskKind::render, run, tile}, {}};
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
  /// The end of the last step in common that one of its tasks has rendered.
  std::int32_t progress() const {
    std::int32_t end = 0;
    for (const Completions::Task& task : former_.tasks) {
      if (task.task.kind == TaskKind::render && old_graph_.find(task.task))
        end = std::max(end, old_graph_.last_frame(task.task.step) + 1);
    }
    return std::min(end, num_common_);
  }

  /// The states that are all there of the newest step before `end`; 0: there are none. Else the
  /// step after it.
  std::int32_t newest_states(std::int32_t end, const KeptFiles& files) {
    std::map<std::int32_t, std::vector<BlobRef>> states;  // by run
    for (const Completions::Task& task : former_.tasks) {
      if (task.task.kind != TaskKind::render || !old_graph_.find(task.task)) continue;
      if (task.outputs.empty() || task.outputs.front().kind != BlobKind::state) continue;
      if (old_graph_.last_frame(task.task.step) < std::min(end, num_common_))
        states[task.task.step].push_back(task.outputs.front());
    }
    for (auto run = states.rbegin(); run != states.rend(); ++run) {
      if (run->second.size() != static_cast<std::size_t>(old_graph_.num_tiles())) continue;
      if (!std::all_of(run->second.begin(), run->second.end(), files.has_blob)) continue;
      states_ = run->second;
      return old_graph_.last_frame(run->first) + 1;
    }
    return 0;
  }

  bool is_same_run(const JobGraph& graph, std::int32_t run) const {
    return run < old_graph_.num_runs() && graph.first_frame(run) == old_graph_.first_frame(run) &&
           graph.last_frame(run) == old_graph_.last_frame(run);
  }

  const JobSpec& job_;
  const FormerJob& former_;
  const JobSpec& old_;
  const JobGraph old_graph_;
  const std::int32_t num_common_;
  std::vector<BlobRef> states_;
};

/// Runs of frames that are all kept, or none: at multiples of `step`, and wherever that changes.
std::vector<std::int32_t> runs_between(const KeptFrames& kept, std::int32_t num_frames,
                                       std::int32_t step) {
  std::vector<std::int32_t> starts;
  std::size_t end = 0;
  for (std::int32_t frame = 0; frame < num_frames; ++frame) {
    const bool changes = frame > 0 && kept.has(frame) != kept.has(frame - 1);
    if (!changes && frame % step != 0) continue;
    starts.push_back(frame);
    if (changes) end = starts.size();
  }
  starts.resize(end);
  return starts;
}

/// Tasks of runs and frames that are kept as a whole and that nobody takes over.
std::vector<TaskKey> settled_tasks(const JobSpec& job, const KeptFrames& kept,
                                   const std::vector<TaskKey>& taken) {
  const JobGraph graph(job);
  const std::set<TaskKey> known(taken.begin(), taken.end());
  std::vector<TaskKey> settled;
  const auto settle = [&](TaskKind kind, std::int32_t step) {
    for (std::int32_t tile = 0; tile < graph.num_tiles(); ++tile) {
      if (const TaskKey key{kind, step, tile}; !known.contains(key)) settled.push_back(key);
    }
  };
  for (std::int32_t run = 0; run < graph.num_runs(); ++run) {
    const FrameSpan steps{graph.first_frame(run), graph.last_frame(run)};
    for (std::int32_t frame = steps.first; job.visibility.correlated && frame <= steps.last;
         ++frame) {
      if (kept.has(frame)) settle(TaskKind::second_pass, frame);
    }
    if (kept.has_all(job, steps)) settle(TaskKind::render, run);
  }
  return settled;
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
    kept.look(former, comparison);
    predecessors.emplace_back(wanted, former, comparison);
  }
  kept.write_to(adoption);

  // The one that has come farthest: with all its states, then with single tasks.
  const std::int32_t first_open = kept.first_open();
  Reach best;
  for (std::size_t i = 0; i < predecessors.size(); ++i) {
    const Reach reach = predecessors[i].reach(first_open, files);
    if (reach == Reach{} || reach < best) continue;
    best = reach;
    adoption.former = i;
  }

  // Its runs stay as they are; or else no run has frames that are kept beside others.
  const auto num_frames = static_cast<std::int32_t>(job.frames.size());
  const bool at_rest = !(shares_history(job) && carries_state(job));
  std::vector<std::int32_t> runs;
  if (adoption.former && at_rest) {
    runs = predecessors[*adoption.former].runs_up_to(best.same_tasks ? best.tasks : best.states);
  } else if (!carries_state(job)) {
    runs = runs_between(kept, num_frames, frames_per_run(job));
  }
  JobSpec with_runs = job;
  with_runs.leading_runs = runs;
  if (run_starts(with_runs) != run_starts(job)) adoption.plan.leading_runs = runs;
  with_runs.leading_runs = adoption.plan.leading_runs;
  if (count_tasks(with_runs) > limits::kMaxTasksPerJob) return {};

  // Its tasks, or its states.
  if (adoption.former && best.same_tasks)
    predecessors[*adoption.former].take_tasks(with_runs, kept, files, adoption);
  if (adoption.former && !best.same_tasks && best.states < num_frames)
    predecessors[*adoption.former].cut_states(with_runs, best.states, adoption);
  adoption.settled = settled_tasks(with_runs, kept, adoption.tasks);
  return adoption;
}

}  // namespace baton
