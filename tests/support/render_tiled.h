#pragma once

#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "common/job/motion.h"
#include "tests/support/small_scene.h"
#include "worker/pass/shared_assets.h"

namespace baton::test {

/// box_job with four sites under a sky that turns.
inline JobSpec sequence_job(int frames) {
  JobSpec job = box_job();
  job.frames = frame_numbers(frames);
  job.environment.rotation_deg_per_frame = 0.5;
  job.image.sites = 4;
  return job;
}

/// Nothing is kept from one tile to the next.
inline MemoryBudget keeping_nothing() {
  MemoryBudget memory = MemoryBudget::of(0);
  memory.total_bytes = default_memory_bytes();
  return memory;
}

/// All films of a job cut into tiles of `tile_size` and runs of `run_length`, pasted together;
/// states go through their file form between runs.
inline std::vector<FilmTile> render_tiled(JobSpec job, int tile_size, int run_length,
                                          const MemoryBudget& memory = MemoryBudget::of_machine()) {
  job.image.tile_size = tile_size;
  job.state.checkpoint_every = run_length;
  const auto assets =
      load_shared_assets(job, memory, std::numeric_limits<std::uint64_t>::max(), FilesBeside::any)
          .value();
  const auto context = make_render_context(job, Digest{1, 2}, assets, memory);
  EXPECT_TRUE(context.ok());
  std::vector<FilmTile> images(job.frames.size());
  const TileGrid grid(job.image);
  std::vector<StatePtr> states(static_cast<std::size_t>(grid.count()));
  std::map<std::pair<Step, std::int32_t>, FilmTile> films;  // films of all sweeps
  const Timeline timeline(job);
  for (Run run; run < Run(timeline.num_runs()); ++run) {
    std::vector<StatePtr> next(states.size());
    for (std::int32_t tile = 0; tile < grid.count(); ++tile) {
      std::vector<StatePtr> previous;
      for (const std::int32_t near : grid.tiles_near(tile, history_reach_px(job))) {
        if (run > Run(0) && carries_state(job))
          previous.push_back(states[static_cast<std::size_t>(near)]);
      }
      const TileRunSink sink{
          [&](Step step, const FilmTile& film) {
            films[{step, tile}] = film;
            FilmTile& image = images[timeline.frame_of(step).index()];
            image.rect = {0, 0, job.image.width, job.image.height};
            image.channels = film.channels;
            image.values.resize(image.channels.size() * image.num_pixels());
            for (std::size_t c = 0; c < film.channels.size(); ++c) {
              for (int y = film.rect.y0; y < film.rect.y1; ++y) {
                const auto width = static_cast<std::size_t>(film.rect.width());
                const float* row =
                    film.plane(c) + static_cast<std::size_t>(y - film.rect.y0) * width;
                std::copy_n(row, width, image.plane(c) + y * job.image.width + film.rect.x0);
              }
            }
            return Status();
          },
          [&](const SampleState& s) {
            next[static_cast<std::size_t>(tile)] =
                std::make_shared<const SampleState>(*decode_state(encode_state(s), "test"));
            return Status();
          },
          {},
          {},
          [&](Step step) -> Result<FilmTile> {
            return films.at({step, tile});
          }};
      const auto done = run_tile(**context, tile_run(job, tile, run), previous, sink, {});
      EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().message);
    }
    states = std::move(next);
  }
  return images;
}

}  // namespace baton::test
