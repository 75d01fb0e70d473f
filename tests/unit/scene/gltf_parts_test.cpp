// One part of a glTF file that cannot be used spoils nothing else, and is told of.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/job/motion.h"
#include "common/scene/gltf/meshes.h"
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
    for (const auto& lines : {scene_warnings(job), left_out})
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

TEST(GltfParts, WhatSaysNothingIsLeftOutAndSaid) {
  // Spare indices, with a list and without.
  GltfWriter w;
  w.add(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, "VEC3", 3);
  w.add(std::vector<std::uint16_t>{0, 1, 2, 2, 1}, "SCALAR", 1);
  const auto path = write_test_file(
      "spare.glb", w.glb(R"("nodes":[{"mesh":0,"rotation":[0,0,0,0]}],"meshes":[{"primitives":[
        {"attributes":{"POSITION":0},"indices":1},{"attributes":{"POSITION":0}}]}],
        "animations":[{"samplers":[{"input":1,"output":1,"interpolation":"CUBIC"}],"channels":[]}])"));
  const auto mesh = load_mesh(path, true);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->repairs.spare_indices, 3u);
  const auto document = gltf::read_document(path);
  ASSERT_TRUE(document) << document.error().message;
  EXPECT_THAT((*document)->notes,
              testing::IsSupersetOf({HasSubstr("1 nodes have a rotation of zeros"),
                                     HasSubstr("interpolations CUBIC are not known")}));
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
  EXPECT_THAT(lines.said, testing::ElementsAre(
                              HasSubstr("parts.glb: not shown: 1 part of points and 1 of lines")));
  EXPECT_THAT(Loaded(file(good)).said, IsEmpty());
}

TEST(GltfParts, AFileOfPointsAndLinesAloneSaysWhatItHas) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  const auto file = [&](const std::vector<int>& modes) {
    std::string parts;
    for (const int mode : modes)
      parts += (parts.empty() ? "" : ",") +
               (R"({"attributes":{"POSITION":0},"mode":)" + std::to_string(mode) + "}");
    return write_test_file(
        "cloud.glb", w.glb(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[)" + parts + "]}]"));
  };
  for (const auto& [modes, found] : {std::pair{std::vector{0}, "1 part of points"},
                                     {std::vector{0, 0}, "2 parts of points"},
                                     {std::vector{1, 2, 3}, "3 parts of lines"},
                                     {std::vector{3, 0, 1}, "1 part of points and 2 of lines"}}) {
    const std::string path = file(modes);
    const std::string what =
        fmt::format("cloud.glb: nothing to show: it has {} and no triangles", found);
    EXPECT_THAT(test::error_of(test::job_of(path, "", kCamera)), HasSubstr(what));
    EXPECT_THAT(load_mesh(path, true).error().message, HasSubstr(what));
    const auto document = gltf::read_document(path);
    ASSERT_TRUE(document);
    EXPECT_THAT(gltf::primitive_mesh(**document, {.path = path, .mesh = 0}).error().message,
                HasSubstr("$.meshes[0].primitives[0]: expected triangles, found points or lines"));
    // Beside a ground it is told of.
    std::vector<std::string> left_out;
    const auto settled = settle_motion(
        test::job_of(path,
                     R"( , "materials": {"m": {"type": "diffuse"}}, "ground": {"material": "m"})",
                     kCamera),
        &left_out);
    ASSERT_TRUE(settled) << settled.error().message;
    EXPECT_THAT(left_out,
                testing::ElementsAre(HasSubstr(std::string("not shown: ") + found + ";")));
  }
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

/// A triangle and another one beside it, the first of which has a bad number somewhere.
std::string two_triangles(const std::vector<float>& positions, const std::vector<float>& uvs) {
  GltfWriter w;
  w.add(positions, "VEC3", 3);
  w.add(uvs, "VEC2", 2);
  return w.glb(R"("nodes":[{"mesh":0}],)" + test::mesh_json(R"("POSITION":0,"TEXCOORD_0":1)"));
}

