// One part of a glTF file that cannot be used spoils nothing else, and is told of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/mesh_loader.h"
#include "common/scene/object_view.h"
#include "common/scene/pose.h"
#include "common/scene/scene_warnings.h"
#include "tests/support/deforming_files.h"
#include "tests/support/gltf_jobs.h"

namespace baton {
namespace {

using test::GltfWriter;
using test::write_test_file;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr const char* kCamera = R"(, "camera": {"position": [0, 0, 9], "lookAt": [0, 0, 0]})";

/// A settled job with its scene and all that is said of both.
struct Loaded {
  explicit Loaded(const std::string& bytes) {
    std::vector<std::string> left_out;
    auto settled =
        settle_motion(test::job_of(write_test_file("parts.glb", bytes), "", kCamera), &left_out);
    EXPECT_TRUE(settled) << (settled ? "" : settled.error().message);
    if (!settled) return;
    job = *settled;
    auto loaded = load_scene(job);
    EXPECT_TRUE(loaded) << (loaded ? "" : loaded.error().message);
    if (!loaded) return;
    scene = *loaded;
    said = geometry_warnings(job, scene);
    for (const auto& lines : {scene_warnings(job.scene), left_out})
      said.insert(said.end(), lines.begin(), lines.end());
  }

  JobSpec job;
  Scene scene;
  std::vector<std::string> said;
};

/// A pyramid of four faces around (0, 0, 1) whose normals lean outward, and a vertex that no face
/// uses; the normal of vertex `bad` is `normal`.
std::string pyramid_glb(std::size_t bad, const std::array<float, 3>& normal,
                        const std::string& more_attributes = "", bool with_tangents = false) {
  GltfWriter w;
  w.add(std::vector<float>{0, 0, 1, 1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -1, 0, 5, 5, 5}, "VEC3", 3);
  std::vector<float> normals{0,     0, 1,    0.6f, 0,     0.8f, 0, 0.6f, 0.8f,
                             -0.6f, 0, 0.8f, 0,    -0.6f, 0.8f, 1, 0,    0};
  std::ranges::copy(normal, normals.begin() + static_cast<std::ptrdiff_t>(3 * bad));
  w.add(normals, "VEC3", 3);
  w.add(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 1}, "SCALAR", 1);
  std::vector<float> tangents;
  for (int i = 0; i < 6; ++i) tangents.insert(tangents.end(), {0, 1, 0, 1});
  if (with_tangents)
    std::ranges::copy(normal, tangents.begin() + static_cast<std::ptrdiff_t>(4 * bad));
  w.add(tangents, "VEC4", 4);
  w.add(std::vector<float>{0, 0, 1, 0, 0, -1, -1, 0, 0, 1, 0, 0}, "VEC2", 2);
  return w.glb(R"("nodes":[{"mesh":0}],)" +
               test::mesh_json(R"("POSITION":0,"NORMAL":1)" + more_attributes,
                               R"(,"indices":2,"material":0)") +
               R"(,"materials":[{"normalTexture":{"index":0}}],"textures":[{}])");
}

TEST(GltfParts, OneBadNormalIsMadeAnewAlone) {
  const Loaded good(pyramid_glb(0, {0, 0, 1}));
  EXPECT_THAT(good.said, testing::Each(testing::Not(HasSubstr("normal:"))));
  for (const std::array<float, 3>& bad :
       {std::array{0.0f, 0.0f, 0.0f}, {kNan, 0, 1}, {0, INFINITY, 0}}) {
    const Loaded one(pyramid_glb(0, bad));
    const TriangleMesh& mesh = one.scene.meshes.at(0);
    ASSERT_EQ(mesh.normals.size(), good.scene.meshes.at(0).normals.size());
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
      // The top faces up either way, by symmetry.
      EXPECT_NEAR(length(mesh.normals[i] - good.scene.meshes[0].normals[i]), 0, 1e-6f) << i;
    }
    EXPECT_THAT(one.said, Contains(HasSubstr("parts.glb: 1 vertices have no usable normal")));
  }
  // Of a vertex that no face uses there is nothing to say.
  const Loaded unused(pyramid_glb(5, {0, 0, 0}));
  EXPECT_EQ(unused.scene.meshes[0].normals, good.scene.meshes[0].normals);
  EXPECT_THAT(unused.said, testing::Each(testing::Not(HasSubstr("normal:"))));
}

TEST(GltfParts, OneBadTangentIsMadeAnewAlone) {
  // One that lies along its normal is none either.
  for (const std::array<float, 3>& bad :
       {std::array{0.0f, 0.0f, 0.0f}, {0, kNan, 0}, {0.6f, 0, 0.8f}}) {
    const Loaded one(pyramid_glb(1, bad, R"(,"TANGENT":3,"TEXCOORD_0":4)", true));
    const TriangleMesh& mesh = one.scene.meshes.at(0);
    ASSERT_EQ(mesh.tangents.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
      if (mesh.positions[i] == Vec3{1, 0, 0}) continue;
      EXPECT_EQ(mesh.tangents[i].direction, (Vec3{0, 1, 0}));
    }
    for (const Tangent& tangent : mesh.tangents) EXPECT_NEAR(length(tangent.direction), 1, 1e-6f);
    EXPECT_THAT(one.said, Contains(HasSubstr("1 vertices have no usable tangent")));
  }
}

