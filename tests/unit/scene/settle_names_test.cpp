// What nodes and materials of glTF files are called, and which of them matter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/limits.h"
#include "common/job/aov.h"
#include "common/scene/gltf/names.h"
#include "common/scene/pose.h"
#include "common/scene/scene_warnings.h"
#include "common/scene/settle/settle_scene.h"
#include "tests/support/gltf_jobs.h"

namespace baton {
namespace {

using test::error_of;
using test::GltfWriter;
using test::job_of;
using test::settled;
using test::still_set;
using test::write_test_file;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr const char* kCamera = R"(, "camera": {"position": [0, 0, 9], "lookAt": [0, 0, 0]})";

/// A file of nodes that show one triangle, and its materials; the first one is the triangle's. The
/// next one takes its place.
std::string set_of(const std::string& nodes, const std::string& materials = "{}",
                   const std::string& more = "") {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  return write_test_file(
      "names.glb", w.glb(R"("meshes":[{"name":"sheet","primitives":[{"attributes":{"POSITION":0},
      "material":0}]}],"nodes":[)" +
                         nodes + R"(],"materials":[)" + materials + "]" + more));
}

std::vector<std::string> names_of(const std::string& nodes, const std::string& said = "") {
  return object_names(settled(job_of(set_of(nodes), said, kCamera)));
}

TEST(GltfNames, ObjectsAreCalledAsTheirNodesHidingOthersOrNot) {
  const std::string nodes = R"-({"name":"post","mesh":0},{"name":"rail","mesh":0},
      {"name":"post","mesh":0},{"mesh":0},{"name":"post (2)","mesh":0},{"name":"rail"})-";
  EXPECT_THAT(names_of(nodes), ElementsAre("post", "rail", "post (2) (2)", "sheet", "post (2)"));
  EXPECT_THAT(names_of(nodes, R"-(, "nodes": {"post (2)": {"visible": false}}})-"),
              ElementsAre("post", "rail", "post (2) (2)", "sheet"));
}

// A node of two materials is one object for people, and two in the AOV `object`.
TEST(GltfNames, PartsOfANodeAreOneObject) {
  const JobSpec job = settled(job_of(still_set()));
  EXPECT_THAT(object_names(job), ElementsAre("left", "left", "right", "right"));
}

TEST(GltfNames, WhatIsGivenStays) {
  EXPECT_THAT(gltf::distinct_names({"a", "a", "a (1)", "", "thing 3"}, "thing"),
              ElementsAre("a", "a (1) (1)", "a (1)", "thing 3 (3)", "thing 3"));
  EXPECT_THAT(gltf::distinct_names({"taken", "b"}, "thing", {"taken"}),
              ElementsAre("taken (0)", "b"));
}

TEST(GltfNames, AreThoseThatAJobMaySay) {
  const std::string file = set_of(R"({"name":"fl\noor\u007f","mesh":0})", R"({"name":"cl\tay"})");
  const JobSpec job =
      settled(job_of(file, R"(, "nodes": {"fl oor ": {"catcher": true}}})", kCamera));
  EXPECT_THAT(object_names(job), ElementsAre("fl oor "));
  EXPECT_TRUE(job.scene.objects.at(0).catcher);
  EXPECT_EQ(job.scene.objects[0].material, "cl ay");
  EXPECT_EQ(parse_job(to_json(job), "again", "/").value(), job);

  // Whole characters of two bytes.
  std::string longer = "x";
  for (int i = 0; i < limits::kMaxTextLength; ++i) longer += "\u00e4";
  const JobSpec cut =
      settled(job_of(set_of(R"({"name":")" + longer + R"(","mesh":0})"), "", kCamera));
  EXPECT_EQ(cut.scene.objects.at(0).name.size() % 2, 1u);
  EXPECT_TRUE(longer.starts_with(cut.scene.objects[0].name));
  EXPECT_EQ(parse_job(to_json(cut), "again", "/").value(), cut);
}