TEST(GltfParts, APlaceThatIsNotFiniteTakesItsFacesAlone) {
  std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0, 5, 0, 0, 6, 0, 0, 5, 1, 0};
  std::vector<float> uvs{0, 0, 1, 0, 0, 1, 0.5f, 0.5f, 1, 0.5f, 0.5f, 1};
  for (const float bad : {kNan, INFINITY, -INFINITY}) {
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<float> odd = positions;
      odd[3 + c] = bad;
      const Loaded file(two_triangles(odd, uvs));
      const TriangleMesh& mesh = file.scene.meshes.at(0);
      EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{5, 0, 0}, {6, 0, 0}, {5, 1, 0}}));
      EXPECT_THAT(file.said, Contains(HasSubstr("parts.glb: 1 faces have a corner whose place")));
    }
    std::vector<float> odd = uvs;
    odd[3] = bad;
    const Loaded file(two_triangles(positions, odd));
    const TriangleMesh& mesh = file.scene.meshes.at(0);
    EXPECT_EQ(mesh.uvs[0],
              (std::vector<Uv>{{0, 0}, {0, 0}, {0, 1}, {0.5f, 0.5f}, {1, 0.5f}, {0.5f, 1}}));
    EXPECT_THAT(file.said, Contains(HasSubstr("1 corners have no usable texture coordinates")));
  }
  EXPECT_THAT(Loaded(two_triangles(positions, uvs)).said, IsEmpty());
}

TEST(GltfParts, AStepOfATargetThatIsNotFiniteMovesNothing) {
  for (const bool animated : {true, false}) {
    test::BarParts parts;
    parts.skinned = false;
    parts.morphed = true;
    parts.animated = animated;
    parts.mesh_more = R"(,"weights":[1])";
    parts.target = {kNan, 0, 0, 0, 0, 3, 0, 2, 0};
    parts.target_normals[7] = -INFINITY;
    const Loaded bar(test::bar_glb(parts));
    const Pose pose = pose_at(bar.scene, bar.job, 24);
    const MeshVertices seen = vertices_of(bar.scene, pose.shapes, 0);
    EXPECT_EQ(seen.positions[0], (Vec3{0, 0, 0})) << animated;
    EXPECT_EQ(seen.positions[1], (Vec3{2, 0, 3})) << animated;
    EXPECT_EQ(seen.positions[2], (Vec3{2, 3, 0})) << animated;
    EXPECT_EQ(seen.normals[2], (Vec3{1, 0, 0})) << animated;
    EXPECT_THAT(bar.said, Contains(HasSubstr("2 steps of morph targets are not finite")));
  }
}

TEST(GltfParts, AWeightThatCannotBeUsedHoldsNothing) {
  for (const float bad : {kNan, INFINITY, -0.5f}) {
    test::BarParts parts;
    parts.weights[4] = bad;  // of the second vertex; the tip holds the rest of it
    const Loaded bar(test::bar_glb(parts));
    const Pose pose = pose_at(bar.scene, bar.job, 24);
    const Vec3 seen = vertices_of(bar.scene, pose.shapes, 0).positions[1];
    EXPECT_NEAR(length(seen - Vec3{1, 1, 0}), 0, 1e-6f) << "as the tip turns it";
    EXPECT_THAT(bar.said,
                testing::ElementsAre(HasSubstr("1 weights of joints are below 0 or not")));
  }
  test::BarParts parts;
  parts.inverse_binds[17] = kNan;  // of the tip
  const Loaded bar(test::bar_glb(parts));
  const Pose pose = pose_at(bar.scene, bar.job, 24);
  EXPECT_EQ(vertices_of(bar.scene, pose.shapes, 0).positions[1], (Vec3{2, 0, 0}));
  EXPECT_THAT(bar.said, Contains(HasSubstr("2 weights of joints")));
  EXPECT_THAT(bar.said, Contains(HasSubstr("1 vertices are held by no joint")));
}

