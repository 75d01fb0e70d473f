// Skins and morph targets of glTF files against positions by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/job/motion.h"
#include "common/job/text/job_json.h"
#include "common/scene/mesh_loader.h"
#include "common/scene/object_view.h"
#include "common/scene/pose.h"
#include "common/scene/settle/settle_motion.h"
#include "common/scene/settle/settle_scene.h"
#include "tests/support/deforming_files.h"

namespace baton {
namespace {

using test::bar_glb;
using test::BarParts;
using testing::HasSubstr;

constexpr float kHalf = 0.70710678f;

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_NEAR(a.x, b.x, 1e-5f);
  EXPECT_NEAR(a.y, b.y, 1e-5f);
  EXPECT_NEAR(a.z, b.z, 1e-5f);
}

/// The scene of a file at 24 frames a second, frame 1 at time 0.
JobSpec job_of(const BarParts& parts, const std::string& nodes = "") {
  const std::string file = test::write_test_file("bar.glb", bar_glb(parts));
  const auto job = parse_job(R"({"name": "j", "frames": "1-25", "environment": {"map": "/m.exr"},
      "camera": {"position": [0, 0, 9], "lookAt": [0, 0, 0]}, "image": {"width": 640, "height": 480},
      "scene": {"gltf": {"file": ")" +
                                 file + R"(", "fps": 24, "startFrame": 1)" + nodes + "}}}",
                             "job", "/");
  EXPECT_TRUE(job) << (job ? "" : job.error().message);
  return job ? *job : JobSpec{};
}

/// A settled job with its scene.
struct Loaded {
  explicit Loaded(const BarParts& parts, const std::string& nodes = "") {
    const auto settled = settle_motion(job_of(parts, nodes));
    EXPECT_TRUE(settled) << (settled ? "" : settled.error().message);
    if (settled) job = *settled;
    const auto loaded = load_scene(job);
    EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
    if (loaded) scene = *loaded;
  }
  /// Vertex i of the file in the world.
  Vec3 point(double seconds, std::size_t i) const {
    const Pose pose = pose_at(scene, job, 1 + 24 * seconds);
    return pose.instances[0].to_world.point(vertices_of(scene, pose.shapes, 0).positions[i]);
  }
  Vec3 normal(double seconds, std::size_t i) const {
    return vertices_of(scene, pose_at(scene, job, 1 + 24 * seconds).shapes, 0).normals[i];
  }

  JobSpec job;
  Scene scene;
};

std::string error_of(const BarParts& parts, const std::string& nodes = "") {
  auto settled = settle_motion(job_of(parts, nodes));
  if (!settled) return settled.error().message;
  const auto scene = load_scene(*settled);
  return scene ? "none" : scene.error().message;
}

TEST(GltfShapes, ASkinMovesVerticesAndNormals) {
  const Loaded bar(BarParts{});
  // Its node is far aside, and does not count.
  expect_near(bar.point(0, 2), {2, 1, 0});
  expect_near(bar.point(1, 0), {0, 0, 0});
  expect_near(bar.point(1, 1), {1.5f, 0.5f, 0});  // half of (2, 0), half of (1, 1)
  expect_near(bar.point(1, 2), {0, 1, 0});        // (1, 1) from the joint becomes (-1, 1)
  expect_near(bar.point(0.5, 2), {1, 1.4142136f, 0});
  expect_near(bar.normal(1, 0), {0, 1, 0});
  expect_near(bar.normal(1, 2), {0, 1, 0});
  expect_near(bar.normal(0.5, 2), {kHalf, kHalf, 0});
  // Held before and behind.
  expect_near(bar.point(-3, 2), {2, 1, 0});
  expect_near(bar.point(7, 2), {0, 1, 0});
}

TEST(GltfShapes, NormalsFollowTheInverseTransposeOfTheirBones) {
  BarParts parts;
  parts.animated = false;
  parts.normals = {0, 1, 0, 0, 1, 0, kHalf, kHalf, 0};
  // Bone 2 is stretched along x by 2.
  const Loaded bar(parts, R"(, "nodes": {"tip": {"place": {"translate": [1, 0, 0],
                                                           "scale": [2, 1, 1]}}})");
  const auto& mesh = bar.scene.meshes[0];
  const auto corner = mesh.triangles[0];
  expect_near(mesh.positions[corner[2]], {3, 1, 0});
  expect_near(mesh.normals[corner[2]], {0.4472136f, 0.8944272f, 0});
}

