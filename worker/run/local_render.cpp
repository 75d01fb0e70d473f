#include "worker/run/local_render.h"

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

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

/// The tile runs of a job, handed out run by run; a tile's next run waits for its previous one.
class LocalRender {
 public:
  LocalRender(const RenderContext& context, const JobSpec& job, const FrameSink& sink)
      : context_(context),
        job_(job),
        num_tiles_(TileGrid(job.image).count()),
        num_runs_(num_runs(job)),
        chains_(static_cast<std::size_t>(num_tiles_)),
        frames_(job, sink) {}

  void work(std::stop_token stop) {
    while (const std::optional<TileRun> run = next()) {
      std::optional<SampleState> state = std::exchange(chain(*run).state, std::nullopt);
      const Result<RenderStats> stats = render(*run, state, stop);
      finish(*run, stats, std::move(state));
    }
  }

  Result<RenderStats> result() const {
    if (error_) return *error_;
    return total_;
  }

 private:
  /// One tile through time; touched by one thread at a time, in the order of `runs_done`.
  struct Chain {
    std::int32_t runs_done = 0;
    std::optional<SampleState> state;
  };

  Chain& chain(const TileRun& run) { return chains_[static_cast<std::size_t>(run.tile)]; }

  /// The next run in order, once the tile's previous one is done. Whoever has that one is at work,
  /// so nobody waits for ever.
  std::optional<TileRun> next() {
    std::unique_lock lock(mutex_);
    if (error_ || next_ >= std::int64_t{num_runs_} * num_tiles_) return std::nullopt;
    const auto run = static_cast<std::int32_t>(next_ / num_tiles_);
    const auto tile = static_cast<std::int32_t>(next_ % num_tiles_);
    ++next_;
    changed_.wait(
        lock, [&] { return error_ || chains_[static_cast<std::size_t>(tile)].runs_done == run; });
    if (error_) return std::nullopt;
    return tile_run(job_, tile, run);
  }

  /// Renders a run; `state` is the previous one and becomes the next.
  Result<RenderStats> render(const TileRun& run, std::optional<SampleState>& state,
                             std::stop_token stop) {
    const std::optional<SampleState> previous = std::exchange(state, std::nullopt);
    const TileRunSink sink{
        .film = [&](int frame_index,
                    const FilmTile& film) { return frames_.add(frame_index, film); },
        .state =
            [&](const SampleState& next_state) {
              state = next_state;
              return Status();
            }};
    return run_tile(context_, run, previous, sink, stop);
  }

  void finish(const TileRun& run, const Result<RenderStats>& stats,
              std::optional<SampleState> state) {
    {
      const std::lock_guard lock(mutex_);
      chain(run).state = std::move(state);
      ++chain(run).runs_done;
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