/// Three repetitions of a triangle, by their numbers.
std::string repeated_glb(const std::vector<float>& places, const std::vector<float>& scales,
                         const std::string& name = "grass") {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(places, "VEC3", 3);
  w.add(scales, "VEC3", 3);
  return w.glb(R"("nodes":[{"name":")" + name +
               R"(","mesh":0,"extensions":{"EXT_mesh_gpu_instancing":
                 {"attributes":{"TRANSLATION":1,"SCALE":2}}}}],)" +
               test::mesh_json("\"POSITION\":0"));
}

TEST(GltfParts, ARepetitionThatIsNowhereIsLeftOutAlone) {
  const std::vector<float> places{0, 0, 0, 2, 0, 0, 4, 0, 0}, scales(9, 1.0f);
  for (const float bad : {kNan, INFINITY}) {
    for (const bool of_scale : {false, true}) {
      std::vector<float> odd_places = places, odd_scales = scales;
      (of_scale ? odd_scales : odd_places)[4] = bad;
      const Loaded file(repeated_glb(odd_places, odd_scales));
      ASSERT_EQ(file.scene.instances.size(), 2u);
      EXPECT_EQ(file.scene.instances[1].to_world.offset.x, 4);
      EXPECT_THAT(file.said, testing::ElementsAre(HasSubstr(
                                 "parts.glb: 1 of 3 instances of node \"grass\" has a place "
                                 "that is not finite: it is not there")));
      const auto whole =
          load_mesh(write_test_file("whole.glb", repeated_glb(odd_places, odd_scales)), true);
      ASSERT_TRUE(whole);
      EXPECT_EQ(whole->triangles.size(), 2u);
      EXPECT_EQ(whole->repairs.instances, 1u);
    }
  }
  EXPECT_THAT(Loaded(repeated_glb(places, scales)).said, IsEmpty());
}

TEST(GltfParts, RepetitionsWithoutVolumeAreCounted) {
  const std::vector<float> places{0, 0, 0, 2, 0, 0, 4, 0, 0};
  const auto said = [&](const std::vector<float>& scales) {
    const Loaded file(repeated_glb(places, scales));
    return file.said.empty() ? "" : file.said.front();
  };
  EXPECT_THAT(
      said({1, 1, 1, 0, 0, 0, 1, 1, 1}),
      HasSubstr("1 of 3 instances of node \"grass\" has a scale of 0 in all frames: it is"));
  EXPECT_THAT(
      said({1, 1, 0, 0, 0, 0, 1, 1, 1}),
      HasSubstr("2 of 3 instances of node \"grass\" have a scale of 0 in all frames: they"));
}

TEST(GltfParts, ObjectsAreCalledByTheirNodes) {
  const std::vector<float> aside{90, 0, 0, 92, 0, 0, 94, 0, 0}, scales(9, 1.0f);
  EXPECT_THAT(Loaded(repeated_glb(aside, scales, "far reed")).said,
              Contains(HasSubstr("object 2 (far reed) is outside of the picture")));
}

/// Where node "a" is at frames 1, 2, 3, with keys at seconds 1, 2 and 3 (frame n is second n).
struct Keyed {
  Keyed(const std::string& curve, const std::vector<float>& times,
        const std::vector<float>& values) {
    GltfWriter w;
    w.add(test::kTriangle, "VEC3", 3);
    w.add(times, "SCALAR", 1);
    w.add(values, "VEC3", 3);
    std::vector<std::string> left_out;
    const auto settled = settle_motion(
        test::job_of(
            write_test_file(
                "keys.glb",
                w.glb(
                    R"("nodes":[{"name":"a","mesh":0}],)" + test::mesh_json("\"POSITION\":0") +
                    R"(,"animations":[{"samplers":[{"input":1,"output":2,"interpolation":")" +
                    curve +
                    R"("}],"channels":[{"sampler":0,"target":{"node":0,"path":"translation"}}]}])")),
            R"(, "fps": 1})", kCamera),
        &left_out);
    EXPECT_TRUE(settled) << (settled ? "" : settled.error().message);
    if (!settled) return;
    for (const FrameNumber frame : settled->frames)
      x.push_back(
          object_motion_at(settled->scene.objects.at(0), KeyCurve::linear, frame.value()).offset.x);
    said = scene_warnings(*settled);
    said.insert(said.end(), left_out.begin(), left_out.end());
  }
  std::vector<float> x;
  std::vector<std::string> said;
};

