#include "common/scene/settle/settle_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/job/motion.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "common/scene/pose.h"
#include "common/scene/scene_warnings.h"
#include "common/scene/settle/settle_motion.h"
#include "tests/support/gltf_files.h"
#include "tests/support/gltf_jobs.h"
#include "tests/support/mesh_files.h"

namespace baton {
namespace {

using test::error_of;
using test::GltfWriter;
using test::job_of;
using test::settled;
using test::still_set;
using test::write_test_file;
using testing::HasSubstr;

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_NEAR(a.x, b.x, 1e-5f);
  EXPECT_NEAR(a.y, b.y, 1e-5f);
  EXPECT_NEAR(a.z, b.z, 1e-5f);
}

TEST(SettleScene, NodesBecomeObjectsThatShareMeshes) {
  const JobSpec given = job_of(still_set());
  EXPECT_EQ(parse_job(to_json(given), "again", "/").value(), given);
  EXPECT_FALSE(is_settled(given));
  const JobSpec job = settled(given);
  EXPECT_TRUE(is_settled(job));
  EXPECT_EQ(parse_job(to_json(job), "again", "/").value(), job);
  EXPECT_FALSE(moves(job));

  EXPECT_EQ(job.scene.meshes.size(), 2u);
  ASSERT_EQ(job.scene.objects.size(), 4u);
  EXPECT_EQ(job.scene.objects[0].mesh, job.scene.objects[2].mesh);
  EXPECT_EQ(job.scene.objects[0].material, "stone");
  EXPECT_EQ(job.scene.objects[1].material, "leaf");
  const MaterialSpec& stone = job.scene.materials.at("stone");
  EXPECT_EQ(stone.kind, MaterialKind::metallic_roughness);
  EXPECT_EQ(stone.base_color, (Rgb{0.5f, 0.25f, 0.125f}));
  EXPECT_EQ(stone.metallic, 0.5f);
  EXPECT_EQ(stone.roughness, 0.02f);  // the least that a job takes
  EXPECT_EQ(job.scene.materials.at("leaf").metallic, 1);

  const auto scene = load_scene(job);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes.size(), 2u);
  ASSERT_EQ(scene->instances.size(), 4u);
  expect_near(scene->instances[0].to_world.point({1, 0, 0}), {0, 0, 0});
  expect_near(scene->instances[2].to_world.point({1, 0, 0}), {2, 2, 0});

  // The file's camera, as the job has none.
  expect_near(job.camera.position, {0, 0, 4});
  expect_near(job.camera.look_at, {0, 0, 3});
  EXPECT_NEAR(job.camera.vertical_fov_deg, 0.8f * 180 / kPi, 1e-3f);
}

TEST(SettleScene, TheJobSaysOtherwiseByName) {
  const std::string file = still_set();
  const std::string mesh = write_test_file("own.off", test::kSquareOff);
  const JobSpec job = settled(job_of(
      file,
      R"(, "nodes": {"tree": {"material": "gold", "catcher": true}, "left": {"visible": false},
      "right": {"place": {"translate": [0, 0, 7], "rotateDeg": [0, 0, 90], "scale": 2}}}},
      "materials": {"gold": {"type": "diffuse"}, "stone": {"type": "diffuse", "color": [1, 0, 0]}},
      "meshes": {"own": ")" +
          mesh + R"("}, "objects": [{"mesh": "own", "material": "leaf"}])",
      R"(, "camera": {"position": [0, 9, 0], "lookAt": [0, 0, 1]})"));
  ASSERT_EQ(job.scene.objects.size(), 3u);
  EXPECT_EQ(job.scene.objects[0].mesh, "own");
  EXPECT_EQ(job.scene.objects[0].material, "leaf");
  EXPECT_EQ(job.scene.objects[1].material, "gold");
  EXPECT_FALSE(job.scene.objects[0].catcher);
  EXPECT_TRUE(job.scene.objects[1].catcher);
  EXPECT_EQ(parse_job(to_json(job), "again", "/").value(), job);
  EXPECT_EQ(job.scene.materials.at("stone").kind, MaterialKind::diffuse);
  EXPECT_EQ(job.camera.position, (Vec3{0, 9, 0}));
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(scene->has_catcher);
  // x doubled becomes y; the parent moves by 1.
  expect_near(scene->instances[1].to_world.point({1, 0, 0}), {1, 2, 7});
}

