// Methods against brute force where surfaces have textures: colours, metal and roughness that
// change from texel to texel, a normal map, and holes that light and sight pass through.
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

/// A file of the test alone: others may run beside it.
std::string write_own(const std::string& name, const std::string& bytes) {
  const std::filesystem::path path = test::test_folder() / name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path.string();
}

/// The box of box_job with an image on each side.
std::string box_with_uvs() {
  std::string text;
  for (int i = 0; i < 8; ++i) {
    text += "v " + std::to_string((i & 1) - 0.5) + " " + std::to_string((i >> 1 & 1) - 0.5) + " " +
            std::to_string((i >> 2 & 1) - 0.5) + "\n";
  }
  text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  for (const char* face : {"1/1 3/2 4/3 2/4", "5/1 6/2 8/3 7/4", "1/1 2/2 6/3 5/4",
                           "3/1 7/2 8/3 4/4", "1/1 5/2 7/3 3/4", "2/1 4/2 8/3 6/4"}) {
    text += std::string("f ") + face + "\n";
  }
  return write_own("box_with_uvs.obj", text);
}

/// Squares of two texels, in turn; each `channels` values.
std::string checker(const std::string& name, int channels, const std::vector<std::uint8_t>& a,
                    const std::vector<std::uint8_t>& b) {
  std::vector<std::uint8_t> values;
  for (int i = 0; i < 16; ++i) {
    const auto& texel = (i + i / 4) % 2 == 0 ? a : b;
    values.insert(values.end(), texel.begin(), texel.end());
  }
  return write_own(name, test::targa(4, 4, channels, values));
}

/// box_job on a chequered floor; one box is bumpy and partly metal, the other has holes.
JobSpec textured_job(Method method) {
  JobSpec job = test::box_job();
  job.sampling.method = method;
  job.scene.meshes["box"] = {.path = box_with_uvs(), .smooth_normals = false};
  auto& materials = job.scene.materials;
  materials["ground"].color_texture =
      TextureSpec{.file = checker("floor.tga", 3, {255, 240, 200}, {90, 70, 60}),
                  .rotate_deg = 30,
                  .filter = TextureFilter::nearest};
  materials["metal"].color_texture =
      TextureSpec{.file = checker("metal.tga", 3, {255, 200, 120}, {80, 160, 255})};
  materials["metal"].metallic_roughness_texture =
      TextureSpec{.file = checker("rough.tga", 3, {0, 255, 255}, {0, 120, 0})};
  materials["metal"].normal_texture =
      TextureSpec{.file = checker("bumps.tga", 3, {190, 128, 230}, {100, 60, 230})};
  materials["glossy"].color_texture =
      TextureSpec{.file = checker("holes.tga", 4, {255, 255, 255, 255}, {255, 90, 90, 0}),
                  .scale = {0.5f, 0.5f}};
  materials["glossy"].alpha_cutoff = 0.5f;
  materials["glossy"].emission = {0.01f, 0.02f, 0.03f};
  return job;
}

TEST(Textures, MisAgreesWithBruteForce) {
  expect_agreement(textured_job(Method::mis), kRuns, 0.03);
}
TEST(Textures, BidirectionalAgreesWithBruteForce) {
  expect_agreement(textured_job(Method::bidirectional), kRuns, 0.02);
}
TEST(Textures, PoolAgreesWithBruteForce) {
  JobSpec job = textured_job(Method::pool);
  job.frames = frame_numbers(3);
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.num_candidates = 256;
  expect_agreement(job, kRuns, 0.02);
}
TEST(Textures, SequentialAgreesWithBruteForceWhileTheSkyTurns) {
  JobSpec job = textured_job(Method::sequential);
  job.frames = frame_numbers(3);
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.num_candidates = 256;
  expect_agreement(job, 2 * kRuns, 0.03);
}
TEST(Textures, RestirAgreesWithBruteForce) {
  JobSpec job = textured_job(Method::restir);
  job.frames = frame_numbers(3);
  expect_agreement(job, kRuns, 0.03);
}
// Camera and a box move: what a pixel carries comes from other texels.
TEST(Textures, MovingSurfacesAgreeWithBruteForce) {
  for (const Method method : {Method::pool, Method::sequential}) {
    JobSpec job = textured_job(method);
    job.frames = frame_numbers(4);
    job.sampling.num_candidates = 256;
    test::set_in_motion(job, true, true);
    expect_agreement(job, 2 * kRuns, 0.03);
  }
}

// A pane through which some of the light and of the sight passes, in motion and at rest.
TEST(Textures, BlendedSurfacesAgreeWithBruteForce) {
  for (const Method method : {Method::mis, Method::pool, Method::sequential}) {
    for (const bool moves : {false, true}) {
      JobSpec job = textured_job(method);
      job.scene.materials["glossy"].alpha_cutoff = 0;
      job.scene.materials["glossy"].alpha_blend = true;
      job.scene.materials["glossy"].alpha = 0.7f;
      job.frames = frame_numbers(3);
      job.sampling.num_candidates = 256;
      if (moves) test::set_in_motion(job, true, true);
      expect_agreement(job, 2 * kRuns, 0.03);
    }
  }
}

}  // namespace
}  // namespace baton
