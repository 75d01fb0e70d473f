#include "common/job/plan/store_estimate.h"

#include <algorithm>
#include <vector>

#include "common/job/aov.h"
#include "common/job/motion.h"
#include "common/job/plan/estimate.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

// Measured sizes, in bytes a pixel that sees a surface: docs/lab/store.md has the table.
/// One of R, G, B; also in a sky.
constexpr double kColorBytes = 3.2;
/// The errors of a few pixels, where a single round tells them.
constexpr double kErrorBytes = 0.1;
/// What a pixel takes in a state of `pool` in the end, with its share of its block's memory, when
/// all bins that rays reach are known; and the number of shadow rays of a pixel after which it
/// takes half of that.
constexpr double kMemoryBytes = 33, kHalfMemoryRays = 13;
/// A sample of the first pass, and how many of a pixel's are stored: those of pixels near a
/// shadow's border.
constexpr double kSampleBytes = 10, kSampleShare = 0.27;
/// Tasks in a worker's hands beside those of the run that everybody waits for.
constexpr double kTasksAhead = 3;

/// Whether a pixel's samples weigh the same: those that are carried do while the light stands
/// still.
bool weigh_alike(const JobSpec& job) {
  if (traits(job.sampling.method).carried != Carried::samples)
    return traits(job.sampling.method).equal_weights;
  const std::vector<FrameSpec> frames = expand_sequence(job);
  return traits(job.sampling.start_method).equal_weights &&
         std::all_of(frames.begin(), frames.end(), [&](const FrameSpec& frame) {
           return frame.environment == frames.front().environment;
         });
}

double film_bytes(Aov aov, bool equal_weights) {
  if (equal_weights && aov == Aov::visibility) return 0.75;
  if (equal_weights && aov == Aov::ess) return 0.1;
  return traits(aov).film_bytes;
}

/// Bytes of a pixel in a packed film, on average.
double film_bytes_per_pixel(const JobSpec& job, double surface_share) {
  const bool has_sky = job.output.background == Background::environment;
  double bytes = 3 * kColorBytes * (has_sky ? 1 : surface_share);
  const bool equal_weights = weigh_alike(job);
  for (const Aov aov : job.output.aovs) {
    if (why_empty(aov, job).empty()) bytes += surface_share * film_bytes(aov, equal_weights);
  }
  if (has_catcher(job)) bytes += 3 * kColorBytes * surface_share;
  if (hides_indirect(job)) bytes += traits(Aov::indirect).film_bytes * surface_share;
  if (!tells_noise(job)) return bytes;
  const bool of_all = std::int64_t{job.quality.rounds} * job.quality.sweeps > 1;
  return bytes + (of_all ? kColorBytes * surface_share : kErrorBytes);
}

/// Bytes of a pixel in a packed state after steps [0, end), on average.
double state_bytes_per_pixel(const JobSpec& job, std::int64_t end, double surface_share) {
  const JobEstimate e = estimate_job(job);
  const auto whole =
      static_cast<double>(e.state_bytes) / static_cast<double>(job.image.rendered().area());
  if (traits(job.sampling.method).carried != Carried::memory) {
    // Weights that are all alike pack to nothing.
    const double weights = weigh_alike(job) ? 4.0 * job.sampling.num_particles : 0;
    return surface_share * (whole - weights);
  }
  const auto rounds = kPrerollShare * static_cast<double>(e.preroll_rounds) +
                      static_cast<double>(end * job.quality.rounds);
  const double rays = rounds * job.sampling.num_particles;
  return surface_share * std::min(whole, kMemoryBytes * rays / (rays + kHalfMemoryRays));
}

/// The ends of the steps whose states are in the store together when it is fullest.
std::vector<std::int64_t> states_at_once(const JobSpec& job) {
  const std::int64_t frames = num_steps(job);
  const std::int64_t every = job.state.checkpoint_every;
  std::vector<std::int64_t> ends;
  if (job.state.keep == StateKeep::all) {
    const std::int64_t step = frames_per_run(job);
    for (std::int64_t end = step; end < frames; end += step) ends.push_back(end);
    ends.push_back(frames);
    return ends;
  }
  // Two checkpoints stay. In motion the third is there before one may go, since all tiles share
  // them; at rest each tile lets its own go, and at its last both.
  const bool shares = shares_history(job);
  const std::int64_t last = (frames - 1) / every * every;
  if (shares || last == 0) ends.push_back(frames);
  for (std::int64_t end = last; end > 0 && ends.size() < (shares ? 3 : 2); end -= every)
    ends.push_back(end);
  return ends;
}

}  // namespace