TEST(SettleScene, NamesThatAreNotThereAreErrors) {
  const std::string file = still_set();
  EXPECT_THAT(error_of(job_of(file, R"(, "nodes": {"lift": {"visible": false}}})")),
              HasSubstr("still.glb: no node \"lift\"; did you mean \"left\"?"));
  EXPECT_THAT(error_of(job_of(file, R"(, "nodes": {"left": {"material": "wood"}}})")),
              HasSubstr("no material \"wood\""));
  EXPECT_THAT(error_of(job_of(file, "", R"(, "camera": {"node": "tree"})")),
              HasSubstr("node \"tree\" holds no camera"));
  EXPECT_THAT(error_of(job_of(file, "", R"(, "sampling": {"method": "mis", "byMaterial":
                                          {"sand": {"method": "brdf"}}})")),
              HasSubstr("sampling.byMaterial: no material \"sand\""));
  EXPECT_EQ(error_of(job_of(file, "", R"(, "sampling": {"method": "mis", "byMaterial":
                                          {"leaf": {"method": "brdf"}}})")),
            "none");
}

/// A file of one triangle whose material has this extension, and two images.
std::string coated_file(const std::string& coat) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  return write_test_file("coated.glb", w.glb(R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
    "images":[{"uri":"a.png"},{"uri":"b.png"}],"textures":[{"source":1},{"source":0}],
    "extensionsUsed":["KHR_materials_clearcoat"],"extensionsRequired":["KHR_materials_clearcoat"],
    "materials":[{"name":"paint","extensions":{"KHR_materials_clearcoat":)" +
                                             coat + "}}]"));
}

TEST(SettleScene, ReadsCoats) {
  const std::string camera =
      R"(, "camera": {"position": [0, 0, 4], "lookAt": [0, 0, 0], "verticalFovDeg": 30})";
  const auto coat_of = [&](const std::string& coat) {
    return settled(job_of(coated_file(coat), "", camera)).scene.materials.at("paint");
  };
  const MaterialSpec plain = coat_of(R"({"clearcoatFactor":0.75,"clearcoatRoughnessFactor":0.25})");
  EXPECT_EQ(plain.clearcoat, 0.75f);
  EXPECT_EQ(plain.clearcoat_roughness, 0.25f);
  EXPECT_FALSE(plain.clearcoat_texture || plain.clearcoat_roughness_texture);
  EXPECT_EQ(coat_of(R"({"clearcoatFactor":1})").clearcoat_roughness, 0.02f);
  // Without a factor there is no coat, whatever else is said of it.
  const MaterialSpec none = coat_of(R"({"clearcoatTexture":{"index":0}})");
  EXPECT_FALSE(none.clearcoat || none.clearcoat_roughness || none.clearcoat_texture);

  const std::string textured = R"({"clearcoatFactor":1,"clearcoatTexture":{"index":0},
      "clearcoatRoughnessFactor":0.5,"clearcoatRoughnessTexture":{"index":1,"texCoord":1},
      "clearcoatNormalTexture":{"index":0,"scale":0.5}})";
  const JobSpec job = settled(job_of(coated_file(textured), "", camera));
  const MaterialSpec& paint = job.scene.materials.at("paint");
  ASSERT_TRUE(paint.clearcoat_texture && paint.clearcoat_roughness_texture);
  EXPECT_TRUE(paint.clearcoat_texture->file.ends_with("b.png"));
  EXPECT_TRUE(paint.clearcoat_roughness_texture->file.ends_with("a.png"));
  EXPECT_EQ(paint.clearcoat_roughness_texture->uv, 1);
  ASSERT_TRUE(paint.clearcoat_normal_texture);
  EXPECT_TRUE(paint.clearcoat_normal_texture->file.ends_with("b.png"));
  EXPECT_EQ(paint.clearcoat_normal_texture->strength, 0.5f);
  EXPECT_THAT(scene_warnings(job), testing::IsEmpty());
}

