#pragma once

#include <algorithm>
#include <mutex>

#include "tests/support/small_scene.h"
#include "worker/exchange/second_pass.h"

namespace baton::test {

/// Both passes of the last frame of a job without carried states, tile by tile, put together.
struct CorrelatedResult {
  FilmTile film;
  RenderStats stats;
};
inline CorrelatedResult render_correlated(const RenderContext& context) {
  const JobSpec& job = context.job;
  const TileGrid grid(job.image);
  const Step last_step(static_cast<std::int32_t>(job.frames.size()) - 1);
  CorrelatedResult result;

  // First pass: films and samples of all tiles; samples go through their file form.
  std::vector<FilmTile> films;
  std::vector<FirstPassPtr> samples;
  for (std::int32_t tile = 0; tile < grid.count(); ++tile) {
    FirstPassPtr last;
    const TileRunSink sink{
        .film =
            [&](Step step, const FilmTile& film) {
              if (step == last_step) films.push_back(film);
              return Status();
            },
        .state = [](const SampleState&) { return Status(); },
        .samples =
            [&](const FirstPassSamples& s) {
              last = std::make_shared<const FirstPassSamples>(
                  *decode_first_pass_samples(encode_first_pass_samples(s), "test"));
              return Status();
            }};
    const auto stats = run_tile(context, {tile, {}, {Step(0), last_step}}, {}, sink, {});
    EXPECT_TRUE(stats) << stats.error().message;
    result.stats.merge(*stats);
    samples.push_back(last);
  }

  // Second pass.
  for (std::int32_t tile = 0; tile < grid.count(); ++tile) {
    std::vector<FirstPassPtr> near;
    for (const std::int32_t t : grid.tiles_near(tile, exchange_reach_px(job.visibility)))
      near.push_back(samples[static_cast<std::size_t>(t)]);
    const auto second =
        run_second_pass(context, last_step, tile, films[static_cast<std::size_t>(tile)], near);
    EXPECT_TRUE(second) << second.error().message;
    result.stats.merge(second->stats);
    const FilmTile& film = second->film;
    if (tile == 0) {
      result.film = {{0, 0, job.image.width, job.image.height}, film.channels, {}};
      result.film.values.resize(film.channels.size() * result.film.num_pixels());
    }
    for (std::size_t c = 0; c < film.channels.size(); ++c) {
      for (std::int32_t y = film.rect.y0; y < film.rect.y1; ++y) {
        const auto width = static_cast<std::size_t>(film.rect.width());
        std::copy_n(film.plane(c) + static_cast<std::size_t>(y - film.rect.y0) * width, width,
                    result.film.plane(c) + y * job.image.width + film.rect.x0);
      }
    }
  }
  return result;
}

/// box_job with a second pass.
inline JobSpec correlated_job(Method method = Method::bidirectional) {
  JobSpec job = box_job();
  job.sampling.method = method;
  job.visibility.correlated = true;
  job.output.aovs.push_back(Aov::mask);
  return job;
}

inline CorrelatedResult render_correlated(const JobSpec& job) {
  const auto context = load_render_context(job, Digest{1, 2});
  EXPECT_TRUE(context) << context.error().message;
  return render_correlated(**context);
}

}  // namespace baton::test
