#include "worker/run/execute.h"

#include <fmt/format.h>

#include "common/base/cpu_clock.h"
#include "common/base/file_stamp.h"
#include "common/base/patiently.h"
#include "common/base/trace.h"
#include "common/image/film_tile.h"
#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "common/scene/plate.h"
#include "common/state/join_states.h"
#include "common/state/sample_state.h"
#include "worker/exchange/second_pass.h"
#include "worker/pass/render_context.h"
#include "worker/pass/shared_assets.h"
#include "worker/run/frame_output.h"

namespace baton {
namespace {

std::string blob_name(const BlobRef& ref) {
  return fmt::format("{} of frame index {} tile {} ({})", blob_kind_name(ref.kind), ref.position,
                     ref.tile, ref.digest.hex());
}

/// The store as a task uses it: what it reads and puts is waited for.
class PatientStore {
 public:
  PatientStore(BlobStore& store, const std::stop_token& stop) : store_(store), stop_(stop) {}

  Result<Bytes> get(const Digest& digest) const {
    const Span span(SpanKind::read, "a blob");
    return patiently([&] { return store_.get(digest); }, stop_);
  }
  Result<BlobRef> put(BlobKind kind, Step step, std::int32_t tile, const Bytes& bytes) const {
    const Span span(SpanKind::write, std::string(blob_kind_name(kind)));
    BATON_ASSIGN(const Digest digest, patiently([&] { return store_.put(bytes); }, stop_));
    return BlobRef{kind, step.value(), tile, digest, bytes.size()};
  }
  const std::stop_token& stop() const { return stop_; }

