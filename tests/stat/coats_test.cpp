// Methods against brute force where materials have a clear coat: over a normal map, with its own
// normal; over paint and metal; with images of its strength and roughness.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/stat/against_brute_force.h"
#include "tests/support/image_files.h"

namespace baton {
namespace {

using test::expect_agreement;
using test::frame_numbers;

constexpr int kRuns = 48;

/// Squares of two texels, in turn.
TextureSpec checker(const std::string& name, const std::vector<std::uint8_t>& a,
                    const std::vector<std::uint8_t>& b) {
  std::vector<std::uint8_t> values;
  for (int i = 0; i < 16; ++i) {
    const auto& texel = (i + i / 4) % 2 == 0 ? a : b;
    values.insert(values.end(), texel.begin(), texel.end());
  }
  const std::filesystem::path path = test::test_folder() / name;
  std::ofstream(path, std::ios::binary) << test::targa(4, 4, 3, values);
  return {.file = path.string()};
}

/// box_job with paint, a lacquered metal, and a bumpy ground under a coat with images.
JobSpec coated_job(Method method, int frames = 1) {
  JobSpec job = test::box_job();
  job.sampling.method = method;
  job.frames = frame_numbers(frames);
  job.sampling.num_candidates = 256;
  if (frames > 1) job.environment.rotation_deg_per_frame = 0.3;
  auto& materials = job.scene.materials;
  materials["glossy"] = {.kind = MaterialKind::metallic_roughness,
                         .base_color = {0.6f, 0.05f, 0.04f},
                         .roughness = 0.5f,
                         .clearcoat = 1.0f,
                         .clearcoat_roughness = 0.25f};
  materials["metal"].clearcoat = 0.7f;
  materials["metal"].clearcoat_roughness = 0.4f;
  materials["ground"] = {.kind = MaterialKind::metallic_roughness,
                         .base_color = {0.4f, 0.4f, 0.3f},
                         .roughness = 0.6f,
                         .clearcoat = 1.0f,
                         .clearcoat_roughness = 0.8f};
  materials["ground"].normal_texture = checker("bumps.tga", {190, 128, 230}, {100, 60, 230});
  materials["ground"].clearcoat_texture = checker("coat.tga", {255, 0, 0}, {80, 255, 255});
  materials["ground"].clearcoat_roughness_texture = checker("rough.tga", {0, 255, 0}, {9, 90, 9});
  materials["ground"].clearcoat_normal_texture =
      checker("waves.tga", {90, 150, 240}, {140, 200, 220});
  return job;
}

TEST(Coats, EnvironmentAgreesWithBruteForce) {
  JobSpec job = coated_job(Method::environment);
  job.sampling.num_particles = 64;
  expect_agreement(job, 96, 0.05);
}
TEST(Coats, BrdfAgreesWithBruteForce) {
  // As in methods_test.cpp: a larger sun keeps the z-test valid.
  JobSpec job = coated_job(Method::brdf);
  job.environment.keys[0].map = test::write_map("soft.exr", test::sky_map(32, 16, 3));
  job.sampling.num_particles = 64;
  expect_agreement(job, 96, 0.05);
}
TEST(Coats, MisAgreesWithBruteForce) { expect_agreement(coated_job(Method::mis), kRuns, 0.03); }
TEST(Coats, BidirectionalAgreesWithBruteForce) {
  expect_agreement(coated_job(Method::bidirectional), kRuns, 0.02);
}
TEST(Coats, PoolAgreesWithBruteForce) {
  expect_agreement(coated_job(Method::pool, 3), kRuns, 0.02);
}
TEST(Coats, SequentialAgreesWithBruteForce) {
  expect_agreement(coated_job(Method::sequential, 3), 2 * kRuns, 0.03);
}
TEST(Coats, RestirAgreesWithBruteForce) {
  expect_agreement(coated_job(Method::restir, 3), kRuns, 0.03);
}
TEST(Coats, MovingSurfacesAgreeWithBruteForce) {
  for (const Method method : {Method::pool, Method::sequential, Method::restir}) {
    JobSpec job = coated_job(method, 4);
    test::set_in_motion(job, true, true);
    expect_agreement(job, 2 * kRuns, 0.03);
  }
}
// The reference itself, which the others are held to: under a white sky a coat of share s shows s
// times a white metal of its roughness, and 1 - s times the bare material.
TEST(Coats, TheReferenceIsTheFormula) {
  JobSpec job = coated_job(Method::reference);
  job.sampling.reference_samples = 20000;
  job.image = {.width = 1, .height = 1, .sites = 1, .tile_size = 4096};
  job.camera = {
      .position = {0, 3, 3}, .look_at = {0, 0, 0}, .up = {0, 1, 0}, .vertical_fov_deg = 1};
  job.scene.objects.clear();
  job.scene.materials["ground"] = job.scene.materials["glossy"];
  job.scene.materials["ground"].clearcoat_roughness = 0.6f;
  job.environment.keys[0].map = test::write_map("flat.exr", test::constant_map(64, 32, {1, 1, 1}));
  const FilmTile film = test::render_tile(job).films.back();
  JobSpec bare = job, metal = job;
  bare.scene.materials["ground"].clearcoat.reset();
  metal.scene.materials["ground"] = {.kind = MaterialKind::metallic_roughness,
                                     .base_color = {1, 1, 1},
                                     .metallic = 1,
                                     .roughness = 0.6f};
  const float without = test::render_tile(bare).films.back().plane(0)[0];
  const float white = test::render_tile(metal).films.back().plane(0)[0];
  const float t = 1 - std::sqrt(0.5f), share = 0.04f + 0.96f * std::pow(t, 5.0f);
  const float expected = (1 - share) * without + share * white;
  EXPECT_NEAR(film.plane(0)[0], expected, 0.02f * expected);
}

}  // namespace
}  // namespace baton
