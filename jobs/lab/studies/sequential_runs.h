// What the programs study_* share: renderings of a job in one tile and thread,
// variants of its sampling, and the reference.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "common/job/text/job_json.h"
#include "common/math/philox.h"
#include "jobs/study/intervals.h"
#include "worker/pass/render_context.h"
#include "worker/pass/shared_assets.h"

namespace baton {

using SharedAssetsPtr = std::shared_ptr<const SharedAssets>;

/// A frame of one rendering.
struct FrameResult {
  FilmTile film;
  RenderStats stats;
  SamplingStats sampling;
  double seconds() const {
    return stats.seconds_sample + stats.seconds_visibility + stats.seconds_shade;
  }
  /// With primary rays and the search for the pixel's history.
  double seconds_with_primary() const { return seconds() + stats.seconds_primary; }
};

inline std::span<const float> plane(const FilmTile& film, std::string_view name) {
  BATON_CHECK(film.find(name) != nullptr);
  return {film.find(name), film.num_pixels()};
}

/// The value of(seeds), and its 95 % interval by resampling the seeds, for all that `of` reads
/// alike. of: takes 0-based seeds, as often as they were drawn.
template <class Of>
Interval over_seeds(std::size_t num_seeds, const Of& of) {
  constexpr std::uint32_t kResamples = 1000;
  std::vector<std::size_t> seeds(num_seeds);
  std::iota(seeds.begin(), seeds.end(), std::size_t{0});
  const double value = of(seeds);
  std::vector<double> resampled;
  for (std::uint32_t r = 0; r < kResamples; ++r) {
    for (std::uint32_t i = 0; i < num_seeds; ++i) {
      const std::uint32_t bits = Philox4x32::block({i, r, 0, 0}, 0)[0];
      seeds[i] = static_cast<std::size_t>((std::uint64_t{bits} * num_seeds) >> 32);
    }
    resampled.push_back(of(seeds));
  }
  std::sort(resampled.begin(), resampled.end());
  return {resampled[kResamples / 40], value, resampled[kResamples - 1 - kResamples / 40]};
}

/// Ends the program with what went wrong.
template <class T>
T value_of(Result<T> result) {
  if (result) return std::move(result).value();
  fmt::print(stderr, "{}\n", result.error().message);
  std::exit(65);
}

/// All frames of a job, frame by frame, in one tile with a transparent background. aovs: their
/// channels. change: of what renders, before it does.
inline std::vector<FrameResult> render(JobSpec job, const SharedAssetsPtr& assets,
                                       const std::vector<Aov>& aovs = {Aov::lns},
                                       const std::function<void(RenderContext&)>& change = {}) {
  job.image.tile_size = limits::kMaxTileSize;
  job.output.background = Background::transparent;
  job.output.aovs = aovs;
  const auto context = std::const_pointer_cast<RenderContext>(
      value_of(make_render_context(job, Digest{1, 1}, assets)));
  if (change) change(*context);
  std::vector<FrameResult> frames(job.frames.size());
  std::vector<std::shared_ptr<const SampleState>> states;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    std::vector<std::shared_ptr<const SampleState>> next;
    const TileRunSink sink{
        .film =
            [&](Step, const FilmTile& film) {
              frames[i].film = film;
              return Status();
            },
        .state =
            [&](const SampleState& s) {
              next.push_back(std::make_shared<const SampleState>(s));
              return Status();
            },
        .diagnostics = [&](const FrameStats& s) { frames[i].sampling = s.sampling; }};
    const Step step(static_cast<std::int32_t>(i));
    frames[i].stats = value_of(run_tile(*context, {0, {}, {step, step}}, states, sink, {}));
    states = std::move(next);
  }
  return frames;
}
/// Renders with assets of its own.
inline std::vector<FrameResult> render(const JobSpec& job) {
  return render(job, value_of(load_shared_assets(job)));
}

/// The job with only the frame at `index`.
inline JobSpec frame_of(JobSpec job, std::size_t index) {
  job.frames = {job.frames[index]};
  return job;
}

inline JobSpec with(JobSpec job, const std::function<void(SamplingSpec&)>& change) {
  job.sampling.num_particles = 16;
  job.sampling.num_candidates = 800;
  job.sampling.refresh_every = 0;
  job.sampling.refresh_ratio.reset();
  change(job.sampling);
  return job;
}

inline JobSpec carried(const JobSpec& job, int distributions, int moves, LnsUpdate update) {
  return with(job, [&](SamplingSpec& s) {
    s.method = Method::sequential;
    s.num_distributions = distributions;
    s.num_moves = moves;
    s.lns_update = update;
  });
}

inline JobSpec chosen(const JobSpec& job, int candidates) {
  return with(job, [&](SamplingSpec& s) {
    s.method = Method::bidirectional;
    s.num_candidates = candidates;
  });
}

/// Brute force of one frame.
inline FilmTile reference(const JobSpec& job, std::size_t index) {
  const JobSpec judge = with(frame_of(job, index), [](SamplingSpec& s) {
    s.method = Method::reference;
    s.reference_samples = 4096;
  });
  return render(judge).front().film;
}

/// Root mean square over pixels with a surface and channels.
inline double rmse(const FilmTile& a, const FilmTile& b) {
  double sum = 0;
  double count = 0;
  const std::span<const float> alpha = plane(b, "A");
  for (const char* channel : {"R", "G", "B"}) {
    const auto x = plane(a, channel);
    const auto y = plane(b, channel);
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!(alpha[i] > 0)) continue;
      sum += (double{x[i]} - y[i]) * (double{x[i]} - y[i]);
      count += 1;
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace baton
