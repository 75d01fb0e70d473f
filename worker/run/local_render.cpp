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
#include "worker/exchange/second_pass.h"
#include "worker/run/frame_output.h"

namespace baton {
namespace {

/// Collects tiles until their frame is whole, then hands it to the sink.
class FrameCollector {
 public:
  FrameCollector(const RenderContext& context, const JobSpec& job, const FrameSink& sink)
      : context_(context), job_(job), grid_(job.image), sink_(sink) {}

  /// samples: null without a second pass.
  Result<RenderStats> add(std::int32_t frame_index, std::int32_t tile, FilmTile film,
                          FirstPassPtr samples) {
    std::unique_lock lock(mutex_);
    Frame& frame = frames_[frame_index];
    frame.films.resize(static_cast<std::size_t>(grid_.count()));
    frame.samples.resize(frame.films.size());
    frame.films[static_cast<std::size_t>(tile)] = std::move(film);
    frame.samples[static_cast<std::size_t>(tile)] = std::move(samples);
    if (++frame.num_tiles < grid_.count()) return RenderStats{};

    // Whole: out of the map, so that the rest may take its time without the lock.
    const Frame whole = std::move(frame);
    frames_.erase(frame_index);
    lock.unlock();
    return finish(frame_index, whole);
  }

 private:
  struct Frame {
    std::vector<FilmTile> films;  ///< (tiles)
    std::vector<FirstPassPtr> samples;
    std::int32_t num_tiles = 0;
  };

  Result<RenderStats> finish(std::int32_t frame_index, const Frame& frame) const {
    RenderStats stats;
    FilmTile image = blank_image(job_.image, frame.films.front().channels);
    for (std::int32_t tile = 0; tile < grid_.count(); ++tile) {
      const FilmTile& film = frame.films[static_cast<std::size_t>(tile)];
      if (!job_.visibility.correlated) {
        BATON_TRY(paste_tile(film, image));
        continue;
      }
      std::vector<FirstPassPtr> near;
      for (const std::int32_t t : grid_.tiles_near(tile, exchange_reach_px(job_.visibility)))
        near.push_back(frame.samples[static_cast<std::size_t>(t)]);
      BATON_ASSIGN(const SecondPassOutput second,
                   run_second_pass(context_, frame_index, tile, film, near));
      stats.merge(second.stats);
      BATON_TRY(paste_tile(second.film, image));
    }
    image.rect = image.rect.relative_to(job_.image.shown());
    BATON_TRY(sink_(frame_index, image));
    return stats;
  }

  const RenderContext& context_;
  const JobSpec& job_;
  const TileGrid grid_;
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
        frames_(context, job, sink) {}

  void work(const std::stop_token& stop) {
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
  /// One tile through time. A state is kept until every tile that needs it has read it: no tile can
  /// be two runs ahead.
  struct Chain {
    std::int32_t runs_done = 0;
    std::array<StatePtr, 2> states;          ///< by run % 2
    std::map<std::int32_t, FilmTile> films;  ///< of a sweep that is not the last, by step
  };

  Chain& chain(std::int32_t tile) { return chains_[static_cast<std::size_t>(tile)]; }
  std::vector<std::int32_t> near(std::int32_t tile) const {
    return grid_.tiles_near(tile, reach_px_);
  }

  /// The next run in order, once all that it needs is done. That is in work on other threads, so no
  /// thread waits for ever.
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
  Result<RenderStats> render(const TileRun& run, StatePtr& state, const std::stop_token& stop) {
    std::vector<StatePtr> previous;
    if (run.run > 0 && carries_state(job_)) {
      const std::lock_guard lock(mutex_);
      for (const std::int32_t t : near(run.tile))
        previous.push_back(chain(t).states[(run.run + 1) % 2]);
    }
    RenderStats second;
    FilmTile first_film;
    const auto add = [&](std::int32_t frame, FilmTile film, FirstPassPtr samples) -> Status {
      BATON_ASSIGN(const RenderStats stats,
                   frames_.add(frame, run.tile, std::move(film), std::move(samples)));
      second.merge(stats);
      return {};
    };
    // Only who renders the tile touches its films.
    std::map<std::int32_t, FilmTile>& films = chain(run.tile).films;
    const std::int32_t last_sweep = num_steps(job_) - static_cast<std::int32_t>(job_.frames.size());
    const TileRunSink sink{.film = [&](std::int32_t step, const FilmTile& film) -> Status {
                             if (step < last_sweep) {
                               films.emplace(step, film);
                               return {};
                             }
                             const std::int32_t frame = step - last_sweep;
                             if (!job_.visibility.correlated) return add(frame, film, nullptr);
                             first_film = film;
                             return {};
                           },
                           .state =
                               [&](const SampleState& next_state) {
                                 state = std::make_shared<const SampleState>(next_state);
                                 return Status();
                               },
                           .samples =
                               [&](FirstPassSamples samples) {
                                 const std::int32_t frame = samples.frame_index;
                                 return add(
                                     frame, std::move(first_film),
                                     std::make_shared<const FirstPassSamples>(std::move(samples)));
                               },
                           .earlier_film = [&](std::int32_t step) -> Result<FilmTile> {
                             return std::move(films.extract(step).mapped());
                           }};
    BATON_ASSIGN(RenderStats stats, run_tile(context_, run, previous, sink, stop));
    stats.merge(second);
    return stats;
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
                                   int num_threads, const FrameSink& sink,
                                   const std::stop_token& stop) {
  LocalRender render(context, job, sink);
  std::vector<std::thread> threads;
  for (int i = 0; i < num_threads; ++i) threads.emplace_back([&] { render.work(stop); });
  for (std::thread& thread : threads) thread.join();
  return render.result();
}

}  // namespace baton