TEST(GltfParts, APartWithoutNormalsLeavesThoseOfOthers) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 0.6f, 0.8f, 0, 0.6f, 0.8f, 0, 0.6f, 0.8f}, "VEC3", 3);
  w.add(std::vector<float>{0, 0, 5, 1, 0, 5, 0, 1, 5}, "VEC3", 3);
  const auto mesh =
      load_mesh(write_test_file("two.glb", w.glb(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[
        {"attributes":{"POSITION":0,"NORMAL":1}},{"attributes":{"POSITION":2}}]}])")),
                true);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->normals.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(mesh->normals[i].z, mesh->positions[i].z == 5 ? 1 : 0.8f, 1e-6f);
  EXPECT_EQ(mesh->repairs.normals, 3u);
}

TEST(GltfParts, PartsThatHaveNoSurfaceAreLeftOutAndSaid) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 0, 0, 1, 1, 1, 2, 2, 2}, "VEC3", 3);  // on a line
  const std::string good = R"({"attributes":{"POSITION":0}})",
                    flat = R"({"attributes":{"POSITION":1}})";
  const auto file = [&](const std::string& parts) {
    return w.glb(R"("nodes":[{"mesh":0},{"mesh":0}],"meshes":[{"primitives":[)" + parts + "]}]");
  };
  const Loaded degenerate(file(good + "," + flat));
  EXPECT_EQ(degenerate.job.scene.objects.size(), 2u);
  EXPECT_THAT(degenerate.said,
              testing::ElementsAre(
                  HasSubstr("parts.glb: $.meshes[0].primitives[1] has no triangles with area")));
  const Loaded lines(file(good + R"(,{"attributes":{"POSITION":1},"mode":1},)" +
                          R"({"attributes":{"POSITION":1},"mode":0})"));
  EXPECT_THAT(lines.said, testing::ElementsAre(HasSubstr("2 parts are points or lines")));
  EXPECT_THAT(Loaded(file(good)).said, IsEmpty());
}

TEST(GltfParts, ARootThatHasAParentIsShownOnceWhereThatHasIt) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  const auto at = [&](const std::string& roots) {
    return Loaded(w.glb("\"scenes\":[{\"nodes\":" + roots + R"(}],
      "nodes":[{"mesh":0,"translation":[0,1,0]},{"children":[0],"translation":[1,0,0]}],)" +
                        test::mesh_json("\"POSITION\":0")));
  };
  for (const char* roots : {"[0]", "[0,1]", "[1,0]", "[0,0]"}) {
    const Loaded file = at(roots);
    ASSERT_EQ(file.scene.instances.size(), 1u) << roots;
    EXPECT_EQ(file.scene.instances[0].to_world.offset, (Vec3{1, 1, 0})) << roots;
    EXPECT_THAT(file.said, Contains(HasSubstr("a node that is another's child is shown"))) << roots;
  }
  EXPECT_THAT(at("[1]").said, IsEmpty());
}

TEST(GltfParts, AVertexThatNoJointHoldsFollowsTheFirst) {
  test::BarParts parts;
  parts.weights[8] = 0;  // the third vertex, which the tip turns otherwise
  const Loaded bar(test::bar_glb(parts));
  const Pose pose = pose_at(bar.scene, bar.job, 1);
  EXPECT_EQ(vertices_of(bar.scene, pose.shapes, 0).positions[2], (Vec3{2, 1, 0}));
  EXPECT_THAT(bar.said, Contains(HasSubstr("1 vertices are held by no joint")));
  // A part without joints below a skin, likewise.
  parts.skinned = false;
  parts.node_more = R"(,"skin":0)";
  parts.more = R"(,"skins":[{"joints":[1]}])";
  EXPECT_THAT(Loaded(test::bar_glb(parts)).said, Contains(HasSubstr("3 vertices are held by no")));
}

TEST(GltfParts, PartsMayHaveFewerTargetsAndOtherWeights) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
  const auto file = [&](const std::string& first, const std::string& second,
                        const std::string& weights) {
    const auto part = [](const std::string& targets) {
      return R"({"attributes":{"POSITION":0},"targets":[)" + targets + "]}";
    };
    return w.glb(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[)" + part(first) + "," +
                 part(second) + "],\"weights\":" + weights + "}]");
  };
  const std::string one = R"({"POSITION":1})", two = one + "," + one;
  for (const bool first : {true, false}) {
    const Loaded mixed(first ? file(one, two, "[1,2]") : file(two, one, "[1,2]"));
    EXPECT_EQ(mixed.scene.meshes.at(first ? 0 : 1).positions[0].z, 1);
    EXPECT_EQ(mixed.scene.meshes.at(first ? 1 : 0).positions[0].z, 3);
    EXPECT_THAT(mixed.said, Contains(HasSubstr("1 of 2 parts have fewer than 2 morph targets")));
  }
  const Loaded few(file(two, two, "[4]")), many(file(one, one, "[4,5,6]"));
  for (const Loaded* loaded : {&few, &many}) {
    EXPECT_EQ(loaded->scene.meshes.at(0).positions[0].z, 4);
    EXPECT_THAT(loaded->said, Contains(HasSubstr("$.meshes[0].weights: ")));
  }
}

TEST(GltfParts, AnimatedWeightsWithoutTargetsMoveNothing) {
  test::BarParts parts;
  parts.more = R"(,"animations":[{"samplers":[{"input":7,"output":9}],
                   "channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}]}])";
  parts.animated = false;
  EXPECT_THAT(Loaded(test::bar_glb(parts)).said,
              Contains(HasSubstr("1 of its animations move weights of nodes without")));
}

}  // namespace
}  // namespace baton