TEST(GltfMaterials, FaultsCountWhereSomethingIsMadeOfThem) {
  const std::string node = R"({"name":"a","mesh":0})", good = R"({"name":"good"})";
  const std::string odd = R"({"name":"odd","pbrMetallicRoughness":
      {"baseColorTexture":{"index":0,"texCoord":2}}})";
  const std::string more = R"(,"textures":[{"source":0}],"images":[{"uri":"gone.png"}])";
  const std::string fault =
      "material \"odd\": $.materials[0].pbrMetallicRoughness."
      "baseColorTexture.texCoord: expected an index below 2";
  EXPECT_THAT(error_of(job_of(set_of(node, odd + "," + good, more), "", kCamera)),
              HasSubstr(fault));
  const std::string unused = set_of(node, good + "," + odd, more);
  EXPECT_EQ(error_of(job_of(unused, "", kCamera)), "none");
  EXPECT_THAT(error_of(job_of(unused, R"( , "ground": {"material": "odd"})", kCamera)),
              HasSubstr("material \"odd\": $.materials[1]"));
  // In place of the file's own, or of what a node is made of.
  const std::string used = set_of(node, odd + "," + good, more);
  EXPECT_EQ(error_of(job_of(used, R"(, "nodes": {"a": {"material": "good"}}})", kCamera)), "none");
  EXPECT_EQ(error_of(job_of(used, R"( , "materials": {"odd": {"type": "diffuse"}})", kCamera)),
            "none");
}

// A texture of what is made of nothing need not be there.
TEST(GltfMaterials, OnlyWhatIsUsedHasTextures) {
  const std::string more = R"(,"textures":[{"source":0}],"images":[{"uri":"gone.png"}])";
  const std::string textured =
      R"({"name":"b","emissiveFactor":[1,1,1],"emissiveTexture":{"index":0},
      "pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
  const std::string file = set_of(R"({"mesh":0})", R"({"name":"a"},)" + textured, more);
  JobSpec job = settled(job_of(file, "", kCamera));
  EXPECT_TRUE(load_scene(job));
  EXPECT_THAT(asset_paths(job), Not(testing::Contains(HasSubstr("gone.png"))));
  EXPECT_THAT(textures_of(job.scene.materials.at("b")), IsEmpty());
  EXPECT_EQ(job.scene.materials.at("b").emission, (Rgb{1, 1, 1}));
  job = settled(job_of(file, R"( , "ground": {"material": "b"})", kCamera));
  EXPECT_EQ(textures_of(job.scene.materials.at("b")).size(), 2u);
  EXPECT_THAT(asset_paths(job), testing::Contains(HasSubstr("gone.png")));
}

TEST(SceneWarnings, SayWhatIsNotReadOfWhatIsShown) {
  const std::string glows =
      R"({"name":"lamp","emissiveFactor":[1,1,1],"occlusionTexture":{"index":0}})";
  const std::string more = R"(,"textures":[{}],"extensionsUsed":["KHR_texture_transform",
      "KHR_lights_punctual"])";
  const std::string file = set_of(R"({"name":"a","mesh":0})", glows + R"(,{"name":"grey"})", more);
  const auto said = [&](const std::string& scene) {
    return scene_warnings(settled(job_of(file, scene, kCamera)));
  };
  const auto extension = HasSubstr("names.glb: extension KHR_lights_punctual is not read");
  EXPECT_THAT(said(""),
              ElementsAre("material \"lamp\": it glows, but lights nothing, as light.bounces is 0",
                          extension, HasSubstr("material \"lamp\": its occlusion texture is not")));
  // Not of what is hidden, or what the job has in its place; of the job's own, too.
  EXPECT_THAT(said(R"(, "nodes": {"a": {"material": "grey"}}})"), ElementsAre(extension));
  EXPECT_THAT(said(R"( , "materials": {"lamp": {"type": "diffuse"}})"), ElementsAre(extension));
  EXPECT_THAT(said(R"( , "materials": {"lamp": {"type": "diffuse", "emission": [0, 1, 0]}})"),
              ElementsAre("material \"lamp\": it glows, but lights nothing, as light.bounces is 0",
                          extension));
  EXPECT_THAT(
      said(R"( , "materials": {"own": {"type": "diffuse", "emission": [0, 1, 0]}},
                       "ground": {"material": "own"})"),
      testing::Contains("material \"own\": it glows, but lights nothing, as light.bounces is 0"));
}

