#include "worker/pass/tile_renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/state/sample_planes.h"
#include "tests/support/render_tiled.h"

namespace baton {
namespace {

using test::box_job;
using test::channel;
using test::frame_numbers;
using test::mean_rgb;
using test::render_tile;
using test::render_tiled;
using test::sequence_job;
using testing::HasSubstr;

TEST(RunTile, SameBytesForAnyTilingAndAnyRunLength) {
  const JobSpec job = sequence_job(5);
  const std::vector<FilmTile> whole = render_tiled(job, 4096, 5);
  EXPECT_EQ(render_tiled(job, 8, 5), whole);
  EXPECT_EQ(render_tiled(job, 5, 2), whole);
  EXPECT_EQ(render_tiled(job, 4096, 1), whole);
}

/// Box and ground with settings of their own, and the largest M for a material that no pixel sees:
/// the presampled light is laid out for that.
JobSpec job_by_material() {
  JobSpec job = sequence_job(2);
  job.sampling.method = Method::mis;
  job.sampling.num_particles = 8;
  job.sampling.by_material = {
      {"glossy", {.method = Method::bidirectional, .num_particles = 12, .num_candidates = 64}},
      {"ground", {.method = Method::environment, .num_particles = 4}},
      {"unseen", {.method = Method::bidirectional, .num_candidates = 100}}};
  job.scene.materials["unseen"] = {};
  job.output.aovs = {Aov::lns, Aov::ess, Aov::material};
  return job;
}

TEST(RunTile, SameBytesForAnyTilingByMaterial) {
  const JobSpec job = job_by_material();
  const std::vector<FilmTile> whole = render_tiled(job, 4096, 5);
  EXPECT_EQ(render_tiled(job, 5, 1), whole);
}

// A pixel has the bytes that it has where its material's setting is that of the whole picture and
// the presampled light is laid out alike.
TEST(RunTile, EachMaterialIsSampledByItsOwnSetting) {
  const JobSpec job = job_by_material();
  const FilmTile mixed = render_tiled(job, 4096, 5).back();
  std::map<float, FilmTile> alike;  // by number of the material
  float number = 0;
  for (const auto& [name, material] : job.scene.materials) {
    number += 1;
    JobSpec whole = job;
    std::erase_if(whole.sampling.by_material,
                  [](const auto& own) { return own.first != "unseen"; });
    if (const auto own = job.sampling.by_material.find(name);
        own != job.sampling.by_material.end()) {
      whole.sampling.method =
          own->second.method == Method::environment ? Method::environment : Method::bidirectional;
      whole.sampling.num_particles = own->second.num_particles;
      whole.sampling.num_candidates = own->second.num_candidates;
    }
    alike[number] = render_tiled(whole, 4096, 5).back();
  }
  const float* const materials = mixed.find("material");
  ASSERT_NE(materials, nullptr);
  std::map<float, int> pixels;
  for (std::size_t i = 0; i < mixed.num_pixels(); ++i) {
    const float material = materials[i];
    pixels[material] += 1;
    if (material == 0) continue;
    for (std::size_t c = 0; c < mixed.channels.size(); ++c)
      EXPECT_EQ(mixed.plane(c)[i], alike.at(material).plane(c)[i]) << mixed.channels[c] << " " << i;
  }
  EXPECT_GE(pixels.size(), 3u) << "background and two materials are seen";
}

TEST(RunTile, SameBytesForAnyTilingWhileCameraAndObjectsMove) {
  for (const auto& [method, sites] : {std::pair{Method::sequential, 1},
                                      {Method::sequential, 4},
                                      {Method::pool, 1},
                                      {Method::pool, 4},
                                      {Method::restir, 1},
                                      {Method::restir, 4}}) {
    JobSpec job = sequence_job(4);
    job.image.sites = sites;
    job.sampling.method = method;
    test::set_in_motion(job, /*camera=*/true, /*object=*/true);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 5);
    EXPECT_EQ(render_tiled(job, 8, 2), whole);
    EXPECT_EQ(render_tiled(job, 3, 1), whole);
    EXPECT_EQ(render_tiled(job, 8, 1, test::keeping_nothing()), whole) << "nothing is kept";
  }
}

TEST(RunTile, AMotionThatGoesNowhereIsNoMotion) {
  JobSpec still = sequence_job(4);
  JobSpec job = still;
  job.camera.keys = {
      {.frame = 1, .position = still.camera.position, .look_at = still.camera.look_at}};
  job.motion.max_px = 2;
  EXPECT_EQ(render_tiled(job, 8, 5), render_tiled(still, 8, 5));
}

TEST(RunTile, MostPixelsAreCarriedThroughMotion) {
  JobSpec job = sequence_job(5);
  job.image.width = 48;
  job.image.height = 36;
  job.sampling.refresh_every = 0;
  test::set_in_motion(job, true, true);
  const RenderStats stats = render_tile(job).stats;
  const auto surface = static_cast<double>(stats.pixels - stats.pixels_background) * 4 / 5;
  EXPECT_GT(static_cast<double>(stats.sampling.pixels_carried) / surface, 0.9);
  EXPECT_GT(stats.sampling.pixels_fresh, stats.pixels / 8) << "what comes into view starts afresh";
}

TEST(RunTile, SameBytesForAnyTilingAndAnyRunLengthWithThePool) {
  JobSpec job = sequence_job(5);
  job.sampling.method = Method::pool;
  job.sampling.num_candidates = 32;
  const std::vector<FilmTile> whole = render_tiled(job, 4096, 5);
  EXPECT_EQ(render_tiled(job, 8, 5), whole);
  EXPECT_EQ(render_tiled(job, 5, 2), whole);
  EXPECT_EQ(render_tiled(job, 4096, 1), whole);
  job.state.carry = false;
  const std::vector<FilmTile> forgetful = render_tiled(job, 4096, 5);
  EXPECT_EQ(render_tiled(job, 4096, 1), forgetful);
  EXPECT_NE(forgetful, whole);
}

TEST(RunTile, ThePoolTakesMoreCandidatesWhereItWasNoisy) {
  JobSpec job = sequence_job(4);
  job.sampling.method = Method::pool;
  job.sampling.num_candidates = 64;
  const auto per_pixel = [&] {
    const RenderStats stats = render_tile(job).stats;
    return static_cast<double>(stats.target_evaluations) /
           static_cast<double>(stats.pixels - stats.pixels_background);
  };
  EXPECT_GT(per_pixel(), 80);
  job.state.carry = false;
  EXPECT_EQ(per_pixel(), 64) << "noise of this frame must not count";
}

TEST(RunTile, JobsThatShareASiteSeedSeeTheSamePoints) {
  JobSpec job = sequence_job(1);
  job.image.sites = 4;
  job.output.aovs = {Aov::depth};
  const auto depths = [&](std::uint64_t seed, std::uint64_t site_seed) {
    job.seed = seed;
    job.image.site_seed = site_seed;
    const FilmTile film = render_tile(job).films.back();
    const auto values = channel(film, "depth");
    return std::vector<float>(values.begin(), values.end());
  };
  EXPECT_EQ(depths(1, 9), depths(2, 9));
  EXPECT_NE(depths(1, 0), depths(2, 0));
  EXPECT_EQ(depths(9, 0), depths(2, 9)) << "else it is the job's seed";
}

// The second draw that tells the variance, and what is said of the light that is blocked, enter
// nothing else.
TEST(RunTile, AovsOfLightChangeNoPicture) {
  for (const Method method : {Method::pool, Method::ratio, Method::bidirectional,
                              Method::sequential, Method::reference}) {
    JobSpec job = sequence_job(3);
    job.image.sites = 4;
    job.sampling.method = method;
    job.sampling.num_candidates = 64;
    job.sampling.reference_samples = 8;
    job.output.aovs.clear();
    const test::TileResult plain = render_tile(job);
    job.output.aovs = {Aov::depth, Aov::variance, Aov::unshadowed, Aov::blocked};
    const test::TileResult with = render_tile(job);
    EXPECT_EQ(with.state.planes, plain.state.planes);
    for (const char* const name : {"R", "G", "B", "A"}) {
      const auto a = channel(plain.films.back(), name), b = channel(with.films.back(), name);
      EXPECT_TRUE(std::ranges::equal(a, b)) << static_cast<int>(method) << " " << name;
    }
    // RGB + blocked = unshadowed; nothing is blocked where the sky is seen.
    const std::vector<double> shown = mean_rgb(with.films.back()),
                              blocked = mean_rgb(with.films.back(), "blocked"),
                              unshadowed = mean_rgb(with.films.back(), "unshadowed");
    const auto depth = channel(with.films.back(), "depth");
    double most = 0;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      EXPECT_NEAR(shown[i] + blocked[i], unshadowed[i], 1e-5 * (1 + unshadowed[i]));
      if (depth[i] == 0) {
        EXPECT_EQ(blocked[i], 0);
      }
      most = std::max(most, blocked[i]);
    }
    EXPECT_GT(most, 0.05) << static_cast<int>(method);
  }
}

