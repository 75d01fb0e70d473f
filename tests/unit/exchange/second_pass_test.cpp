#include "worker/exchange/second_pass.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/section_file.h"
#include "common/state/sample_planes.h"
#include "tests/support/second_pass.h"
#include "worker/pass/primary.h"

namespace baton {
namespace {

using test::channel;
using test::correlated_job;
using test::render_correlated;
using testing::HasSubstr;

TEST(SecondPass, SameBytesForAnyTiling) {
  for (const SecondPassForm form :
       {SecondPassForm::corrected, SecondPassForm::published, SecondPassForm::extra_samples}) {
    JobSpec job = correlated_job();
    job.image = {.width = 21, .height = 17, .sites = 4, .tile_size = 4096};
    job.visibility.form = form;
    job.visibility.dilate = form == SecondPassForm::corrected ? 2 : 0;
    const FilmTile whole = render_correlated(job).film;
    for (const int tile_size : {8, 11}) {
      job.image.tile_size = tile_size;
      EXPECT_EQ(render_correlated(job).film, whole) << tile_size;
    }
  }
}

// What a sample is worth at a surface must not depend on the surfaces that share its vector: which
// ones do depends on the tiling.
TEST(SecondPass, SameBytesForAnyTilingWhereMaterialsMeet) {
  for (const Method method : {Method::mis, Method::bidirectional}) {
    JobSpec job = correlated_job(method);
    job.image = {.width = 33, .height = 21, .sites = 4, .tile_size = 4096};
    job.sampling.num_particles = 20;
    job.visibility.mask = MaskPolicy::same_samples;
    job.visibility.dilate = 4;
    job.scene.materials["ground"].base_color = {0.37f, 0.53f, 0.71f};
    const FilmTile whole = render_correlated(job).film;
    for (const int tile_size : {8, 13, 16}) {
      job.image.tile_size = tile_size;
      EXPECT_EQ(render_correlated(job).film, whole) << tile_size;
    }
  }
}

TEST(SecondPass, AllPoliciesAndMethodsRun) {
  for (const Method method : {Method::environment, Method::brdf, Method::mis, Method::bidirectional,
                              Method::sequential}) {
    for (const MaskPolicy policy :
         {MaskPolicy::same_samples, MaskPolicy::split, MaskPolicy::cross_fold}) {
      JobSpec job = correlated_job(method);
      job.visibility.mask = policy;
      const test::CorrelatedResult result = render_correlated(job);
      EXPECT_GT(result.stats.pixels_masked, 10u);
      EXPECT_GT(result.stats.rays_second_pass, 100u);
      for (const float v : result.film.values) ASSERT_TRUE(std::isfinite(v));
    }
  }
}

// What the second pass draws anew is direct light; films have the rest, whether frames show it or
// not.
TEST(SecondPass, KeepsLightBetweenSurfaces) {
  JobSpec job = correlated_job(Method::mis);
  job.image = {.width = 24, .height = 17, .sites = 4, .tile_size = 4096};
  job.output.aovs = {Aov::direct, Aov::mask};
  const test::CorrelatedResult alone = render_correlated(job);
  EXPECT_GT(alone.stats.pixels_masked, 10u);
  EXPECT_EQ(alone.film.find("indirect.R"), nullptr);
  job.light.bounces = 2;
  const FilmTile lit = render_correlated(job).film;
  float added = 0;
  for (const std::string c : {"R", "G", "B"}) {
    const auto whole = channel(lit, c), indirect = channel(lit, "indirect." + c),
               direct = channel(lit, "direct." + c), before = channel(alone.film, c),
               direct_before = channel(alone.film, "direct." + c);
    for (std::size_t i = 0; i < whole.size(); ++i) {
      ASSERT_EQ(direct_before[i], before[i]) << "of masked pixels, too";
      ASSERT_NEAR(direct[i], before[i], 1e-5f * std::fabs(before[i])) << i;
      ASSERT_NEAR(whole[i], direct[i] + indirect[i], 1e-5f * std::fabs(whole[i])) << i;
      added += indirect[i];
    }
  }
  EXPECT_GT(added, 0);
  job.image.tile_size = 8;
  EXPECT_EQ(render_correlated(job).film, lit);
}

TEST(SecondPass, LeavesFreePixelsAlone) {
  const JobSpec job = correlated_job();
  const test::TileResult first = [&] {
    JobSpec plain = job;
    plain.visibility.dilate = 0;
    const auto context = load_render_context(plain, Digest{1, 2});
    test::TileResult result;
    const TileRunSink sink{.film =
                               [&](Step, const FilmTile& film) {
                                 result.films.push_back(film);
                                 return Status();
                               },
                           .samples = [](const FirstPassSamples&) { return Status(); }};
    EXPECT_TRUE(run_tile(**context, {}, {}, sink, {}).ok());
    return result;
  }();
  const FilmTile second = render_correlated(job).film;
  const auto mask = channel(second, "mask");
  int masked = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] == 0) {
      ++masked;
      continue;
    }
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(second.plane(c)[i], first.films[0].plane(c)[i]);
  }
  EXPECT_GT(masked, 10);
}

