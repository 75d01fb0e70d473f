#include "worker/run/local_render.h"

#include <algorithm>
#include <array>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "common/job/motion.h"
#include "common/job/sequence.h"
#include "worker/run/frame_output.h"

namespace baton {
namespace {

/// Collects tiles until their frame is whole, then hands it to the sink.
class FrameCollector {
 public:
  FrameCollector(const JobSpec& job, const FrameSink& sink)
      : job_(job), num_tiles_(TileGrid(job.image).count()), sink_(sink) {}

  Status add(std::int32_t frame_index, const FilmTile& film) {
    std::unique_lock lock(mutex_);
    Frame& frame = frames_[frame_index];
    if (frame.num_tiles == 0) frame.image = blank_image(job_.image, film.channels);
    BATON_TRY(paste_tile(film, frame.image));
    if (++frame.num_tiles < num_tiles_) return {};

    // Whole: out of the map, so that the sink may take its time without the lock.
    const FilmTile image = std::move(frame.image);
    frames_.erase(frame_index);
    lock.unlock();
    return sink_(frame_index, image);
  }

 private:
  struct Frame {
    FilmTile image;
    std::int32_t num_tiles = 0;
  };
  const JobSpec& job_;
  const std::int32_t num_tiles_;
  const FrameSink& sink_;
  std::mutex mutex_;
  std::map<std::int32_t, Frame> frames_;  ///< begun and not whole
};

/// The tile runs of a job, handed out run by run; a tile's next run waits for those that it takes
/// its history from.
class LocalRender {
 public:
  LocalRender(const RenderContext& context, const JobSpec& job, const FrameSink& sink)
      : context_(context),
        job_(job),
        num_tiles_(TileGrid(job.image).count()),
        num_runs_(num_runs(job)),
        grid_(job.image),
        reach_px_(history_reach_px(job)),
        chains_(static_cast<std::size_t>(num_tiles_)),
        frames_(job, sink) {}

  void work(std::stop_token stop) {
    while (const std::optional<TileRun> run = next()) {
      StatePtr state;
      const Result<RenderStats> stats = render(*run, state, stop);
      finish(*run, stats, std::move(state));
    }
  }

  Result<RenderStats> result() const {
    if (error_) return *error_;
    return total_;
  }

 private:
  /// One tile through time. A state lives until every tile that needs it has gone on: nobody can be
  /// two runs ahead.
  struct Chain {
    std::int32_t runs_done = 0;
    std::array<StatePtr, 2> states;  ///< by run % 2
  };

  Chain& chain(std::int32_t tile) { return chains_[static_cast<std::size_t>(tile)]; }
  std::vector<std::int32_t> near(std::int32_t tile) const {
    return grid_.tiles_near(tile, reach_px_);
  }

  /// The next run in order, once all that it needs is done. Whoever has that is at work, so nobody
  /// waits for ever.
  std::optional<TileRun> next() {
    std::unique_lock lock(mutex_);
    if (error_ || next_ >= std::int64_t{num_runs_} * num_tiles_) return std::nullopt;
    const auto run = static_cast<std::int32_t>(next_ / num_tiles_);
    const auto tile = static_cast<std::int32_t>(next_ % num_tiles_);
    ++next_;
    const std::vector<std::int32_t> needed = near(tile);
    changed_.wait(lock, [&] {
      return error_ || std::all_of(needed.begin(), needed.end(),
                                   [&](std::int32_t t) { return chain(t).runs_done >= run; });
    });
    if (error_) return std::nullopt;
    return tile_run(job_, tile, run);
  }

  /// Renders a run from the states before it; `state` becomes its own.
  Result<RenderStats> render(const TileRun& run, StatePtr& state, std::stop_token stop) {
    std::vector<StatePtr> previous;
    if (run.run > 0 && carries_state(job_)) {
      const std::lock_guard lock(mutex_);
      for (const std::int32_t t : near(run.tile))
        previous.push_back(chain(t).states[(run.run + 1) % 2]);
    }
    const TileRunSink sink{
        .film = [&](int frame_index,
                    const FilmTile& film) { return frames_.add(frame_index, film); },
        .state =
            [&](const SampleState& next_state) {
              state = std::make_shared<const SampleState>(next_state);
              return Status();
            }};
    return run_tile(context_, run, previous, sink, stop);
  }

  void finish(const TileRun& run, const Result<RenderStats>& stats, StatePtr state) {
    {
      const std::lock_guard lock(mutex_);
      Chain& done = chain(run.tile);
      done.states[run.run % 2] = std::move(state);
      ++done.runs_done;
      if (reach_px_ == 0) done.states[(run.run + 1) % 2] = nullptr;
      if (stats) {
        total_.merge(*stats);
      } else if (!error_) {
        error_ = stats.error();
      }
    }
    changed_.notify_all();
  }

  const RenderContext& context_;
  const JobSpec& job_;
  const std::int32_t num_tiles_, num_runs_;
  const TileGrid grid_;
  const std::int32_t reach_px_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::int64_t next_ = 0;  ///< run * num_tiles + tile
  std::vector<Chain> chains_;
  RenderStats total_;
  std::optional<Error> error_;
  FrameCollector frames_;
};

}  // namespace

Result<RenderStats> render_locally(const RenderContext& context, const JobSpec& job,
                                   int num_threads, const FrameSink& sink, std::stop_token stop) {
  LocalRender render(context, job, sink);
  std::vector<std::thread> threads;
  for (int i = 0; i < num_threads; ++i) threads.emplace_back([&] { render.work(stop); });
  for (std::thread& thread : threads) thread.join();
  return render.result();
}

}  // namespace baton
