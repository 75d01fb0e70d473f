#include "common/job/plan/estimate.h"

#include <algorithm>

#include "common/base/limits.h"
#include "common/job/aov.h"
#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "common/state/sample_planes.h"

namespace baton {
namespace {

/// Tiles within reach of each tile, all tiles together.
std::int64_t count_neighbours(const JobSpec& job, std::int32_t reach_px) {
  const TileGrid grid(job.image);
  std::int64_t count = 0;
  for (std::int32_t tile = 0; tile < grid.count(); ++tile)
    count += static_cast<std::int64_t>(grid.tiles_near(tile, reach_px).size());
  return count;
}

std::int64_t state_bytes_per_pixel(const JobSpec& job) {
  const std::size_t samples =
      sample_format().most_stored_bytes(num_carried_particles(job.sampling), num_populations(job));
  return static_cast<std::int64_t>(samples) + traits(job.sampling.method).most_bytes_beside_samples;
}

}  // namespace

std::int32_t max_frames_ahead(const JobSpec& job) {
  const std::int64_t film_bytes = std::max<std::int64_t>(estimate_job(job).film_bytes, 1);
  const std::uint64_t frames = limits::kMaxFilmBytesAhead / static_cast<std::uint64_t>(film_bytes);
  const auto all = static_cast<std::uint64_t>(job.frames.size());
  return std::max(2 * frames_per_run(job), static_cast<std::int32_t>(std::min(frames, all)));
}

JobEstimate estimate_job(const JobSpec& job) {
  JobEstimate e;
  const PixelRect image = job.image.rendered();
  const std::int64_t pixels = image.area();

  // Count tasks and what each waits for: a run for those before it, a frame for its tiles.
  e.frames = static_cast<std::int64_t>(job.frames.size());
  e.tiles = TileGrid(job.image).count();
  e.runs = num_runs(job);
  e.render_tasks = e.tiles * e.runs;
  e.assemble_tasks = e.frames;
  e.second_pass_tasks = job.visibility.correlated ? e.frames * e.tiles : 0;
  e.dependencies = e.frames * e.tiles;
  if (carries_state(job))
    e.dependencies += count_neighbours(job, history_reach_px(job)) * (e.runs - 1);
  if (job.visibility.correlated)
    e.dependencies += count_neighbours(job, exchange_reach_px(job.visibility)) * e.frames;
  e.dependencies += e.render_tasks / job.quality.sweeps * (job.quality.sweeps - 1);

  // Count rays, of all rounds. Those that are not seen have the sites of the first.
  e.rounds = std::int64_t{job.quality.rounds} * job.quality.sweeps;
  e.preroll_rounds = num_preroll_rounds(job);
  e.primary_rays_per_pixel =
      job.image.most_sites() * (rounds_have_own_sites(job) ? e.rounds : job.quality.sweeps);
  if (has_fine_sites(job)) e.primary_rays_per_pixel += limits::kGeometryProbes;
  e.shadow_rays_per_pixel = traits(job.sampling.method).most_rays(job.sampling) * e.rounds;
  if (job.light.bounces > 0) {
    // Paths, each with its shadow rays; those that are shared with some more, and to all members.
    constexpr int kOfPath = limits::kBouncePaths * (1 + limits::kBounceRays);
    constexpr int kShared =
        limits::kSharedBouncePaths *
        (limits::kBounceMembers - 1 + limits::kSharedBounceRays - limits::kBounceRays);
    e.shadow_rays_per_pixel += e.rounds * (job.light.bounces * kOfPath + kShared);
  }
  if (draws_twice(job)) e.shadow_rays_per_pixel *= 2;

  // Add up the planes: R, G, B, A and the AOVs.
  std::int64_t wide_channels = 0, frame_channels = 4;
  for (const Aov aov : job.output.aovs) {
    const auto count = static_cast<std::int64_t>(traits(aov).channels.size());
    frame_channels += count;
    wide_channels += traits(aov).is_float ? count : 0;
  }
  // Films have S / U and its share, frames the quotient, if it is not in A.
  e.film_channels = frame_channels + (tells_noise(job) ? 1 : 0) + (has_catcher(job) ? 4 : 0) +
                    (hides_indirect(job) ? 3 : 0);
  if (has_catcher(job) && job.output.shadows == ShadowForm::channels) frame_channels += 3;
  e.film_bytes = pixels * e.film_channels * 4;
  const std::int64_t sample_bytes = job.output.pixel_type == PixelType::half_float ? 2 : 4;
  e.frame_bytes = pixels * ((frame_channels - wide_channels) * sample_bytes + wide_channels * 4);

  // Size the state and the largest blob.
  const std::int64_t side = TileGrid(job.image).tile_size();
  const std::int64_t tile_pixels =
      std::min<std::int64_t>(side, image.width()) * std::min<std::int64_t>(side, image.height());
  e.largest_blob_bytes = tile_pixels * e.film_channels * 4;
  if (carries_state(job)) {
    // What is stored of a pixel's particles is hardly smaller; its memory is, by half and more.
    e.state_bytes_per_pixel = state_bytes_per_pixel(job);
    // Pixels of catchers have a memory of their own.
    e.state_bytes_per_block =
        traits(job.sampling.method).most_block_bytes * std::int64_t{has_catcher(job) ? 2 : 1};
    const auto bytes = [&](std::int64_t num_pixels, std::int64_t num_blocks) {
      return num_pixels * e.state_bytes_per_pixel + num_blocks * e.state_bytes_per_block;
    };
    e.state_bytes = bytes(pixels, static_cast<std::int64_t>(PixelBlocks(image).count()));
    // So many pixels in a row touch at most so many blocks.
    const auto most_blocks = [&](std::int64_t length) {
      return (std::min(side, length) + 2 * PixelBlocks::kSide - 2) / PixelBlocks::kSide;
    };
    e.tile_state_bytes =
        bytes(tile_pixels, most_blocks(image.width()) * most_blocks(image.height()));
    e.largest_blob_bytes = std::max(e.largest_blob_bytes, e.tile_state_bytes);
  }
  return e;
}

}  // namespace baton