/// Node "spun" turns (animation 1), its parent "cart" goes along x (animation 2), "hop" jumps by
/// steps, "glide" follows a spline, "eye" below "cart" is a camera. Times are 1/2, 1 and 2 seconds.
std::string moving_set() {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  const int times = w.add(std::vector<float>{0.5f, 1, 2}, "SCALAR", 1);
  const float h = std::sqrt(0.5f);
  const int turns = w.add(std::vector<float>{0, 0, 0, 1, 0, 0, h, h, 0, 0, 1, 0}, "VEC4", 4);
  const int places = w.add(std::vector<float>{0, 0, 0, 2, 0, 0, 6, 0, 0}, "VEC3", 3);
  // In-tangent, value, out-tangent.
  const int spline = w.add(std::vector<float>{0, 0, 0, 0, 0, 0, 0, 2, 0,  //
                                              0, 2, 0, 0, 1, 0, 0, 0, 0,  //
                                              0, 0, 0, 0, 1, 0, 0, 0, 0},
                           "VEC3", 3);
  const auto animation = [&](int node, const std::string& path, int output,
                             const std::string& curve) {
    return R"({"channels":[{"sampler":0,"target":{"node":)" + std::to_string(node) +
           ",\"path\":\"" + path + R"("}}],"samplers":[{"input":)" + std::to_string(times) +
           ",\"output\":" + std::to_string(output) + ",\"interpolation\":\"" + curve + "\"}]}";
  };
  return write_test_file("moving.glb",
                         w.glb(R"("scenes":[{"nodes":[0,2,3,5]}],
    "nodes":[{"name":"cart","children":[1,4]},{"name":"spun","mesh":0},{"name":"hop","mesh":0},
             {"name":"glide","mesh":0},{"name":"eye","camera":0,"translation":[0,0,4]},
             {"name":"still","mesh":0}],
    "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"animations":[)" +
                               animation(1, "rotation", turns, "LINEAR") + "," +
                               animation(0, "translation", places, "LINEAR") + "," +
                               animation(2, "translation", places, "STEP") + "," +
                               animation(3, "translation", spline, "CUBICSPLINE") + "]"));
}

/// Where instance `i` of a job has its origin, and its x axis, in a frame.
Transform placed(const JobSpec& job, std::size_t i, double frame) {
  const auto scene = load_scene(job);
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  return pose_at(*scene, job, frame).instances.at(i).to_world;
}

TEST(SettleScene, AllAnimationsAndAllCurvesMove) {
  // Four frames a second: frame 3 shows 0.75 s, as Blender writes them.
  JobSpec job = job_of(moving_set(), R"(, "fps": 4})");
  job.frames = parse_frames("1-4,6,8-9").value();
  job = settled(job);
  ASSERT_EQ(job.scene.objects.size(), 4u);
  EXPECT_EQ(job.scene.materials.at("glTF default").metallic, 1);
  const float h = std::sqrt(0.5f);
  // Linear, with the parent's animation on top: a quarter of a turn from 0.5 s to 1 s.
  expect_near(placed(job, 2, 2).offset, {0, 0, 0});
  expect_near(placed(job, 3, 3).offset, {1, 0, 0});
  const float eighth = kPi / 4;
  expect_near(placed(job, 3, 3).linear * Vec3{1, 0, 0}, {std::cos(eighth), std::sin(eighth), 0});
  expect_near(placed(job, 3, 4).linear * Vec3{1, 0, 0}, {0, 1, 0});
  expect_near(placed(job, 3, 6).linear * Vec3{1, 0, 0}, {-h, h, 0});
  // Step: holds until the next key. Before the first and after the last key all hold.
  expect_near(placed(job, 0, 1).offset, {0, 0, 0});
  expect_near(placed(job, 0, 3).offset, {0, 0, 0});
  expect_near(placed(job, 0, 4).offset, {2, 0, 0});
  expect_near(placed(job, 0, 6).offset, {2, 0, 0});
  expect_near(placed(job, 0, 9).offset, {6, 0, 0});
  // Spline from 0 to 1 over half a second with slopes of 2: a straight line; then flat.
  expect_near(placed(job, 1, 3).offset, {0, 0.5f, 0});
  expect_near(placed(job, 1, 6).offset, {0, 1, 0});
  // The camera rides along.
  expect_near(camera_at(job, 4).position, {2, 0, 4});
}

