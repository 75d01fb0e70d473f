#include "common/job/text/path_maps.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

TEST(PathMaps, WholeNamesAreReplaced) {
  const PathMaps maps{parse_path_map("/studio/shows=/mnt/shows").value(),
                      parse_path_map("/studio/shows/old/=/archive").value(),
                      parse_path_map("/=/host").value()};
  EXPECT_EQ(map_path("/studio/shows/a/b.ply", maps), "/mnt/shows/a/b.ply");
  EXPECT_EQ(map_path("/studio/shows", maps), "/mnt/shows");
  EXPECT_EQ(map_path("/studio/./shows//a", maps), "/mnt/shows/a");
  EXPECT_EQ(map_path("/studio/shows/old/c.exr", maps), "/archive/c.exr");
  EXPECT_EQ(map_path("/studio/showstopper/c.exr", maps), "/host/studio/showstopper/c.exr");
  EXPECT_EQ(map_path("/studio/shows/../c.exr", maps), "/host/studio/c.exr");
  EXPECT_EQ(map_path("/a/b", {}), "/a/b");
}

TEST(PathMaps, BothSidesAreAbsolute) {
  for (const char* text : {"", "/a", "/a=", "=/b", "a=/b", "/a=b"})
    EXPECT_FALSE(parse_path_map(text)) << text;
}

// Every path that a job reads is mapped; the list of its assets tells.
TEST(PathMaps, AllFilesOfAJobAreMapped) {
  JobSpec job;
  job.output.directory = "/from/out";
  job.scene.meshes["m"].path = "/from/m.ply";
  job.scene.materials["p"] = {.kind = MaterialKind::measured, .file = "/from/p.binary"};
  job.scene.materials["t"] = {.color_texture = TextureSpec{.file = "/from/t.png"},
                              .normal_texture = TextureSpec{.file = "/from/n.png"}};
  job.scene.files = {{"/from/extra.bin"}};
  job.environment.keys = {{1, "/from/sky.exr"}};
  job.environment.camera_map.file = "/from/seen.exr";
  job.output.background = Background::plate;
  job.output.plate = FileSequence{.files = "/from/plate.exr"};
  const PathMaps maps{{"/from", "/to"}};
  const JobSpec mapped = map_paths(job, maps);
  EXPECT_EQ(mapped.output.directory, "/to/out");
  const std::vector<std::string> before = asset_paths(job), after = asset_paths(mapped);
  ASSERT_EQ(before.size(), 8u);
  ASSERT_EQ(after.size(), 8u);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i], map_path(before[i], maps));
  EXPECT_EQ(map_paths(std::vector<AssetDigest>{{"/from/a", {1, 2}}}, maps).front().path, "/to/a");
}

}  // namespace
}  // namespace baton
