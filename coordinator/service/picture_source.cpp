#include "coordinator/service/picture_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "common/base/file_stamp.h"
#include "common/job/plan/sequence.h"
#include "coordinator/service/locked_frames.h"

namespace baton {
namespace {

/// What viewers show of a frame: of the image the part that is rendered.
PixelRect seen_rect(const ImageSpec& image) {
  const PixelRect rect = image.rendered(), whole = image.whole();
  return {std::max(rect.x0, whole.x0), std::max(rect.y0, whole.y0), std::min(rect.x1, whole.x1),
          std::min(rect.y1, whole.y1)};
}

Error nothing_written(const JobSpec& spec, const AskPicture& question) {
  const std::string which = question.has_frame
                                ? fmt::format("frame {} is still to be written", question.frame)
                                : std::string("no frame is written yet");
  return {ErrorKind::bad_input, fmt::format("job '{}': {}", spec.name, which)};
}

PictureSource written_frame(const JobSpec& spec, FrameIndex frame) {
  return {.frame = spec.frames[frame.index()],
          .is_written = true,
          .file = frame_path(spec, frame).string(),
          .shown = seen_rect(spec.image),
          .rendered = spec.image.rendered()};
}

/// The newest film of a tile of the frame: of the second pass or, while there is none, of the last
/// sweep that has rendered it.
std::optional<BlobRef> newest_film(const JobSpec& spec, const JobTasks& tasks, FrameIndex frame,
                                   std::int32_t tile) {
  const JobGraph& graph = tasks.graph();
  const Timeline& timeline = graph.timeline();
  const auto film_in = [&](const TaskKey& key, Step step) -> std::optional<BlobRef> {
    const std::optional<TaskIndex> task = graph.find(key);
    if (!task) return std::nullopt;
    for (const BlobRef& made : tasks.made().outputs(*task)) {
      if (made.kind == BlobKind::film && made.step() == step) return made;
    }
    return std::nullopt;
  };
  const Step last = timeline.last_step_of(frame);
  if (auto film = film_in(second_pass_task(last, tile), last)) return film;
  for (Sweep sweep{spec.quality.sweeps - 1}; sweep >= Sweep(0); sweep = sweep - 1) {
    const Step step = timeline.step_of(frame, sweep);
    if (auto film = film_in(render_task(timeline.run_of(step), tile), step)) return film;
  }
  return std::nullopt;
}

/// The last of the first `end` frames that is so; nullopt: none is.
template <class IsSo>
std::optional<FrameIndex> last_frame(FrameIndex end, const IsSo& is_so) {
  for (FrameIndex frame = end; frame > FrameIndex(0);) {
    frame = frame - 1;
    if (is_so(frame)) return frame;
  }
  return std::nullopt;
}

}  // namespace

Result<PictureSource> find_picture(const JobSpec& spec, const JobTasks& tasks,
                                   const AskPicture& question) {
  const auto is_written = [&](FrameIndex frame) {
    return tasks.book().status(*tasks.graph().find(assemble_task(frame))) == TaskStatus::done;
  };
  // Its file stays until the new one takes its place, unless it was made again for want of that.
  const auto was_written = [&](FrameIndex frame) {
    const TaskIndex task = *tasks.graph().find(assemble_task(frame));
    const auto stamp = stamp_of(frame_path(spec, frame));
    return !tasks.made().former_outputs(task).empty() && stamp && *stamp;
  };
  const FrameIndex end(tasks.graph().num_frames());
  FrameIndex frame{0};
  if (question.has_frame) {
    BATON_ASSIGN(const std::vector<FrameIndex> places, places_of(spec, {question.frame}));
    frame = places.front();
  } else if (question.partial) {
    while (frame < end && is_written(frame)) ++frame;
    if (frame == end) frame = end - 1;
  } else {
    frame = last_frame(end, is_written).value_or(last_frame(end, was_written).value_or(frame));
  }
  if (is_written(frame)) return written_frame(spec, frame);
  if (!question.partial && was_written(frame)) {
    PictureSource before = written_frame(spec, frame);
    before.note = ", as it was before it is rendered again";
    return before;
  }
  if (!question.partial) return nothing_written(spec, question);

  PictureSource source{.frame = spec.frames[frame.index()],
                       .shown = seen_rect(spec.image),
                       .rendered = spec.image.rendered(),
                       .num_tiles = tasks.graph().num_tiles()};
  std::set<int> sweeps;
  for (std::int32_t tile = 0; tile < source.num_tiles; ++tile) {
    const auto film = newest_film(spec, tasks, frame, tile);
    if (!film) continue;
    source.films.push_back(*film);
    sweeps.insert(tasks.graph().timeline().sweep_of(film->step()).value() + 1);
  }
  if (spec.quality.sweeps > 1)
    source.note += fmt::format(", sweep {} of {}", fmt::join(sweeps, " or "), spec.quality.sweeps);
  if (has_plate(spec.output)) source.note += ", without its plate";
  if (source.films.empty())
    return Error{ErrorKind::bad_input, fmt::format("job '{}': no tile of frame {} is finished yet",
                                                   spec.name, source.frame)};
  return source;
}

Result<PictureSource> find_written_picture(const JobSpec& spec,
                                           const std::vector<FrameNumber>& done,
                                           const AskPicture& question) {
  if (!question.has_frame && done.empty()) return nothing_written(spec, question);
  const FrameNumber wanted = question.has_frame ? question.frame : done.back();
  BATON_ASSIGN(const std::vector<FrameIndex> places, places_of(spec, {wanted}));
  if (std::ranges::find(done, wanted) == done.end()) return nothing_written(spec, question);
  return written_frame(spec, places.front());
}

}  // namespace baton