TEST(RunTile, CarriesEverySurfacePixelOn) {
  JobSpec published = sequence_job(3);
  published.sampling.refresh_every = 0;
  const test::TileResult carried = render_tile(published);
  const std::uint64_t surface = (carried.stats.pixels - carried.stats.pixels_background) / 3;
  EXPECT_GT(surface, 50u);
  EXPECT_EQ(carried.stats.sampling.pixels_fresh, surface);
  EXPECT_EQ(carried.stats.sampling.pixels_carried, 2 * surface);

  JobSpec fresh = sequence_job(3);
  fresh.state.carry = false;
  const test::TileResult restarted = render_tile(fresh);
  EXPECT_EQ(restarted.stats.sampling.pixels_fresh, 3 * surface);
  EXPECT_EQ(restarted.stats.sampling.pixels_carried, 0u);
  for (const float red : channel(restarted.films[1], "source.R")) EXPECT_TRUE(red == 0 || red == 1);
}

TEST(RunTile, RefreshesEveryPixelOnceInTheCycleButNotInTheSecondFrame) {
  JobSpec job = sequence_job(2);
  job.sampling.refresh_every = 4;
  EXPECT_EQ(render_tile(job).stats.sampling.pixels_refreshed, 0u);
  job.frames = frame_numbers(5);
  const RenderStats stats = render_tile(job).stats;
  EXPECT_EQ(stats.sampling.pixels_refreshed, stats.sampling.pixels_fresh);
}