TEST(GltfParts, AKeyThatIsNotFiniteIsLeftOut) {
  const std::vector<float> times{1, 2, 3}, values{1, 0, 0, 8, 0, 0, 3, 0, 0};
  for (const float bad : {kNan, INFINITY}) {
    for (const std::string curve : {"LINEAR", "STEP"}) {
      std::vector<float> odd_times = times, odd_values = values;
      odd_times[1] = odd_values[4] = bad;
      const std::vector<float> seen{1, curve == "STEP" ? 1.0f : 2.0f, 3};
      const Keyed by_time(curve, odd_times, values), by_value(curve, times, odd_values);
      for (const Keyed* keyed : {&by_time, &by_value}) {
        EXPECT_EQ(keyed->x, seen) << curve;
        EXPECT_THAT(keyed->said,
                    Contains(HasSubstr("1 keys of its animations have a time or value")));
      }
    }
  }
  const Keyed none("LINEAR", times, std::vector<float>(9, kNan));
  EXPECT_THAT(none.said, Contains(HasSubstr("1 curves of its animations have no usable key")));
  const Keyed unordered("LINEAR", {1, 3, 2}, {1, 0, 0, 3, 0, 0, 8, 0, 0});
  EXPECT_EQ(unordered.x, (std::vector<float>{1, 8, 3}));
  EXPECT_THAT(unordered.said, Contains(HasSubstr("1 keys of its animations are earlier than")));
  EXPECT_THAT(Keyed("LINEAR", times, values).said, IsEmpty());
}

TEST(GltfParts, ATangentOfAKeyThatIsNotFiniteIsNone) {
  // By key: tangent before, value, tangent behind.
  std::vector<float> values(27);
  values[3] = 1;
  values[12] = 8;
  values[21] = 3;
  const Keyed sound("CUBICSPLINE", {1, 2, 3}, values);
  values[0] = kNan;   // before the first
  values[24] = kNan;  // behind the last
  EXPECT_THAT(Keyed("CUBICSPLINE", {1, 2, 3}, values).said, IsEmpty()) << "they say nothing";
  values[9] = INFINITY;
  const Keyed mended("CUBICSPLINE", {1, 2, 3}, values);
  EXPECT_EQ(mended.x, sound.x);
  EXPECT_THAT(mended.said, Contains(HasSubstr("1 tangents of keys of its animations")));
}

TEST(GltfParts, PlacesOfOtherFormatsTakeTheirFacesAlone) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
      "end_header\n0 0 0\n1 0 0\n0 1 0\nnan 0 0\n3 0 1 2\n4 0 1 2 3\n";
  const std::string off = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 inf 0\n3 0 1 2\n4 0 1 2 3\n";
  const std::string obj =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 -inf\nvt 0 0\nvt nan 1\n"
      "f 1/1 2/1 3/2\nf 1/1 2/1 3/1 4/1\n";
  for (const auto& [name, text] : {std::pair{"n.ply", ply}, {"n.off", off}, {"n.obj", obj}}) {
    const auto mesh = load_mesh(write_test_file(name, text), true, true);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 1u) << name;
    EXPECT_EQ(mesh->repairs.nowhere, 1u) << name;
    for (const Vec3& p : mesh->positions) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z)) << name;
    if (std::string(name) != "n.obj") continue;
    EXPECT_EQ(mesh->repairs.uvs, 1u);
    EXPECT_EQ(mesh->uvs[0].back(), (Uv{0, 0}));
  }
}

}  // namespace
}  // namespace baton