TEST(SceneWarnings, SayWhatStandsForNoMaterialOfTheFile) {
  const std::string file = set_of(R"({"mesh":0})", R"({"name":"clay"},{"name":"spare"})");
  const auto said = [&](const std::string& materials, const std::string& more = "") {
    return scene_warnings(
        settled(job_of(file, R"( , "materials": {)" + materials + "}" + more, kCamera)));
  };
  const std::string diffuse = R"({"type": "diffuse"})";
  EXPECT_THAT(said("\"claay\": " + diffuse),
              ElementsAre("scene.materials: no object has material \"claay\", nor is it one of the "
                          "glTF file; did you mean \"clay\"?"));
  EXPECT_THAT(said("\"clay\": " + diffuse + ", \"spare\": " + diffuse), IsEmpty());
  EXPECT_THAT(said("\"floor\": " + diffuse, R"( , "ground": {"material": "floor"})"), IsEmpty());
}

/// Node "a" pops in: its scale is 0 at 0 s and 1 at 1 s.
JobSpec popping_job(const std::string& nodes, float last) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 1}, "SCALAR", 1);
  w.add(std::vector<float>{0, 0, 0, last, last, last}, "VEC3", 3);
  return job_of(write_test_file("pops.glb", w.glb(R"("meshes":[{"primitives":[{"attributes":
      {"POSITION":0}}]}],"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],
      "samplers":[{"input":1,"output":2,"interpolation":"STEP"}]}],"nodes":[)" +
                                                  nodes + "]")),
                R"(, "fps": 1, "startFrame": 1})", kCamera);
}

TEST(SettleScene, ANodeWithoutVolumeIsNotThere) {
  const std::string nodes =
      R"({"name":"a","mesh":0},{"name":"b","mesh":0,"scale":[1,0,1]},{"name":"c","mesh":0})";
  std::vector<std::string> left_out;
  const auto job = settle_motion(popping_job(nodes, 1), &left_out);
  ASSERT_TRUE(job) << job.error().message;
  EXPECT_THAT(object_names(*job), ElementsAre("a", "c"));
  EXPECT_THAT(left_out, ElementsAre(HasSubstr("pops.glb: node \"b\" has a scale of 0 in all")));
  const auto scene = load_scene(*job);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(pose_at(*scene, *job, 1).instances.at(0).is_absent);
  EXPECT_FALSE(pose_at(*scene, *job, 2).instances.at(0).is_absent);
  // What never comes is left out, too.
  left_out.clear();
  const auto none = settle_motion(popping_job(nodes, 0), &left_out);
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_THAT(object_names(*none), ElementsAre("c"));
  EXPECT_EQ(left_out.size(), 2u);
}

TEST(SettleScene, TheJobMaySayWhatTheCameraOfAFileSees) {
  const auto camera_of = [](const std::string& more) {
    return settled(job_of(still_set(), "", R"(, "camera": {"node": "eye")" + more + "}")).camera;
  };
  const CameraSpec given = camera_of("");
  EXPECT_NEAR(given.vertical_fov_deg, 0.8f * 180 / kPi, 1e-3f);
  CameraSpec wide = camera_of(R"(, "verticalFovDeg": 80)");
  EXPECT_EQ(wide.vertical_fov_deg, 80);
  wide.vertical_fov_deg = given.vertical_fov_deg;
  EXPECT_EQ(wide, given) << "the rest is that of the file";
  const CameraSpec flat = camera_of(R"(, "projection": "orthographic", "orthographicHeight": 3)");
  EXPECT_EQ(flat.projection, Projection::orthographic);
  EXPECT_EQ(flat.orthographic_height, 3);
  EXPECT_EQ(flat.position, given.position);
}

}  // namespace
}  // namespace baton