TEST(RunTile, RefreshesByRatioAndCountsIt) {
  JobSpec job = sequence_job(4);
  job.sampling.refresh_every = 0;
  job.sampling.refresh_ratio = 1.05f;
  const test::TileResult result = render_tile(job);
  const SamplingStats& did = result.stats.sampling;
  EXPECT_GT(did.pixels_refreshed_by_ratio, 0u);
  EXPECT_EQ(did.pixels_refreshed_by_ratio, did.pixels_refreshed);
  EXPECT_GT(did.pixels_carried, 0u);

  // No pixel may have left the band around its last start.
  const SampleState& state = result.state;
  const ConstSamplePlanes samples(state);
  for (std::size_t i = 0; i < state.num_pixels(); ++i) {
    if (state.source[i] != PixelSource::carried) continue;
    EXPECT_LE(samples.lns[i], 1.0501f * samples.lns_fresh[i]) << i;
    EXPECT_GE(1.0501f * samples.lns[i], samples.lns_fresh[i]) << i;
  }
}

TEST(RunTile, CountsEverySurfacePixelOnceInEachFrame) {
  JobSpec job = sequence_job(3);
  const auto context = load_render_context(job, Digest{1, 2});
  ASSERT_TRUE(context.ok());
  std::vector<FrameStats> rows;
  const TileRunSink sink{.film = [](Step, const FilmTile&) { return Status(); },
                         .state = [](const SampleState&) { return Status(); },
                         .diagnostics = [&](const FrameStats& stats) { rows.push_back(stats); }};
  const auto stats = run_tile(**context, tile_run(job, 0, baton::Run(0)), {}, sink, {});
  ASSERT_TRUE(stats.ok());
  SamplingStats sum;
  for (const FrameStats& row : rows) {
    std::uint64_t in_bins = 0;
    for (const std::uint64_t count : row.sampling.ess_histogram) in_bins += count;
    EXPECT_EQ(in_bins, row.sampling.pixels()) << row.position;
    EXPECT_EQ(row.sampling.pixels(), (stats->pixels - stats->pixels_background) / 3);
    sum.merge(row.sampling);
  }
  EXPECT_EQ(sum, stats->sampling);
}

