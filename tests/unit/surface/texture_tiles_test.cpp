// Textures of tiles (UDIM), from the job to what a site sees.
#include "common/scene/material/texture_tiles.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "common/scene/settle/settle_scene.h"
#include "tests/support/image_files.h"
#include "worker/surface/seen_surface.h"

namespace baton {
namespace {

using test::write_targa;
using test::write_test_file;
using testing::ElementsAre;
using testing::HasSubstr;

void expect_place(const TileTriangle& triangle, const Uv& at, int column, int row, float u,
                  float v) {
  const TilePlace place = tile_place(triangle, at);
  EXPECT_EQ(place.column, column);
  EXPECT_EQ(place.row, row);
  EXPECT_FLOAT_EQ(place.uv[0], u);
  EXPECT_FLOAT_EQ(place.uv[1], v);
}

TEST(TextureTiles, NumbersCountFromTheLowerLeft) {
  EXPECT_EQ((TilePlace{0, 0, {}}.index()), 0u);
  EXPECT_EQ((TilePlace{3, 2, {}}.index()), 23u);
  expect_place({{{3.1f, 2.1f}, {3.9f, 2.1f}, {3.1f, 2.9f}}}, {3.25f, 2.25f}, 3, 2, 0.25f, 0.75f);
}

// The right and the upper edge of a tile are the beginning of the next, but for what ends there.
TEST(TextureTiles, ATriangleLiesInItsTileToItsEnd) {
  const TileTriangle lower{{{0, 0}, {1, 0}, {1, 1}}}, upper{{{1, 1}, {2, 1}, {2, 2}}};
  expect_place(lower, {1, 1}, 0, 0, 1, 0);
  expect_place(lower, {1.0000001f, 0.5f}, 0, 0, 1.0000001f, 0.5f);
  expect_place(upper, {1, 1}, 1, 1, 0, 1);
  expect_place(upper, {0.9999999f, 1}, 1, 1, -1.1920929e-7f, 1);
  // One across an edge is in both.
  const TileTriangle across{{{0.5f, 0}, {1.5f, 0}, {1, 1}}};
  expect_place(across, {0.75f, 0}, 0, 0, 0.75f, 1);
  expect_place(across, {1, 0}, 1, 0, 0, 1);
}

std::string fault_of(std::vector<int> numbers, const TileTriangle& triangle) {
  TextureTiles tiles{.file = "skin.<UDIM>.png"};
  for (const int number : numbers)
    tiles.images.at(static_cast<std::size_t>(number - 1001)) = std::make_shared<Texture>();
  return tile_fault(tiles, triangle).value_or("none");
}

TEST(TextureTiles, WhatATriangleNeedsMustBeThere) {
  const TileTriangle first{{{0, 0}, {1, 0}, {1, 1}}};
  EXPECT_EQ(fault_of({1001}, first), "none") << "it only ends at 1002, 1011 and 1012";
  EXPECT_EQ(fault_of({1002}, first), "needs skin.1001.png, which is missing");
  // A long one passes by the tile in the corner of its bounds.
  const TileTriangle slanted{{{0.2f, 0.1f}, {1.9f, 0.1f}, {0.2f, 1.9f}}};
  EXPECT_EQ(fault_of({1001, 1002, 1011}, slanted), "needs skin.1012.png, which is missing");
  const TileTriangle flat{{{0.2f, 0.1f}, {1.5f, 0.1f}, {0.2f, 1.4f}}};
  EXPECT_EQ(fault_of({1001, 1002, 1011}, flat), "none");
  EXPECT_EQ(fault_of({1100}, {{{9.1f, 9.1f}, {10, 9.1f}, {9.1f, 10}}}), "none");
  for (const TileTriangle& outside : {TileTriangle{{{10.5f, 1}, {10.6f, 1}, {10.6f, 1.5f}}},
                                      TileTriangle{{{-0.5f, 0}, {0, 0}, {0, 0.5f}}},
                                      TileTriangle{{{1e30f, 0}, {2e30f, 0}, {1e30f, 1}}}})
    EXPECT_EQ(fault_of({1001}, outside),
              "has texture coordinates outside of the tiles 1001 to 1100 of skin.<UDIM>.png");
  EXPECT_EQ(fault_of({1001}, {{{0.3f, 0.3f}, {0.3f, 0.3f}, {0.3f, 0.3f}}}), "none") << "a point";
}

/// Two squares beside each other, from (0, 0) to (2, 1), on tiles 1001 and 1012.
JobSpec two_tiles_job() {
  write_targa("skin.1001.tga", 1, 1, 3, {255, 0, 0});
  const std::string second =
      write_targa("skin.1012.tga", 2, 2, 3, {0, 255, 0, 0, 0, 255, 255, 255, 0, 255, 255, 255});
  const std::filesystem::path folder = std::filesystem::path(second).parent_path();
  JobSpec job;
  job.scene.materials["skin"] = {.base_color = {1, 1, 1}};
  job.scene.materials["skin"].color_texture =
      TextureSpec{.file = (folder / "skin.<UDIM>.tga").string(), .filter = TextureFilter::nearest};
  job.scene.meshes["figure"] = {
      .path = write_test_file("figure.obj",
                              "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\n"
                              "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 1 1\nvt 2 1\nvt 2 2\nvt 1 2\n"
                              "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 2/5 5/6 6/7\nf 2/5 6/7 3/8\n")};
  job.scene.objects = {{.mesh = "figure", .material = "skin"}};
  return job;
}

Rgb color_at(const Scene& scene, std::uint32_t triangle, float u, float v, float width = 0) {
  ShadingPoint point{{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  return see_detail(scene, scene.instances[0], {triangle, u, v, width}, point).material.kd;
}

TEST(TextureTiles, EachTileIsItsImage) {
  JobSpec job = two_tiles_job();
  ASSERT_TRUE(settle_scene(job));
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(color_at(*scene, 0, 0.2f, 0.2f), (Rgb{1, 0, 0}));
  // Of four colours: below on the left, above on the right, and in the corners.
  EXPECT_EQ(color_at(*scene, 2, 0.1f, 0.1f), (Rgb{1, 1, 0}));
  EXPECT_EQ(color_at(*scene, 2, 0.1f, 0.9f), (Rgb{0, 0, 1}));
  EXPECT_EQ(color_at(*scene, 2, 0, 1), (Rgb{0, 0, 1}));
  EXPECT_EQ(color_at(*scene, 0, 0, 1), (Rgb{1, 0, 0}));
  // Filters end at the edge: the mean of the second tile has nothing of the first.
  const Rgb afar = color_at(*scene, 2, 0, 0, 4);
  EXPECT_NEAR(afar.x, 0.5f, 0.01f);
  EXPECT_NEAR(afar.y, 0.75f, 0.01f);
  EXPECT_GT(scene->size_bytes(), 10u);
}

TEST(TextureTiles, TilesArePartOfTheJob) {
  JobSpec job = two_tiles_job();
  ASSERT_TRUE(settle_scene(job));
  std::vector<std::string> names;
  for (const FileSpec& file : job.scene.files)
    names.push_back(std::filesystem::path(file.path).filename());
  EXPECT_THAT(names, ElementsAre("skin.1001.tga", "skin.1012.tga"));
}

TEST(TextureTiles, AMissingTileIsOneError) {
  JobSpec job = two_tiles_job();
  std::filesystem::remove(tile_file(job.scene.materials["skin"].color_texture->file, 1012));
  job.scene.objects.push_back(job.scene.objects.front());
  JobSpec none = job;
  ASSERT_TRUE(settle_scene(job));
  const auto scene = load_scene(job);
  ASSERT_FALSE(scene.ok());
  EXPECT_THAT(
      scene.error().message,
      testing::MatchesRegex("scene.objects.0.: .*figure.obj, mesh \"figure\": material "
                            "\"skin\": colorTexture needs .*skin.1012.tga, which is missing"));
  std::filesystem::remove(tile_file(none.scene.materials["skin"].color_texture->file, 1001));
  ASSERT_TRUE(settle_scene(none));
  EXPECT_THAT(load_scene(none).error().message,
              HasSubstr("skin.<UDIM>.tga: none of the tiles 1001 to 1100 is there"));
}

// A tile without alpha is opaque, whatever the others are.
TEST(TextureTiles, HolesAreThoseOfTheTile) {
  JobSpec job = two_tiles_job();
  const TextureSpec texture = *job.scene.materials["skin"].color_texture;
  write_targa("skin.1012.tga", 1, 1, 4, {255, 255, 255, 40});
  job.scene.materials["skin"].alpha_cutoff = 0.5f;
  ASSERT_TRUE(settle_scene(job));
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_FALSE(is_cut_away(*scene, scene->instances[0], {0, 0.2f, 0.2f, 0}, 1));
  EXPECT_TRUE(is_cut_away(*scene, scene->instances[0], {2, 0.2f, 0.2f, 0}, 1));
}

}  // namespace
}  // namespace baton