TEST(GltfShapes, WhatRestsIsAMeshLikeOthers) {
  BarParts parts;
  parts.animated = false;
  const Loaded bar(parts, R"(, "nodes": {"tip": {"place": {"translate": [1, 0, 5]}}})");
  EXPECT_FALSE(moves(bar.job));
  EXPECT_FALSE(bar.scene.instances[0].moves());
  EXPECT_EQ(bar.scene.meshes[0].deformation, nullptr);
  expect_near(bar.point(0, 2), {2, 1, 5});
  // Morph weights that are 0 leave the mesh alone; others shape it in the place of its node.
  parts.skinned = false;
  parts.morphed = true;
  const Loaded flat(parts);
  EXPECT_FALSE(flat.job.scene.meshes.begin()->second.shaped_by);
  parts.mesh_more = R"(,"weights":[0.5])";
  expect_near(Loaded(parts).point(0, 2), {2, 2, 100});
  parts.node_more = R"(,"weights":[2])";
  expect_near(Loaded(parts).point(0, 2), {2, 5, 100});
}

TEST(GltfShapes, WhatIsShrunkToNothingAtRestLeavesTheOthers) {
  const auto expect_nothing = [](const BarParts& parts) {
    const Loaded bar(parts);
    ASSERT_EQ(bar.scene.meshes.size(), 1u);
    const TriangleMesh& mesh = bar.scene.meshes[0];
    ASSERT_EQ(mesh.triangles.size(), 1u);
    for (const std::uint32_t corner : mesh.triangles[0])
      EXPECT_TRUE(std::isfinite(length(mesh.positions[corner])));
    EXPECT_EQ(mesh.repairs.shrunk, 1u);
    EXPECT_THAT(geometry_warnings(bar.job, bar.scene),
                testing::Contains(HasSubstr("1 parts are shrunk to nothing by their bones or")));
  };
  BarParts parts;
  parts.animated = false;
  for (const char* scale : {"[0,0,0]", "[0,0,1]", "[1,0,1]"}) {
    parts.root_more = std::string(",\"scale\":") + scale;
    expect_nothing(parts);
  }
  parts.root_more = "";
  parts.skinned = false;
  parts.morphed = true;
  parts.target = {0, 0, 0, 0, 0, 0, 0, -1, 0};
  parts.mesh_more = R"(,"weights":[1])";
  expect_nothing(parts);
}

TEST(GltfShapes, TargetsComeOnByLinearStepAndCubicCurves) {
  BarParts parts;
  parts.skinned = false;
  parts.morphed = true;
  const Loaded linear(parts);
  expect_near(linear.point(0, 2), {2, 1, 100});
  expect_near(linear.point(0.25, 2), {2, 1.5f, 100});
  expect_near(linear.point(1, 2), {2, 3, 100});
  expect_near(linear.normal(1, 2), {0, 1, 0});
  expect_near(linear.normal(0.5, 2), {kHalf, kHalf, 0});
  parts.curve = "STEP";
  expect_near(Loaded(parts).point(0.99, 2), {2, 1, 100});
  expect_near(Loaded(parts).point(1, 2), {2, 3, 100});
  // In, value, out: from 0 to 1 with a slope of 4 at the beginning: at a half 1/2 + 4/8.
  parts.curve = "CUBICSPLINE";
  parts.weight_values = {0, 0, 4, 0, 1, 0};
  parts.rotations = {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0};
  expect_near(Loaded(parts).point(0.5, 2), {2, 3, 100});
}

TEST(GltfShapes, TargetsComeBeforeTheSkin) {
  BarParts parts;
  parts.morphed = true;
  const Loaded bar(parts);
  // (2, 3) is (1, 3) from the joint, and (-3, 1) turned.
  expect_near(bar.point(1, 2), {-2, 1, 0});
  expect_near(bar.normal(1, 2), {-1, 0, 0});
}