std::int64_t num_state_sets(const JobSpec& job) {
  return carries_state(job) ? static_cast<std::int64_t>(states_at_once(job).size()) : 0;
}

std::int64_t num_films_that_stay(const JobSpec& job) {
  const bool stay = job.quality.sweeps > 1 || job.quality.refinable;
  return stay ? static_cast<std::int64_t>(job.frames.size()) : 0;
}

StoreEstimate estimate_store(const JobSpec& job, double surface_share) {
  StoreEstimate store;
  const JobEstimate e = estimate_job(job);
  const auto pixels = static_cast<double>(job.image.rendered().area());
  const auto frames = static_cast<double>(e.frames);
  if (carries_state(job)) {
    double bytes = 0;
    for (const std::int64_t end : states_at_once(job))
      bytes += state_bytes_per_pixel(job, end, surface_share);
    store.states = static_cast<std::int64_t>(pixels * bytes);
  }

  // All tiles of a run are rendered before its first frame is written, and some of the next one.
  const double tiles_ahead = std::min(1.0, kTasksAhead / static_cast<double>(e.tiles));
  // A second pass takes samples away while the run is still rendered.
  const bool second = job.visibility.correlated;
  const double run = frames_per_run(job);
  const double ahead = std::max(std::min(frames, run * (1 + tiles_ahead / (second ? 2 : 1))),
                                static_cast<double>(num_films_that_stay(job)));
  store.films =
      static_cast<std::int64_t>(pixels * ahead * film_bytes_per_pixel(job, surface_share));
  if (second) {
    const double samples = surface_share * kSampleShare * job.sampling.num_particles;
    store.samples =
        static_cast<std::int64_t>(pixels * std::min(frames, run) * (2 + samples * kSampleBytes));
  }
  return store;
}

StoreEstimate bound_store(const JobSpec& job) {
  const JobEstimate e = estimate_job(job);
  // Frames that are rendered ahead, with two runs in work at most: their films, and the states that
  // their tasks have read and made.
  constexpr std::int64_t kStatesInWork = 2;
  const std::int64_t ahead = std::min<std::int64_t>(max_frames_ahead(job) + 1, e.frames);
  // In motion, what workers read of each other stays until the next checkpoint.
  const std::int64_t between =
      shares_history(job) && job.state.keep == StateKeep::last ? job.state.checkpoint_every - 1 : 0;
  const std::int64_t kept = carries_state(job) ? num_state_sets(job) + between : 0;
  StoreEstimate store;
  store.states = e.state_bytes * std::min(kept + kStatesInWork, e.runs);
  store.films = e.film_bytes * (ahead + num_films_that_stay(job));
  if (job.visibility.correlated) {
    store.films *= 2;  // each pass has its films
    const std::int64_t per_pixel = 2 + 8 + 10 * std::int64_t{job.sampling.num_particles};
    store.samples = job.image.rendered().area() * per_pixel * ahead;
  }
  return store;
}

std::int64_t estimate_blob_bytes(const JobSpec& job, BlobKind kind) {
  const std::int64_t side = TileGrid(job.image).tile_size();
  const PixelRect image = job.image.rendered();
  const auto pixels = static_cast<double>(std::min<std::int64_t>(side, image.width()) *
                                          std::min<std::int64_t>(side, image.height()));
  switch (kind) {
    case BlobKind::state:
      return !carries_state(job) ? 0
                                 : static_cast<std::int64_t>(
                                       pixels * state_bytes_per_pixel(job, num_steps(job), 1));
    case BlobKind::film:
      return static_cast<std::int64_t>(pixels * film_bytes_per_pixel(job, 1));
    case BlobKind::first_pass:
      return static_cast<std::int64_t>(
          pixels * (2 + kSampleShare * kSampleBytes * job.sampling.num_particles));
    case BlobKind::image:
      break;
  }
  return 0;
}

}  // namespace baton