TEST(SettleScene, TimeZeroIsStartFrame) {
  JobSpec job = job_of(moving_set(), R"(, "fps": 4, "startFrame": 101})");
  job.frames = {FrameNumber(105)};
  EXPECT_NEAR(placed(settled(job), 0, 105).offset.x, 2, 1e-5f);
  GltfMotion motion{.file = moving_set(), .node = "cart", .fps = 4};
  job = {};
  job.frames = {FrameNumber(4)};
  job.scene.objects.push_back({.mesh = "m", .material = "d"});
  job.scene.objects[0].gltf = motion;
  job.scene.meshes["m"].path = write_test_file("m.off", test::kSquareOff);
  job.scene.materials["d"] = {};
  EXPECT_NEAR(placed(settled(job), 0, 4).offset.x, 2, 1e-5f);
  job.scene.objects[0].gltf->node = "still";
  EXPECT_THAT(error_of(job), HasSubstr("moving.glb: node \"still\": no animation moves it"));
}

TEST(SettleScene, OddAnimationsAreErrors) {
  const auto error = [](const std::vector<float>& times, const std::vector<float>& places) {
    GltfWriter w;
    w.add(test::kTriangle, "VEC3", 3);
    w.add(times, "SCALAR", 1);
    w.add(places, "VEC3", 3);
    return error_of(job_of(write_test_file("odd.glb", w.glb(R"("nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],
                     "samplers":[{"input":1,"output":2}]}])")),
                           "", R"(, "camera": {"position": [0, 0, 9]})"));
  };
  EXPECT_EQ(error({0, 1}, {1, 1, 1, 2, 2, 2}), "none");
  EXPECT_THAT(error({}, {}), HasSubstr("$.accessors[1]: expected the times of an animation"));
  EXPECT_THAT(error({0, 1}, {1, 1, 1}), HasSubstr("$.accessors[2]: expected 6 numbers"));
  EXPECT_EQ(error({0, 0.1f}, {1, 1, 1, 0, 0, 0}), "none");
}

TEST(SettleScene, BuffersBesideTheFileBelongToTheJob) {
  write_test_file("side.bin",
                  std::string_view(reinterpret_cast<const char*>(test::kTriangle.data()), 36));
  const std::string file = write_test_file("side.gltf", R"({"asset":{"version":"2.0"},
    "buffers":[{"byteLength":36,"uri":"side.bin"}],"bufferViews":[{"buffer":0,"byteLength":36}],
    "accessors":[{"bufferView":0,"count":3,"type":"VEC3","componentType":5126}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]})");
  JobSpec job = job_of(file, "", R"(, "camera": {"position": [0, 0, 9]})");
  ASSERT_TRUE(settle_scene(job));
  ASSERT_EQ(job.scene.files.size(), 1u);
  EXPECT_THAT(asset_paths(job), testing::Contains(HasSubstr("side.bin")));
}

}  // namespace
}  // namespace baton