TEST(GltfShapes, JointsAndWeightsComeInEveryType) {
  const auto bar_with = [](auto joints, auto weights, const std::string& normalized) {
    BarParts parts;
    test::GltfWriter w;
    parts.skinned = false;
    std::string file = bar_glb(parts);
    w.add(parts.positions, "VEC3", 3);
    w.add(joints, "VEC4", 4);
    w.add(weights, "VEC4", 4, normalized);
    file = test::write_test_file("types.glb",
                                 w.glb(R"("nodes":[{"mesh":0,"skin":0},{},{"translation":[0,0,3]}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}]}],
      "skins":[{"joints":[1,2]}])"));
    const auto mesh = load_mesh(file, true);
    EXPECT_TRUE(mesh) << (mesh ? "" : mesh.error().message);
    return mesh ? mesh->positions[mesh->triangles[0][1]] : Vec3{};
  };
  const std::vector<std::uint8_t> bytes{0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0};
  const std::vector<std::uint16_t> shorts(bytes.begin(), bytes.end());
  const Vec3 expected{2, 0, 1};  // a third of joint 1, which is 3 ahead
  expect_near(bar_with(bytes, std::vector<float>{1, 0, 0, 0, 0.5f, 0.25f, 0, 0, 1, 0, 0, 0}, ""),
              expected);
  expect_near(bar_with(shorts, std::vector<std::uint8_t>{255, 0, 0, 0, 170, 85, 0, 0, 255, 0, 0, 0},
                       R"(,"normalized":true)"),
              expected);
  expect_near(
      bar_with(shorts,
               std::vector<std::uint16_t>{65535, 0, 0, 0, 43690, 21845, 0, 0, 65535, 0, 0, 0},
               R"(,"normalized":true)"),
      expected);
}

TEST(GltfShapes, MoreThanFourJointsAVertex) {
  BarParts parts;
  // The first set again: what both say is averaged.
  parts.more_attributes = R"(,"JOINTS_1":2,"WEIGHTS_1":3)";
  expect_near(Loaded(parts).point(1, 1), {1.5f, 0.5f, 0});
  parts.more_attributes = R"(,"JOINTS_1":2)";
  EXPECT_THAT(error_of(parts), HasSubstr("primitives[0].attributes: expected JOINTS_1 and "
                                         "WEIGHTS_1, or neither"));
}

TEST(GltfShapes, ADeformingJobIsInMotionAndItsDocumentSaysHow) {
  const Loaded bar(BarParts{});
  EXPECT_TRUE(moves(bar.job));
  EXPECT_TRUE(is_settled(bar.job));
  EXPECT_TRUE(bar.job.scene.objects[0].keys.empty());
  EXPECT_TRUE(bar.scene.instances[0].moves());
  const MeshSpec& mesh = bar.job.scene.meshes.begin()->second;
  ASSERT_TRUE(mesh.deforms());
  EXPECT_EQ(*mesh.shaped_by->animation, (FileClock{.fps = 24, .start_frame = 1}));
  EXPECT_EQ(parse_job(to_json(bar.job), "again", "/").value(), bar.job);

  // Measured where the vertices go: the tip by 1/24 of its quarter circle a frame.
  const float per_unit = 240 / (9 * std::tan(0.5f * bar.job.camera.vertical_fov_deg * kPi / 180));
  const float step = 1.4142136f * (kPi / 2 / 24) * per_unit;
  EXPECT_GT(step, 4);
  EXPECT_GE(bar.job.motion.max_px, static_cast<int>(std::ceil(step)));
  EXPECT_LE(bar.job.motion.max_px, static_cast<int>(std::ceil(1.1f * step)) + 2);
}

TEST(GltfShapes, BonesMayBePlacedByTheJob) {
  // The root is elsewhere, and all of the bar with it, while its tip goes on turning.
  const Loaded bar(BarParts{}, R"(, "nodes": {"root": {"place": {"translate": [0, 5, 0]}}})");
  expect_near(bar.point(1, 0), {0, 5, 0});
  expect_near(bar.point(1, 2), {0, 6, 0});
  EXPECT_EQ(parse_job(to_json(bar.job), "again", "/").value(), bar.job);
  EXPECT_THAT(error_of({}, R"(, "nodes": {"bar": {"place": {"translate": [0, 5, 0]}}})"),
              HasSubstr("bar.glb: node \"bar\": follows its bones, expected `place` of these"));
}

TEST(GltfShapes, PointsAreCarriedOnTheirTriangle) {
  const Loaded bar(BarParts{});
  const Pose now = pose_at(bar.scene, bar.job, 25), before = pose_at(bar.scene, bar.job, 1);
  const SurfacePlace tip{.triangle = 0, .u = 0, .v = 1};
  expect_near(carry_point(bar.scene, now, before, {0, tip, {0, 1, 0}}), {2, 1, 0});
  const SurfacePlace middle{.triangle = 0, .u = 0.5f, .v = 0.25f};
  expect_near(carry_point(bar.scene, now, before, {0, middle, {}}), {1.5f, 0.25f, 0});
  // As the viewer sees it: turned over where it was.
  expect_near(carry_normal(bar.scene, now, before, {0, tip, {0, 1, 0}}), {1, 0, 0});
  expect_near(carry_normal(bar.scene, now, before, {0, tip, {0, -1, 0}}), {-1, 0, 0});
}

TEST(GltfShapes, VerticesThatAreAlikeAtRestMayPart) {
  BarParts parts;
  parts.skinned = false;
  parts.morphed = true;
  // Flat at rest: the third vertex lies where the second one does.
  parts.positions = {0, 0, 0, 2, 0, 0, 2, 0, 0};
  const Loaded bar(parts);
  EXPECT_EQ(bar.scene.meshes[0].triangles.size(), 1u);
  expect_near(bar.point(1, 2), {2, 2, 100});
}

TEST(GltfShapes, WhatIsWrongHasAPlace) {
  const auto wrong = [](auto change, const std::string& message) {
    BarParts parts;
    parts.morphed = true;
    change(parts);
    EXPECT_THAT(error_of(parts), HasSubstr("bar.glb: " + message));
  };
  const std::string primitive = "$.meshes[0].primitives[0]";
  wrong([](BarParts& p) { p.joints[8] = 2; },
        primitive + ".JOINTS_0: expected joints below 2, as the skin has, found 2");
  wrong([](BarParts& p) { p.weights.resize(8); },
        primitive + ".WEIGHTS_0: expected one for each of 3 vertices, got 2");
  wrong([](BarParts& p) { p.inverse_binds.resize(16); },
        "$.skins[0].inverseBindMatrices: expected one for each of 2 joints, got 1");
  wrong([](BarParts& p) { p.target.resize(6); },
        primitive + ".targets[0].POSITION: expected one for each of 3 vertices, got 2");
  wrong(
      [](BarParts& p) {
        p.weight_values = {0, 1, 2};
      },
      "$.accessors[9]: expected 2 numbers for an animation, got 3");
}

TEST(GltfShapes, SkinsThatAreNone) {
  const auto error = [](const std::string& skins, const std::string& nodes) {
    test::GltfWriter w;
    w.add(test::kTriangle, "VEC3", 3);
    const auto mesh = load_mesh(
        test::write_test_file(
            "skins.glb", w.glb("\"nodes\":[{\"mesh\":0}" + nodes + "]," +
                               test::mesh_json(R"("POSITION":0)") + ",\"skins\":[" + skins + "]")),
        true);
    return mesh ? "none" : mesh.error().message;
  };
  EXPECT_THAT(error("{}", ""), HasSubstr("$.skins[0].joints: expected at least one joint"));
  EXPECT_THAT(error(R"({"joints":[7]})", ""),
              HasSubstr("$.skins[0].joints[0]: expected an index below 1, got 7"));
  EXPECT_THAT(error(R"({"joints":[0,0]})", ""),
              HasSubstr("$.skins[0].joints[1]: a joint of the skin already"));
  EXPECT_THAT(error(R"({"joints":[1,2]})", R"(,{"children":[2]},{"children":[1]})"),
              HasSubstr("node 1 is its own ancestor"));
}

}  // namespace
}  // namespace baton
