#pragma once

#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/job/job_spec.h"
#include "common/job/plan/sequence.h"
#include "common/job/task.h"
#include "common/state/first_pass_samples.h"
#include "common/state/sample_state.h"
#include "worker/pass/memory_budget.h"

namespace baton {

/// Everything about a job that its tiles share: scene, ray tracer, maps, the environments of its
/// frames. Loaded once per job and process; any number of threads may render with it.
class RenderContext;
struct SharedAssets;

/// Loads every asset of the job; `picture` names its states. Errors name the file and what was
/// expected; several faults are joined by newlines.
Result<std::shared_ptr<const RenderContext>> load_render_context(const JobSpec& job,
                                                                 const Digest& picture);

/// A context with assets that are loaded already (worker/pass/shared_assets.h): those of the job's
/// scene. memory: whose shares it uses. Error: motion that is not settled.
Result<std::shared_ptr<const RenderContext>> make_render_context(
    const JobSpec& job, const Digest& picture, const std::shared_ptr<const SharedAssets>& assets,
    const MemoryBudget& memory = MemoryBudget::of_machine());

/// Where the films of a tile run go, step by step. Called on the rendering thread.
struct TileRunSink {
  /// film: the mean of this sweep and all before it.
  std::function<Status(Step step, const FilmTile& film)> film;
  /// Called for the last frame of the run when the job carries state.
  std::function<Status(SampleState state)> state = {};
  /// Called after each film with what the sampler did; may be empty.
  std::function<void(const FrameStats& stats)> diagnostics = {};
  /// Called after each film when the job has a second pass.
  std::function<Status(FirstPassSamples samples)> samples = {};
  /// Where films of an earlier sweep come from; called for the steps of later ones.
  std::function<Result<FilmTile>(Step step)> earlier_film = {};
};

using StatePtr = std::shared_ptr<const SampleState>;

/// Renders one tile for the steps of `run`. previous: the states of step run.steps.first - 1 of
/// all tiles within history_reach_px (TileGrid::tiles_near, in that order; the tile's own where
/// pixels keep to themselves), required exactly when the job carries state and the run is not the
/// first. The bytes that reach the sink are a function of (job, run, previous, earlier films)
/// alone. Errors: a state of another picture, tile or step; a film of another tile; cancelled when
/// `stop` is requested; the sink's own.
Result<RenderStats> run_tile(const RenderContext& context, const TileRun& run,
                             std::span<const StatePtr> previous, const TileRunSink& sink,
                             const std::stop_token& stop);

/// What people should know of the job's files, one line each, after a task: of the maps read so
/// far, and with the first task of the first tile of meshes and objects.
std::vector<std::string> asset_notes(const RenderContext& context, const TaskKey& task);

/// Name of the SIMD instruction set in use, e.g. "AVX2".
std::string instruction_set();

}  // namespace baton
