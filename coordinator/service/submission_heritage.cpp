// What former jobs of a picture leave to a new one, and what they may not.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "coordinator/service/neighbour.h"
#include "coordinator/service/plan_text.h"
#include "coordinator/service/submission.h"

namespace baton {

/// By what the newest job of the picture was rendered that has frames, or else has anything.
std::string Submission::newest_renderer(const std::vector<InFolder>& jobs,
                                        const ParsedJobDocument& document) {
  std::string newest;
  bool has_frames = false;
  for (const auto& [digest, former] : jobs) {
    if (!(former.document.picture == document.picture) || former.renderer.empty()) continue;
    const bool has_some = std::ranges::any_of(former.tasks, [](const Completions::Task& task) {
      return task.task.kind == TaskKind::assemble;
    });
    if (has_frames && !has_some) continue;
    newest = former.renderer;
    has_frames = has_some;
  }
  return newest;
}

KeptFiles Submission::kept_files(const JobSpec& job, const LockedFrames& locked) {
  return {.has_frame =
              [this, &job](FrameIndex frame, const BlobRef& image) {
                return files_.is_right(frame_path(job, frame), image);
              },
          .has_blob = [this](const BlobRef& blob) { return farm_.store.contains(blob.digest); },
          .locked = locked.frames()};
}

/// Frames of a job are by one renderer. Error (bad_input): of some that are there and right, and by
/// another one than the newest, only a person can say that they are rendered again.
Status Submission::expect_by_one(const ParsedJobDocument& document, const LockedFrames& locked) {
  if (farm_.options.mixed_builds || document.job.output.is_look) return {};
  BATON_ASSIGN(const auto* neighbours, jobs_in(document.job.output.directory));
  const std::string newest = newest_renderer(*neighbours, document);
  std::vector<FormerJob> all, alike;
  std::string other;
  for (const auto& [digest, former] : *neighbours) {
    if (former.document.picture != document.picture) continue;
    const bool is_alike = former.renderer.empty() || former.renderer == newest;
    if (is_alike) alike.push_back(former);
    if (!is_alike) other = former.renderer;
    all.push_back(former);
  }
  if (other.empty()) return {};
  const KeptFiles kept = kept_files(document.job, locked);
  std::set<FrameIndex> by_others;
  for (const Completion& frame : adopt(document, all, kept).frames)
    by_others.insert(frame.task.frame());
  for (const Completion& frame : adopt(document, alike, kept).frames)
    by_others.erase(frame.task.frame());
  if (by_others.empty()) return {};
  std::vector<FrameNumber> numbers;
  for (const FrameIndex frame : by_others) numbers.push_back(document.job.frames[frame.index()]);
  return Error{
      ErrorKind::bad_input,
      fmt::format("job '{}': frames {} in {} were rendered with {}, what came later with {}, and "
                  "pixels may differ\n--restart renders all frames again, --from-frame N those "
                  "from N on, and keeps the others",
                  document.job.name, format_frames(numbers), document.job.output.directory, other,
                  newest)};
}

/// Frames in whose places other pictures of jobs that are known here stand.
std::set<FrameIndex> Submission::frames_of_others(const ParsedJobDocument& document,
                                                  const std::vector<InFolder>& jobs) const {
  std::set<FrameIndex> frames;
  const FramesByFile by_file(document);
  for (const auto& [digest, former] : jobs) {
    if (former.document.picture == document.picture) continue;
    for (const Completions::Task& task : former.tasks) {
      if (task.task.kind != TaskKind::assemble || task.outputs.size() != 1) continue;
      const auto place = by_file.find(former.document.job, task.task.frame());
      if (place && files_.is_right(frame_path(document.job, *place), task.outputs.front()))
        frames.insert(*place);
    }
  }
  return frames;
}

/// What jobs of the same picture in the same folder leave to a new one, itself among them.
/// restart: nothing, where nobody who is connected renders as that was rendered.
Result<Submission::Heritage> Submission::find_heritage(const ParsedJobDocument& document,
                                                       bool restart, const LockedFrames& locked,
                                                       std::vector<std::string>& reasons) {
  Heritage heritage;
  BATON_ASSIGN(const auto* neighbours, jobs_in(document.job.output.directory));
  std::vector<FormerJob> formers;
  // Where frames of a job are by one renderer, that decides.
  const std::string newest = newest_renderer(*neighbours, document);
  for (auto& [digest, former] : *neighbours) {
    if (!(former.document.picture == document.picture)) continue;
    const bool is_other =
        !farm_.options.mixed_builds && !former.renderer.empty() && former.renderer != newest;
    const std::string held = held_to(former.renderer, former.is_mixed, farm_.options.mixed_builds);
    if (is_other || (restart && farm_.scheduler.leases().nobody_renders_as(held))) {
      std::string reason = "nothing is kept of these that was rendered with " + held;
      if (std::ranges::find(reasons, reason) == reasons.end()) reasons.push_back(std::move(reason));
      continue;
    }
    formers.push_back(std::move(former));
    heritage.formers.push_back(digest);
  }
  const std::set<FrameIndex> of_others = frames_of_others(document, *neighbours);
  folders_.clear();
  heritage.adoption = adopt(document, formers, kept_files(document.job, locked));
  const Adoption& adoption = heritage.adoption;
  if (!formers.empty()) {
    const FormerJob& beside = formers[adoption.beside.value_or(formers.size() - 1)];
    for (std::string& reason :
         output_reasons(beside.document.job, document.job, adoption.other_plates))
      reasons.push_back(std::move(reason));
  }
  constexpr std::size_t kMost = 8;
  std::size_t num_gone = 0;
  for (const FrameIndex frame : adoption.lost) {
    if (adoption.overwritten.contains(frame) || of_others.contains(frame)) continue;
    if (++num_gone > kMost) continue;
    reasons.push_back(fmt::format("{} is gone, or not as it was last written",
                                  frame_path(document.job, frame).string()));
  }
  if (num_gone > kMost) reasons.push_back(fmt::format("and {} frames more", num_gone - kMost));
  if (adoption.former) {
    heritage.renderer = formers[*adoption.former].renderer;
  } else if (!adoption.kept_of.empty() && !farm_.options.mixed_builds) {
    heritage.renderer = newest;
  }
  std::set<std::string> renderers;
  for (const std::size_t former : adoption.kept_of) {
    heritage.is_mixed = heritage.is_mixed || formers[former].is_mixed;
    if (!formers[former].renderer.empty()) renderers.insert(formers[former].renderer);
  }
  heritage.is_mixed = heritage.is_mixed || renderers.size() > 1;
  return heritage;
}

/// Journals a job as if it had itself done what it adopts, and adds that to the event. text: the
/// document; empty: the journal has it.
Status Submission::take_over(const Heritage& heritage, const std::string& text, JobAdded& event) {
  const Adoption& adoption = heritage.adoption;
  // Read before the journal changes, since the job may go on from itself. What the assembly of a
  // kept frame counted is the job's, too, if it is a task of the former one.
  std::map<TaskKey, Completion> kept;
  for (const Completion& frame : adoption.frames) kept.emplace(frame.task, frame);
  const std::set<TaskKey> tasks(adoption.tasks.begin(), adoption.tasks.end());
  const std::set<FrameIndex> lost(adoption.lost.begin(), adoption.lost.end());
  std::vector<Completion> taken;
  if (adoption.former) {
    const Digest& former = heritage.formers[*adoption.former];
    BATON_TRY(
        farm_.journal.for_each_completion(former, [&](const Completion& completion) -> Status {
          const bool is_assembly = completion.task.kind == TaskKind::assemble;
          const auto frame = kept.find(completion.task);
          if (frame != kept.end() && frame->second.made.outputs == completion.made.outputs)
            frame->second.made.stats = completion.made.stats;
          // A frame that the job itself wrote and that is gone must come out as it was.
          const bool is_lost =
              former == event.job && is_assembly && lost.contains(completion.task.frame());
          if (is_lost) event.lost.push_back(completion.task);
          if (is_lost || tasks.contains(completion.task)) taken.push_back(completion);
          return {};
        }));
  }
  for (auto& [task, frame] : kept) taken.push_back(std::move(frame));
  for (const TaskKey& task : adoption.skipped) taken.push_back({task, {}});

  if (text.empty()) {
    // Where nothing of the job itself was looked at, its files may still be there, and nothing
    // must come out as it was.
    const bool was_asked = std::ranges::find(heritage.formers, event.job) != heritage.formers.end();
    if (was_asked) {
      BATON_TRY(farm_.journal.for_each_completion(
          event.job,
          [&](const Completion& former) -> Status {
            event.former.push_back({former.task, former.made.outputs});
            return {};
          },
          Journal::Which::former));
    }
    BATON_TRY(farm_.journal.restart_job(event.job));
    BATON_TRY(farm_.journal.record_reopened(event.job, {}, event.former));
    for (const FrameIndex frame : was_asked ? adoption.lost : std::vector<FrameIndex>())
      BATON_TRY(farm_.journal.record_frame_file(event.job, frame, std::nullopt));
  } else {
    BATON_TRY(
        farm_.journal.add_job(event.job, text, {event.spec.name, event.spec.output.directory}));
  }
  BATON_TRY(farm_.journal.record_plan(event.job, adoption.plan));
  event.renderer = held_to(heritage.renderer, heritage.is_mixed, farm_.options.mixed_builds);
  event.is_mixed = heritage.is_mixed;
  if (!heritage.renderer.empty() || heritage.is_mixed)
    BATON_TRY(farm_.journal.record_renderer(event.job, heritage.renderer, heritage.is_mixed));
  // A job stays its owner's, whoever changes it.
  const std::vector<Digest> versions =
      farm_.history.jobs().versions(farm_.history.jobs().of(event.job).id);
  const auto owned = std::ranges::find_if(
      versions, [&](const Digest& version) { return farm_.owners.contains(version); });
  const std::string owner = owned == versions.end() ? speaker_.name : farm_.owner_of(*owned);
  if (!owner.empty() && !farm_.owners.contains(event.job)) {
    farm_.owners[event.job] = owner;
    BATON_TRY(farm_.journal.record_owner(event.job, owner));
  }
  event.spec.leading_runs = adoption.plan.leading_runs;
  event.plan = adoption.plan;
  for (const Completion& completion : taken) {
    BATON_TRY(farm_.journal.record_completion(event.job, completion));
    event.completions.add(completion);
  }
  return {};
}

}  // namespace baton