 private:
  BlobStore& store_;
  const std::stop_token& stop_;
};

/// A film of the job's step, as one pass made it.
Result<FilmTile> read_film(const LoadedJob& loaded, const PatientStore& store, const BlobRef& ref,
                           FilmPass pass) {
  if (ref.kind != BlobKind::film)
    return Error{ErrorKind::bad_input, fmt::format("{}: expected a film", blob_name(ref))};
  BATON_ASSIGN(const Bytes bytes, store.get(ref.digest));
  BATON_ASSIGN(StoredFilm stored, decode_film_tile(bytes, blob_name(ref)));
  if (stored.origin == FilmOrigin{loaded.picture, ref.step(), pass}) return std::move(stored.film);
  return Error{ErrorKind::bad_input,
               fmt::format("{}: of picture {} frame index {} pass {}, expected {}, {}, {}",
                           blob_name(ref), stored.origin.picture.hex(), stored.origin.step,
                           static_cast<int>(stored.origin.pass), loaded.picture.hex(), ref.step(),
                           static_cast<int>(pass))};
}

/// The states that a render task starts from, in the order of its inputs. not_held: held ones that
/// are not here.
Result<std::vector<StatePtr>> read_states(const LoadedJob& loaded, const PatientStore& store,
                                          const std::vector<BlobRef>& inputs,
                                          std::vector<BlobRef>& not_held) {
  std::vector<StatePtr> states;
  for (const BlobRef& input : inputs) {
    if (input.kind == BlobKind::film) continue;  // earlier sweeps: read at their turn
    if (input.kind != BlobKind::state) {
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: a render task takes states and films", blob_name(input))};
    }
    StatePtr state = loaded.states->find(input);
    if (state == nullptr && input.is_held()) {
      not_held.push_back(input);
      continue;
    }
    if (state == nullptr) {
      BATON_ASSIGN(const Bytes bytes, store.get(input.digest));
      BATON_ASSIGN(SampleState decoded,
                   decode_state(bytes, blob_name(input), *loaded.context->method.format));
      state = std::make_shared<const SampleState>(std::move(decoded));
      if (moves(loaded.job)) loaded.states->keep(input.digest, state);
    }
    states.push_back(std::move(state));
  }
  return states;
}

/// The task's state after `step` from those of another tiling.
Result<TaskResult> execute_cut(const LoadedJob& loaded, const PatientStore& store,
                               const TaskKey& task, Step step, const std::vector<BlobRef>& inputs) {
  TaskResult output;
  const CpuTimer timer(output.made.stats.seconds_state);
  const PixelRect rect = TileGrid(loaded.job.image).rect(task.tile);
  BATON_ASSIGN(const std::vector<StatePtr> others,
               read_states(loaded, store, inputs, output.not_held));
  if (!output.not_held.empty()) return output;
  std::vector<const SampleState*> parts;
  for (const StatePtr& other : others) {
    if (other->step != step || other->picture != loaded.picture) {
      return Error{ErrorKind::bad_input,
                   fmt::format("a state of picture {} step {}, expected {}, {}",
                               other->picture.hex(), other->step, loaded.picture.hex(), step)};
    }
    parts.push_back(other.get());
  }
  BATON_ASSIGN(const SampleState state, join_states(parts, rect, task.tile));
  BATON_ASSIGN(const BlobRef put,
               store.put(BlobKind::state, state.step, task.tile, encode_state(state)));
  output.made.outputs.push_back(put);
  return output;
}

/// Keeps what a render task hands on: in this process if it may stay here, else in the store.
Status keep_state(const LoadedJob& loaded, const PatientStore& store, bool may_hold,
                  SampleState&& state, std::vector<BlobRef>& outputs) {
  const BlobRef held{BlobKind::state, state.step.value(), state.tile,
                     held_state_name(loaded.digest, state.step, state.tile)};
  const auto shared = std::make_shared<const SampleState>(std::move(state));
  if (may_hold && loaded.states->hold(held, shared)) {
    outputs.push_back(held);
    return {};
  }
  BATON_ASSIGN(const BlobRef put,
               store.put(BlobKind::state, shared->step, shared->tile, encode_state(*shared)));
  outputs.push_back(put);
  if (moves(loaded.job)) loaded.states->keep(put.digest, shared);
  return {};
}

Result<TaskResult> execute_render(const LoadedJob& loaded, const PatientStore& store,
                                  const Grant& grant, std::vector<BlobRef>* left) {
  const TaskKey& task = grant.lease.task;
  const StepSpan& steps = grant.steps;
  // Check what came over the wire against the job.
  if (steps.first < Step(0) || steps.size() < 0 || steps.last < Step(0) ||
      steps.last >= Step(num_steps(loaded.job)) || task.tile < 0 ||
      task.tile >= TileGrid(loaded.job.image).count()) {
    return Error{ErrorKind::bad_input, fmt::format("the job has no tile {} in steps {} to {}",
                                                   task.tile, steps.first, steps.last)};
  }
  if (steps.empty()) return execute_cut(loaded, store, task, steps.last, grant.inputs);
  double seconds_read = 0;
  TaskResult output;
  std::vector<StatePtr> previous;
  {
    const CpuTimer timer(seconds_read);
    BATON_ASSIGN(previous, read_states(loaded, store, grant.inputs, output.not_held));
  }
  if (!output.not_held.empty()) return output;
  double seconds_state = seconds_read;

  // Render.
  const auto keep = [&](BlobKind kind, Step step, const Bytes& bytes) -> Status {
    BATON_ASSIGN(const BlobRef put, store.put(kind, step, task.tile, bytes));
    output.made.outputs.push_back(put);
    return {};
  };
  const TileRunSink sink{
      .film =
          [&](Step step, const FilmTile& film) {
            return keep(BlobKind::film, step, encode_film_tile(film, {loaded.picture, step}));
          },
      .state = [&](SampleState state) -> Status {
        const CpuTimer timer(seconds_state);
        return keep_state(loaded, store, grant.may_hold, std::move(state), output.made.outputs);
      },
      .diagnostics = [&](const FrameStats& stats) { output.made.frames.push_back(stats); },
      .samples = [&](const FirstPassSamples& samples) -> Status {
        return keep(BlobKind::first_pass, samples.step, encode_first_pass_samples(samples));
      },
      .earlier_film = [&](Step step) -> Result<FilmTile> {
        for (const BlobRef& input : grant.inputs) {
          if (input.kind == BlobKind::film && input.step() == step && input.tile == task.tile)
            return read_film(loaded, store, input, FilmPass::first);
        }
        return Error{ErrorKind::bad_input,
                     fmt::format("the task lacks the film of step {} tile {}", step, task.tile)};
      }};
  const TileRun run{task.tile, task.run(), steps};
  Result<RenderStats> stats = run_tile(*loaded.context, run, previous, sink, store.stop());
  if (!stats) {
    if (left != nullptr) *left = std::move(output.made.outputs);
    return stats.error();
  }
  output.made.stats = *stats;
  // run_tile counts what its sink does, not what was read before.
  output.made.stats.seconds_state = seconds_state;
  output.made.stats.cpu_seconds += seconds_read;
  return output;
}

/// Inputs: the first-pass samples of the tiles within reach in tile order, the tile's own film
/// among them.
Result<TaskResult> execute_second_pass(const LoadedJob& loaded, const PatientStore& store,
                                       const TaskKey& task, const std::vector<BlobRef>& inputs) {
  const auto num_frames = static_cast<std::int32_t>(loaded.job.frames.size());
  if (!loaded.job.visibility.correlated || task.step() < Step(0) ||
      task.step() >= Step(num_frames) || task.tile < 0 ||
      task.tile >= TileGrid(loaded.job.image).count()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("the job has no second pass of tile {} in frame index {}", task.tile,
                             task.step())};
  }