TEST(RunTile, BlackMapGivesBlackAndLightComesBack) {
  JobSpec job = sequence_job(3);
  const std::string black = test::write_map("black.exr", test::constant_map(64, 32, {0, 0, 0}));
  job.environment.keys = {{1, black}, {3, job.environment.keys[0].map}};
  job.environment.interpolate = false;
  job.output.background = Background::transparent;
  const test::TileResult result = render_tile(job);
  for (const float v : channel(result.films[1], "G")) EXPECT_EQ(v, 0);
  float brightest = 0;
  for (const float v : channel(result.films[2], "G")) brightest = std::max(brightest, v);
  EXPECT_GT(brightest, 0.1f);
  EXPECT_GT(result.stats.sampling.pixels_restarted, 0u);
}

void expect_all_finite(const test::TileResult& result) {
  for (const FilmTile& film : result.films) {
    for (const float v : film.values) ASSERT_TRUE(std::isfinite(v));
  }
  for (const float v : ConstSamplePlanes(result.state).weight) ASSERT_TRUE(std::isfinite(v));
}

TEST(RunTile, DegenerateInputGivesNoNan) {
  RgbImage broken = test::sky_map();
  broken.rgb[0] = std::numeric_limits<float>::quiet_NaN();
  broken.rgb[100] = std::numeric_limits<float>::infinity();
  broken.rgb[1000] = -5;
  JobSpec job = sequence_job(3);
  job.environment.keys[0].map = test::write_map("broken.exr", broken);
  expect_all_finite(render_tile(job));

  // A sun that outshines all by 1e8 in one texel; and a camera inside a box; and one that grazes
  // the ground.
  RgbImage sun = test::constant_map(64, 32, {1e-3f, 1e-3f, 1e-3f});
  sun.rgb[3 * (8 * 64 + 20)] = 1e5f;
  job.environment.keys[0].map = test::write_map("sun.exr", sun);
  expect_all_finite(render_tile(job));
  job.camera.position = {-0.8f, 0.5f, 0};
  expect_all_finite(render_tile(job));
  job.camera.position = {0, 1e-4f, 4};
  job.camera.look_at = {0, 0, 0};
  expect_all_finite(render_tile(job));
}

TEST(RunTile, RefusesTheStateOfAnotherJobTileOrFrame) {
  const JobSpec job = sequence_job(4);
  const auto context = load_render_context(job, Digest{7, 7});
  ASSERT_TRUE(context.ok());
  SampleState state;
  state.resize(sample_format(), {0, 0, 12, 9}, 16);
  state.picture = {1, 2};
  const auto given = [](const SampleState& s) {
    return std::vector{std::make_shared<const SampleState>(s)};
  };
  const TileRunSink sink{[](Step, const FilmTile&) { return Status(); },
                         [](const SampleState&) { return Status(); }};
  const TileRun run{.tile = 0, .run = baton::Run(1), .steps = {Step(2), Step(3)}};
  EXPECT_THAT(run_tile(**context, run, given(state), sink, {}).error().message,
              HasSubstr("of picture"));
  state.picture = {7, 7};
  state.step = Step(0);
  EXPECT_THAT(run_tile(**context, run, given(state), sink, {}).error().message,
              HasSubstr("frame index 0"));
  EXPECT_FALSE(run_tile(**context, run, {}, sink, {}).ok());
}

TEST(RunTile, StopsWhenAsked) {
  const auto context = load_render_context(sequence_job(4), Digest{1, 2});
  std::stop_source stop;
  int frames = 0;
  const TileRunSink sink{[&](Step, const FilmTile&) {
                           ++frames;
                           stop.request_stop();
                           return Status();
                         },
                         [](const SampleState&) { return Status(); }};
  const auto stats =
      run_tile(**context, {0, baton::Run(0), {Step(0), Step(3)}}, {}, sink, stop.get_token());
  ASSERT_FALSE(stats.ok());
  EXPECT_EQ(stats.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(frames, 1);
}

TEST(LoadRenderContext, NamesAMissingMap) {
  JobSpec job = box_job();
  job.environment.keys[0].map = "/nowhere/sky.exr";
  const auto context = load_render_context(job, Digest{1, 2});
  ASSERT_TRUE(context.ok());
  const TileRunSink sink{[](Step, const FilmTile&) { return Status(); },
                         [](const SampleState&) { return Status(); }};
  const auto stats = run_tile(**context, {0, baton::Run(0), {}}, {}, sink, {});
  ASSERT_FALSE(stats.ok());
  EXPECT_THAT(stats.error().message, HasSubstr("/nowhere/sky.exr"));
}

}  // namespace
}  // namespace baton
