// Every method against brute force on a scene with hard and soft shadow, gloss, metal and
// silhouettes. Runs (seeds) are independent; pixels and frames of one run are not, so all
// statistics are taken over runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/stat/against_brute_force.h"
#include "tests/support/merl_file.h"

namespace baton {
namespace {

using test::box_job;
using test::channel;
using test::compare;
using test::Estimate;
using test::expect_agreement;
using test::frame_numbers;
using test::judge;
using test::kImageLimit;
using test::kPixelLimit;
using test::mean_rgb;
using test::render_tile;
using test::repeat;
using test::Verdict;

constexpr int kRuns = 48;
/// Resolution that `pool`, with 200 runs, is held to.
constexpr double kFine = 0.003;

JobSpec still_job(Method method) {
  JobSpec job = box_job();
  job.sampling.method = method;
  return job;
}

TEST(Methods, EnvironmentAgreesWithBruteForce) {
  // Directions of the light that lie in the metal's lobe are rare: more samples keep the z-test
  // valid.
  JobSpec job = still_job(Method::environment);
  job.sampling.num_particles = 64;
  expect_agreement(job, 96, 0.05);
}
TEST(Methods, BrdfAgreesWithBruteForce) {
  // Rare hits of the sun give the BRDF's samples a heavy tail: a larger sun keeps the z-test valid.
  JobSpec job = still_job(Method::brdf);
  job.environment.keys[0].map = test::write_map("soft.exr", test::sky_map(32, 16, 3));
  job.sampling.num_particles = 64;
  expect_agreement(job, 96, 0.05);
}
TEST(Methods, MisAgreesWithBruteForce) { expect_agreement(still_job(Method::mis), kRuns, 0.02); }
TEST(Methods, CompensatedMisAgreesWithBruteForce) {
  JobSpec job = still_job(Method::mis);
  job.sampling.mis_compensation = true;
  expect_agreement(job, kRuns, 0.02);
}
TEST(Methods, BidirectionalAgreesWithBruteForce) {
  expect_agreement(still_job(Method::bidirectional), kRuns, 0.01);
}
/// A bright land below the horizon, which a small ground hides but for its rim: hidden_light.h must
/// leave out neither more nor less than what the reference, which samples all of it, finds dark.
JobSpec rim_job(Method method) {
  JobSpec job = still_job(method);
  RgbImage map = test::constant_map(256, 128, {0.3f, 0.4f, 0.6f});
  for (std::size_t i = map.rgb.size() / 2; i < map.rgb.size(); ++i) map.rgb[i] = 3;
  job.environment.keys[0].map = test::write_map("land.exr", map);
  job.scene.ground->size = 9;
  return job;
}
TEST(Methods, MisAgreesWhereAGroundHidesMuchOfTheLight) {
  expect_agreement(rim_job(Method::mis), kRuns, 0.02);
}
TEST(Methods, PoolAgreesWhereAGroundHidesMuchOfTheLight) {
  JobSpec job = rim_job(Method::pool);
  job.frames = frame_numbers(3);
  expect_agreement(job, kRuns, 0.02);
}
TEST(Methods, BidirectionalWithFourSitesAgrees) {
  JobSpec job = still_job(Method::bidirectional);
  job.image.sites = 4;
  job.seed = 5;
  // The sites are part of the seed; compare at equal sites by keeping them out of the silhouettes'
  // way: many runs average over site positions on both sides.
  const Estimate a = repeat(job, 192);
  JobSpec reference = job;
  reference.sampling.method = Method::reference;
  reference.sampling.reference_samples = 1000;
  const Verdict v = compare(a, repeat(reference, 192));
  EXPECT_LT(v.worst_pixel, kPixelLimit);
  EXPECT_LT(v.image, kImageLimit);
}
TEST(Methods, SettingsByMaterialAgreeWithBruteForce) {
  JobSpec job = still_job(Method::mis);
  job.sampling.by_material = {{"ground", {.method = Method::environment, .num_particles = 8}},
                              {"glossy", {.num_particles = 24, .num_candidates = 64}}};
  expect_agreement(job, kRuns, 0.03);
}
TEST(Methods, NearestFilterAgreesWithBruteForce) {
  JobSpec job = still_job(Method::bidirectional);
  job.environment.filter = MapFilter::nearest;
  expect_agreement(job, kRuns, 0.01);
}

JobSpec turning_job(int distributions) {
  JobSpec job = still_job(Method::sequential);
  job.frames = frame_numbers(4);
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.num_distributions = distributions;
  job.sampling.num_candidates = 256;
  return job;
}
TEST(Methods, SequentialAgreesWithBruteForceWhileTheSkyTurns) {
  expect_agreement(turning_job(5), 96, 0.02);
}
TEST(Methods, SequentialWithOneDistributionAgrees) { expect_agreement(turning_job(1), 96, 0.03); }
TEST(Methods, SequentialWithFiveMovesAgrees) {
  JobSpec job = turning_job(1);
  job.sampling.num_moves = 5;
  expect_agreement(job, 96, 0.03);
}
// Frame 1 with N samples of the map and the BRDF, weighted [section 3]; no pixel starts again.
TEST(Methods, SequentialStartedWithMisAgrees) {
  JobSpec job = turning_job(5);
  job.sampling.start_method = Method::mis;
  job.sampling.refresh_every = 0;
  expect_agreement(job, 96, 0.05);
}

/// The glossy box measured: a MERL table of its own Phong BRDF.
JobSpec measured_job(Method method, int frames) {
  JobSpec job = still_job(method);
  job.frames = frame_numbers(frames);
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.num_candidates = 256;
  const MaterialSpec glossy = job.scene.materials["glossy"];
  const std::string file = (test::test_folder() / "glossy.binary").string();
  test::write_merl(file, test::phong_by_angles(glossy.base_color * glossy.kd,
                                               glossy.specular_color * glossy.ks, glossy.exponent));
  job.scene.materials["glossy"] = {.kind = MaterialKind::measured, .file = file};
  return job;
}
TEST(Methods, MisOfAMeasuredBrdfAgreesWithBruteForce) {
  expect_agreement(measured_job(Method::mis, 1), kRuns, 0.02);
}
TEST(Methods, SequentialWithAMeasuredBrdfAgreesWithBruteForce) {
  expect_agreement(measured_job(Method::sequential, 4), 96, 0.02);
}
TEST(Methods, AMeasuredPhongLooksLikePhong) {
  const Verdict v = compare(repeat(measured_job(Method::bidirectional, 1), kRuns),
                            judge(still_job(Method::bidirectional), 60000));
  EXPECT_LT(v.worst_pixel, kPixelLimit);
  EXPECT_LT(v.image, kImageLimit);
}

/// The pool sampler after so many frames of a sky that turns.
JobSpec pool_job(int frames) {
  JobSpec job = still_job(Method::pool);
  job.frames = frame_numbers(frames);
  job.environment.rotation_deg_per_frame = 1.5;
  job.sampling.num_candidates = 64;
  return job;
}
TEST(Methods, PoolAgreesWithBruteForceAtItsFirstFrame) {
  expect_agreement(pool_job(1), 200, kFine);
}
TEST(Methods, PoolAgreesWithBruteForceAfterFiveFrames) {
  expect_agreement(pool_job(5), 200, kFine);
}
TEST(Methods, PoolAgreesWithBruteForceAfterTwentyFrames) {
  expect_agreement(pool_job(20), 200, kFine);
}
TEST(Methods, PoolAgreesWithBruteForceAfterAHundredFrames) {
  expect_agreement(pool_job(100), 200, kFine);
}
/// The ratio estimator is unbiased where all samples have one colour.
TEST(Methods, RatioAgreesWithBruteForceInAGreyScene) {
  JobSpec job = still_job(Method::ratio);
  RgbImage grey = test::sky_map();
  for (std::size_t i = 0; i < grey.rgb.size(); i += 3)
    grey.rgb[i + 1] = grey.rgb[i + 2] = grey.rgb[i];
  job.environment.keys[0].map = test::write_map("grey.exr", grey);
  job.scene.materials["glossy"].base_color = {0.4f, 0.4f, 0.4f};
  job.scene.materials["metal"].base_color = {0.7f, 0.7f, 0.7f};
  expect_agreement(job, kRuns, 0.01);
}

/// ReSTIR after so many frames of a sky that turns.
JobSpec restir_job(int frames, int neighbors) {
  JobSpec job = pool_job(frames);
  job.sampling.method = Method::restir;
  job.sampling.num_neighbors = neighbors;
  job.sampling.neighbor_radius = 4;
  return job;
}
TEST(Methods, RestirAgreesWithBruteForceAfterFiveFrames) {
  expect_agreement(restir_job(5, 0), 200, 0.01);
}
// Errors stay: what twenty frames see is hardly more than what their first ones saw, so less can be
// told.
TEST(Methods, RestirAgreesWithBruteForceAfterTwentyFrames) {
  expect_agreement(restir_job(20, 0), 200, 0.02);
}
TEST(Methods, RestirWithTwoNeighborsAgreesWithBruteForce) {
  expect_agreement(restir_job(5, 2), 200, 0.01);
}
/// Samples turn with a small sun, and the lattice rounds them in each frame.
JobSpec sunny_job(int frames, double deg_per_frame) {
  JobSpec job = restir_job(frames, 0);
  job.environment.keys[0].map = test::write_map("sun.exr", test::sky_map(512, 256, 3000));
  job.environment.rotation_deg_per_frame = deg_per_frame;
  return job;
}
TEST(Methods, RestirAgreesWhileASmallSunTurns) { expect_agreement(sunny_job(20, 0.5), 200, 0.01); }
TEST(Methods, RestirAgreesWhileASmallSunCreeps) {
  expect_agreement(sunny_job(20, 0.07), 200, 0.01);
}
// Directions stay: rounded into another texel, they would change their light.
TEST(Methods, RestirUnderATurningNearestMapAgrees) {
  JobSpec job = restir_job(5, 0);
  job.environment.filter = MapFilter::nearest;
  expect_agreement(job, kRuns, 0.02);
}
TEST(Methods, RestirThatCarriesFreeSamplesAgreesWhereNothingMoves) {
  JobSpec job = restir_job(10, 0);
  job.environment.rotation_deg_per_frame = 0;
  job.sampling.reuse_visibility = true;
  expect_agreement(job, 200, 0.01);
}
// ... and elsewhere are biased: a direction that was blocked turns into one that is free.
TEST(Methods, FreeSamplesThatTurnAreBiased) {
  JobSpec job = restir_job(10, 0);
  job.sampling.reuse_visibility = true;
  const Verdict v = compare(repeat(job, kRuns), judge(job, 60000));
  EXPECT_GT(v.image, kImageLimit);
  EXPECT_GT(v.worst_pixel, kPixelLimit);
}
/// Eight near neighbours under a sky that stands still.
JobSpec crowded_job(bool reuse_visibility) {
  JobSpec job = restir_job(8, 8);
  job.environment.rotation_deg_per_frame = 0;
  job.sampling.neighbor_radius = 2;
  job.sampling.reuse_visibility = reuse_visibility;
  return job;
}
TEST(Methods, RestirAmongEightNeighborsAgreesWithBruteForce) {
  expect_agreement(crowded_job(false), kRuns, 0.01);
}
// What is labelled biased is seen to be: neighbours forget directions that are free here.
TEST(Methods, NeighborsThatCarryFreeSamplesAreBiased) {
  const Verdict v = compare(repeat(crowded_job(true), kRuns), judge(crowded_job(true), 60000));
  EXPECT_GT(v.image, 3 * kImageLimit);
}

/// Maps that hold for so many frames each.
JobSpec changing_job(const std::vector<std::pair<int, std::string>>& maps, int frames) {
  JobSpec job = pool_job(frames);
  job.environment.rotation_deg_per_frame = 0;
  job.environment.interpolate = false;
  job.environment.keys.clear();
  for (const auto& [frame, map] : maps)
    job.environment.keys.push_back({.frame = static_cast<double>(frame), .map = map});
  return job;
}
TEST(Methods, PoolAgreesAfterACut) {
  const std::string white = test::write_map("white.exr", test::constant_map(64, 32, {1, 1, 1}));
  const std::string sky = test::write_map("sky.exr", test::sky_map());
  expect_agreement(changing_job({{1, white}, {4, sky}}, 4), 200, kFine);
  expect_agreement(changing_job({{1, white}, {4, sky}, {5, white}}, 6), 200, kFine);
}
TEST(Methods, RestirAgreesAfterACut) {
  JobSpec job =
      changing_job({{1, test::write_map("white.exr", test::constant_map(64, 32, {1, 1, 1}))},
                    {4, test::write_map("sky.exr", test::sky_map())}},
                   4);
  job.sampling.method = Method::restir;
  expect_agreement(job, 200, 0.01);
}
TEST(Methods, PoolFindsTheLightAfterBlack) {
  const std::string black = test::write_map("black.exr", test::constant_map(64, 32, {0, 0, 0}));
  const std::string sky = test::write_map("sky.exr", test::sky_map());
  expect_agreement(changing_job({{1, sky}, {2, black}, {4, sky}}, 5), 200, kFine);
}
// One frame of a thousand times the sky without its sun: the frame of the flash, and the next.
TEST(Methods, PoolAgreesInAFlashAndAfterIt) {
  RgbImage bright = test::sky_map(64, 32, 0.1f);
  for (float& value : bright.rgb) value *= 1000;
  const std::string sky = test::write_map("sky.exr", test::sky_map());
  const std::string flash = test::write_map("flash.exr", bright);
  for (const int frames : {4, 5})
    expect_agreement(changing_job({{1, sky}, {4, flash}, {5, sky}}, frames), 200, kFine);
}
// One lamp in the dark.
TEST(Methods, PoolAgreesUnderALoneLamp) {
  RgbImage lamp = test::constant_map(64, 32, {0, 0, 0});
  for (const std::size_t texel : {9u * 64 + 20, 9u * 64 + 21})
    std::fill_n(lamp.rgb.begin() + static_cast<std::ptrdiff_t>(3 * texel), 3, 100.0f);
  JobSpec job = pool_job(5);
  job.environment.keys[0].map = test::write_map("lamp.exr", lamp);
  job.environment.filter = MapFilter::nearest;
  expect_agreement(job, 200, kFine);
}
// The map lights up from the top, row by row: there are always lit directions that no carried
// sample has.
TEST(Methods, PoolAgreesWhileTheSupportGrows) {
  std::vector<std::pair<int, std::string>> maps;
  for (int frame = 1; frame <= 5; ++frame) {
    RgbImage part = test::sky_map();
    const auto lit = part.rgb.size() * static_cast<std::size_t>(frame + 1) / 12;
    std::fill(part.rgb.begin() + static_cast<std::ptrdiff_t>(lit), part.rgb.end(), 0.0f);
    maps.emplace_back(frame, test::write_map(fmt::format("part{}.exr", frame), part));
  }
  expect_agreement(changing_job(maps, 5), 200, kFine);
}

// The same machinery must see a ground that reflects 4 % too much.
TEST(Methods, PlantedFaultIsSeen) {
  const JobSpec job = still_job(Method::bidirectional);
  JobSpec wrong = job;
  wrong.scene.materials["ground"].base_color = Rgb{0.5f, 0.5f, 0.5f} * 1.04f;
  const Verdict v = compare(repeat(wrong, kRuns), judge(job, 60000));
  EXPECT_GT(v.image, kImageLimit);
  EXPECT_GT(v.worst_pixel, kPixelLimit);
}
// ... and a sequential sampler whose Lns is off by 4 % (a scaled sky after frame 1 stands in for
// it).
TEST(Methods, PlantedFaultInTheSequenceIsSeen) {
  JobSpec wrong = turning_job(5);
  wrong.environment.scale = 1.04f;
  const Verdict v = compare(repeat(wrong, kRuns), judge(turning_job(5), 60000));
  EXPECT_GT(v.image, kImageLimit);
}

// Furnace: a white sky of radiance 1 over a Lambertian ground of albedo a reflects exactly a.
TEST(Furnace, LambertReflectsItsAlbedo) {
  for (const Method method : {Method::environment, Method::brdf, Method::mis, Method::bidirectional,
                              Method::sequential, Method::pool, Method::ratio, Method::restir}) {
    JobSpec job = still_job(method);
    job.scene.objects.clear();
    job.camera = {
        .position = {0, 5, 0.1f}, .look_at = {0, 0, 0}, .up = {0, 0, -1}, .vertical_fov_deg = 20};
    job.environment.keys[0].map =
        test::write_map("white.exr", test::constant_map(16, 8, {1, 1, 1}));
    job.sampling.num_candidates = 800;
    const std::vector<double> pixels = mean_rgb(render_tile(job).films.back());
    double mean = 0;
    for (const double p : pixels) mean += p / static_cast<double>(pixels.size());
    EXPECT_NEAR(mean, 0.5, 0.02) << static_cast<int>(method);
  }
}
TEST(Furnace, NoMaterialCreatesEnergy) {
  for (const char* material : {"glossy", "metal"}) {
    JobSpec job = still_job(Method::bidirectional);
    job.scene.materials["ground"] = job.scene.materials[material];
    job.scene.materials["ground"].base_color = {1, 1, 1};
    job.scene.objects.clear();
    job.environment.keys[0].map =
        test::write_map("white.exr", test::constant_map(16, 8, {1, 1, 1}));
    job.sampling.num_candidates = 4000;
    job.camera.look_at = {0, -2, 0};
    const test::TileResult result = render_tile(job);
    const auto lns = channel(result.films.back(), "lns");
    const auto depth = channel(result.films.back(), "depth");
    for (std::size_t i = 0; i < lns.size(); ++i) {
      if (depth[i] > 0) {
        EXPECT_LT(lns[i], 1.02f) << material;
      }
    }
  }
}

}  // namespace
}  // namespace baton