  // Read.
  FilmTile film;
  std::vector<FirstPassPtr> near;
  for (const BlobRef& input : inputs) {
    if (input.kind == BlobKind::first_pass) {
      BATON_ASSIGN(const Bytes bytes, store.get(input.digest));
      BATON_ASSIGN(FirstPassSamples samples, decode_first_pass_samples(bytes, blob_name(input)));
      near.push_back(std::make_shared<const FirstPassSamples>(std::move(samples)));
    } else {
      BATON_ASSIGN(film, read_film(loaded, store, input, FilmPass::first));
    }
  }

  BATON_ASSIGN(const SecondPassOutput second,
               run_second_pass(*loaded.context, task.step(), task.tile, film, near));
  BATON_ASSIGN(
      const BlobRef put,
      store.put(BlobKind::film, task.step(), task.tile,
                encode_film_tile(second.film, {loaded.picture, task.step(), FilmPass::second})));
  return TaskResult{{{put}, second.stats}};
}

/// The plate of a frame, which must still be the job's.
Result<Plate> read_plate(const LoadedJob& loaded, FrameNumber number) {
  BATON_ASSIGN(Plate plate, load_plate(loaded.context->job, number, loaded.plates));
  BATON_TRY(verify_asset(loaded.assets, file_at(*loaded.context->job.output.plate, number)));
  return plate;
}

/// The whole image, of one film a tile. Inputs: those of a step, in any order.
Result<FilmTile> join_films(const LoadedJob& loaded, const PatientStore& store, Step step,
                            const std::vector<BlobRef>& inputs, const Lend& lend) {
  const TileGrid grid(loaded.job.image);
  std::vector<bool> is_there(inputs.size(), false);
  for (const BlobRef& input : inputs) {
    const bool fits = input.kind == BlobKind::film && input.step() == step && input.tile >= 0 &&
                      input.tile < grid.count() && !is_there[static_cast<std::size_t>(input.tile)];
    if (!fits)
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: is not a new tile of step {}", blob_name(input), step)};
    is_there[static_cast<std::size_t>(input.tile)] = true;
  }

  const FilmPass pass = loaded.job.visibility.correlated ? FilmPass::second : FilmPass::first;
  FilmTile image;
  const auto paste = [&](const BlobRef& input) -> Status {
    if (store.stop().stop_requested())
      return Error{ErrorKind::cancelled, "stopped while assembling"};
    BATON_ASSIGN(const FilmTile film, read_film(loaded, store, input, pass));
    if (film.rect != grid.rect(input.tile))
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: has not the pixels of its tile", blob_name(input))};
    if (image.channels.empty()) image = blank_image(loaded.job.image.rendered(), film.channels);
    return paste_tile(film, image);
  };
  // The first says which channels there are.
  BATON_TRY(paste(inputs.front()));
  std::vector<Status> pasted(inputs.size() - 1);
  share_parts(lend, fmt::format("tiles of step {}", step), pasted.size(),
              [&](std::size_t i) { pasted[i] = paste(inputs[i + 1]); });
  for (const Status& one : pasted) BATON_TRY(one);
  return image;
}

Result<TaskResult> execute_assemble(const LoadedJob& loaded, const PatientStore& store,
                                    const Grant& grant, const Lend& lend) {
  const TaskKey& task = grant.lease.task;
  const std::vector<BlobRef>& inputs = grant.inputs;
  const std::int32_t num_tiles = TileGrid(loaded.job.image).count();
  const auto num_frames = static_cast<std::int32_t>(loaded.job.frames.size());
  const FrameIndex frame = task.frame();
  if (frame < FrameIndex(0) || frame >= FrameIndex(num_frames) ||
      inputs.size() != static_cast<std::size_t>(num_tiles)) {
    return Error{ErrorKind::bad_input,
                 fmt::format("frame index {} of {}: got {} films, expected {}", frame, num_frames,
                             inputs.size(), num_tiles)};
  }
  const Step last_sweep = Timeline(loaded.job).last_step_of(frame);
  BATON_ASSIGN(FilmTile image, join_films(loaded, store, last_sweep, inputs, lend));

  std::optional<RgbImage> plate_image;
  std::vector<std::string> notes;
  if (const JobSpec& here = loaded.context->job; has_plate(here.output)) {
    const FrameNumber number = here.frames[frame.index()];
    BATON_ASSIGN(Plate plate, patiently([&] { return read_plate(loaded, number); }, store.stop()));
    notes = plate_notes(file_at(*here.output.plate, number), plate);
    plate_image = std::move(plate.picture);
  }
  std::optional<PictureInPlace> other;
  const auto may_replace = [&](const Digest& made) -> Result<bool> {
    const std::filesystem::path path = frame_path(loaded.job, frame);
    Result<FramePlace> place =
        patiently([&] { return look_at_place(path, made, grant.may_replace); }, store.stop());
    if (!place) return Error{ErrorKind::timeout, place.error().message};
    other = std::move(place->stays);
    if (other)
      return Error{ErrorKind::cancelled, path.string() + ": another picture is in its place"};
    BATON_TRY(expect_unlocked(loaded, frame, store.stop()));
    return !place->is_free;
  };
  const Result<WrittenFrame> written =
      write_frame(loaded.job, loaded.digest, frame, std::move(image), plate_image, may_replace,
                  store.stop(), loaded.roots, lend);
  if (!written && other) return TaskResult{.made = {}, .in_place = std::move(other)};
  if (!written && written.error().kind == ErrorKind::timeout) {
    TaskResult unseen;
    unseen.unseen = written.error().message;
    return unseen;
  }
  if (!written) return written.error();
  // As it stands now it is what was read back.
  const auto stamp = stamp_of(frame_path(loaded.job, frame));
  return TaskResult{.made = {.outputs = {written->file},
                             .frames = {{frame.value(), task.tile, {}, written->quality}}},
                    .frame = stamp && *stamp ? **stamp : FileStamp(),
                    .notes = std::move(notes)};
}

}  // namespace

Result<TaskResult> execute_task(const LoadedJob& loaded, BlobStore& store, const Grant& grant,
                                const std::stop_token& stop, std::vector<BlobRef>* left,
                                const Lend& lend) {
  const TaskKey& task = grant.lease.task;
  const PatientStore patient(store, stop);
  loaded.states->release_before(grant.states_from);
  switch (task.kind) {
    case TaskKind::render:
      return execute_render(loaded, patient, grant, left);
    case TaskKind::second_pass:
      return execute_second_pass(loaded, patient, task, grant.inputs);
    case TaskKind::assemble:
      return execute_assemble(loaded, patient, grant, lend);
  }
  return Error{ErrorKind::bad_input, "unknown kind of task"};
}

Result<std::vector<PublishedState>> publish_held(const JobStates::List& states, BlobStore& store) {
  std::vector<PublishedState> published;
  const std::stop_token never;
  const PatientStore patient(store, never);
  for (const auto& [ref, state] : states) {
    BATON_ASSIGN(const BlobRef put,
                 patient.put(ref.kind, ref.step(), ref.tile, encode_state(*state)));
    published.push_back({ref, put});
  }
  return published;
}

}  // namespace baton