TEST(SecondPass, MaskShowsFreeOccludedAndBackground) {
  JobSpec job = correlated_job();
  job.visibility.correlated = false;
  const FilmTile film = test::render_tile(job).films[0];
  const auto mask = channel(film, "mask");
  const auto visibility = channel(film, "visibility");
  const auto depth = channel(film, "depth");
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (depth[i] == 0) {
      EXPECT_EQ(mask[i], 0.5f);
    }
    if (depth[i] > 0 && visibility[i] < 0.99f) {
      EXPECT_EQ(mask[i], 0);
    }
    if (mask[i] == 1) {
      EXPECT_NEAR(visibility[i], 1, 1e-5f);
    }
  }
}

TEST(SecondPass, DilationGrowsTheMaskOverSurfaces) {
  JobSpec job = correlated_job();
  const auto count = [&] {
    const FilmTile film = render_correlated(job).film;
    const auto mask = channel(film, "mask");
    return std::count(mask.begin(), mask.end(), 0.0f);
  };
  const auto plain = count();
  job.visibility.dilate = 1;
  const auto dilated = count();
  EXPECT_GT(dilated, plain);
}

// What the pass is handed is 10 bytes for each free sample of a pixel with a failed ray, 2 for each
// pixel, nothing of surfaces.
TEST(SecondPass, StoresASmallRecordPerSample) {
  const JobSpec job = correlated_job();
  const auto context = load_render_context(job, Digest{1, 2});
  ASSERT_TRUE(context.ok());
  FirstPassSamples samples;
  const TileRunSink sink{.film = [](Step, const FilmTile&) { return Status(); },
                         .samples =
                             [&](const FirstPassSamples& s) {
                               samples = s;
                               return Status();
                             }};
  ASSERT_TRUE(run_tile(**context, {}, {}, sink, {}).ok());
  std::size_t num_free = 0;
  for (std::size_t pixel = 0; pixel < samples.num_pixels(); ++pixel) {
    if ((samples.flags[pixel] & ~FirstPassSamples::kSurface) != 0) {
      EXPECT_LT(samples.count[pixel], job.sampling.num_particles) << pixel;  // not the blocked one
    } else {
      EXPECT_EQ(samples.count[pixel], 0) << pixel;
      num_free += samples.flags[pixel] != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(num_free, 5u);
  EXPECT_GT(samples.energy.size(), 100u);

  // All of what is stored, before it is packed; META says whose it is.
  const Bytes bytes = encode_first_pass_samples(samples);
  const auto file = decode_section_file(bytes, {'B', 'F', 'S', '1'}, 1, "test");
  ASSERT_TRUE(file.ok());
  std::size_t stored = 0;
  for (const Section& section : file->sections) stored += section.payload.size();
  const std::size_t meta = file->find({'M', 'E', 'T', 'A'})->payload.size();
  EXPECT_LE(meta, 64u);
  EXPECT_EQ(stored, meta + 2 * samples.num_pixels() + 10 * samples.energy.size());
}

TEST(SecondPass, RefusesSamplesOfAnotherTileOrJob) {
  const auto context = load_render_context(correlated_job(), Digest{1, 2});
  ASSERT_TRUE(context.ok());
  FilmTile film;
  film.rect = {0, 0, 12, 9};
  auto samples = std::make_shared<FirstPassSamples>();
  samples->picture = {9, 9};
  samples->rect = film.rect;
  std::vector<FirstPassPtr> near{samples};
  EXPECT_THAT(run_second_pass(**context, Step(0), 0, film, near).error().message,
              HasSubstr("first-pass samples: of picture"));
  EXPECT_THAT(run_second_pass(**context, Step(0), 0, film, {}).error().message,
              HasSubstr("samples of 0 tiles, expected 1"));
}

TEST(Populations, ShareNothing) {
  // Two populations in one pixel: other directions, both properly weighted.
  JobSpec job = correlated_job(Method::sequential);
  const test::TileResult result = [&] {
    test::TileResult r;
    const auto context = load_render_context(job, Digest{1, 2});
    const TileRunSink sink{.film = [](Step, const FilmTile&) { return Status(); },
                           .state =
                               [&](const SampleState& state) {
                                 r.state = *decode_state(encode_state(state), "test");
                                 return Status();
                               },
                           .samples = [](const FirstPassSamples&) { return Status(); }};
    EXPECT_TRUE(run_tile(**context, {}, {}, sink, {}).ok());
    return r;
  }();
  ASSERT_EQ(result.state.num_populations, 2);
  const auto lns = ConstSamplePlanes(result.state).lns;
  ASSERT_EQ(lns.size(), 2 * result.state.num_pixels());
  std::size_t differ = 0;
  for (std::size_t pixel = 0; pixel < result.state.num_pixels(); ++pixel) {
    differ += lns[2 * pixel] != lns[2 * pixel + 1] ? 1 : 0;
  }
  EXPECT_GT(differ, 50u);
}

}  // namespace
}  // namespace baton
