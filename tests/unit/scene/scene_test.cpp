#include "common/scene/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/scene/object_view.h"
#include "tests/support/mesh_files.h"

namespace baton {
namespace {

using testing::HasSubstr;

ObjectSpec object_of(const std::string& mesh, const std::string& material) {
  ObjectSpec object;
  object.mesh = mesh;
  object.material = material;
  return object;
}

JobSpec cube_job() {
  JobSpec job;
  job.scene.materials["grey"] = {};
  job.scene.meshes["cube"] = {test::write_test_file("scene_cube.off", test::kCubeOff), true};
  job.scene.objects.push_back(object_of("cube", "grey"));
  return job;
}

Instance only_instance(const JobSpec& job) {
  const auto scene = load_scene(job);
  EXPECT_TRUE(scene.ok()) << scene.error().message;
  return scene->instances.at(0);
}

void expect_point(const Vec3& actual, const Vec3& expected) {
  EXPECT_NEAR(actual.x, expected.x, 1e-5f);
  EXPECT_NEAR(actual.y, expected.y, 1e-5f);
  EXPECT_NEAR(actual.z, expected.z, 1e-5f);
}

TEST(Scene, ObjectsWhereFloatsAreCoarseAreSaid) {
  const auto said = [](const Vec3& place, float distance, float half = 1) {
    JobSpec job = cube_job();
    job.frames = {FrameNumber(1)};
    job.scene.objects[0].translate = place;
    job.scene.objects[0].scale = {half, half, half};
    job.camera.position = place + Vec3{0, 0, distance};
    job.camera.look_at = place;
    const auto scene = load_scene(job);
    EXPECT_TRUE(scene.ok()) << scene.error().message;
    return geometry_warnings(job, *scene);
  };
  const auto is_coarse =
      testing::Contains(HasSubstr("object 0 (cube) is so far from the origin, "));
  EXPECT_THAT(said({5e5f, 0, 5e6f}, 5), is_coarse);
  EXPECT_THAT(said({5e5f, 0, 5e6f}, 5), testing::Contains(HasSubstr("rounded to 0.5 units")));
  EXPECT_THAT(said({0, -3e5f, 0}, 5), is_coarse);
  EXPECT_THAT(said({3e3f, 0, 0}, 0.05f, 0.01f), is_coarse);
  for (const auto& [place, distance, half] : {std::tuple{Vec3{0, 0, 0}, 5.0f, 1.0f},
                                              {Vec3{100, 0, 30}, 5.0f, 1.0f},
                                              {Vec3{5e5f, 0, 5e6f}, 3e4f, 5e3f},
                                              {Vec3{0, 0, 0}, 0.5f, 1e5f}})
    EXPECT_THAT(said(place, distance, half), testing::Not(is_coarse)) << place.z << ' ' << half;
}

TEST(Scene, ScalesThenRotatesThenTranslates) {
  JobSpec job = cube_job();
  job.scene.objects[0].scale = {2, 3, 4};
  job.scene.objects[0].rotate_deg = {90, 90, 90};
  job.scene.objects[0].translate = {10, 20, 30};
  const Instance instance = only_instance(job);
  // x: y -> z, then y: z -> x, then z: x -> y.
  expect_point(instance.to_world.point({0, 1, 0}), {10, 23, 30});
  // x stays; y: x -> -z; stays.
  expect_point(instance.to_world.point({1, 0, 0}), {10, 20, 28});
  // x: z -> -y; stays; z: -y -> x.
  expect_point(instance.to_world.point({0, 0, 1}), {14, 20, 30});
}

TEST(Scene, FitsHeightAndStandsOnTheGround) {
  JobSpec job = cube_job();
  job.scene.objects[0].rotate_deg = {0, 0, 45};
  job.scene.objects[0].fit_height = 3.0f;
  job.scene.objects[0].place_on_ground = true;
  job.scene.objects[0].translate = {1, 0.5f, 0};
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok());
  float low = 1e9f;
  float high = -1e9f;
  for (const Vec3& p : scene->meshes[0].positions) {
    const float y = scene->instances[0].to_world.point(p).y;
    low = std::min(low, y);
    high = std::max(high, y);
  }
  EXPECT_NEAR(low, 0.5f, 1e-5f);
  EXPECT_NEAR(high, 3.5f, 1e-5f);
}

TEST(Scene, StandsUpAndIsCentred) {
  // A card of 2 x 0.5 x 4 whose file has another axis up, far off its origin.
  const std::string card =
      "OFF\n4 2 0\n10 20 30\n12 20 30\n10 20.5 30\n10 20 34\n3 0 1 2\n3 0 2 3\n";
  JobSpec job = cube_job();
  job.scene.meshes["cube"] = {test::write_test_file("scene_card.off", card), true};
  ObjectSpec& object = job.scene.objects[0];
  object.center = object.place_on_ground = true;
  object.translate = {1, 0, 7};
  for (const auto& [up, size] : {std::pair{UpAxis::y, Vec3{2, 0.5f, 4}},
                                 {UpAxis::z, Vec3{2, 4, 0.5f}},
                                 {UpAxis::x, Vec3{0.5f, 2, 4}}}) {
    object.up_axis = up;
    const auto scene = load_scene(job);
    ASSERT_TRUE(scene.ok());
    Vec3 low{1e9f, 1e9f, 1e9f}, high = low * -1.0f;
    for (const Vec3& position : scene->meshes[0].positions) {
      const Vec3 p = scene->instances[0].to_world.point(position);
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Vec3 extent = high - low, middle = (low + high) * 0.5f;
    EXPECT_NEAR(length(extent - size), 0, 1e-4f) << static_cast<int>(up);
    EXPECT_NEAR(middle.x, 1, 1e-4f);
    EXPECT_NEAR(middle.z, 7, 1e-4f);
    EXPECT_NEAR(low.y, 0, 1e-4f);
  }
  // What points up in the file points up in the world, and nothing is mirrored.
  object.up_axis = UpAxis::z;
  const Mat3 turned = only_instance(job).to_world.linear;
  EXPECT_GT((turned * Vec3{0, 0, 1}).y, 0.9f);
  EXPECT_GT(dot(cross(turned * Vec3{1, 0, 0}, turned * Vec3{0, 1, 0}), turned * Vec3{0, 0, 1}), 0);
}

TEST(Scene, NormalMatrixKeepsNormalsPerpendicular) {
  JobSpec job = cube_job();
  job.scene.objects[0].scale = {1, 5, -0.2f};
  job.scene.objects[0].rotate_deg = {10, 20, 30};
  const Instance instance = only_instance(job);
  const Vec3 normal = normalize({1, 2, 3});
  const Vec3 tangent = cross(normal, {0, 1, 0});
  const Vec3 moved = normalize(instance.normal_to_world * normal);
  EXPECT_NEAR(dot(moved, normalize(instance.to_world.linear * tangent)), 0, 1e-6f);
  EXPECT_GT(dot(moved, instance.to_world.linear * normal), 0);
}

TEST(Scene, GroundIsASquareThatFacesUp) {
  JobSpec job = cube_job();
  job.scene.materials["floor"] = {.base_color = {0.1f, 0.2f, 0.3f}};
  job.scene.ground = GroundSpec{.material = "floor", .height = -1, .size = 20};
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok());
  ASSERT_EQ(scene->instances.size(), 2u);
  const Instance& ground = scene->instances[1];
  EXPECT_FLOAT_EQ(scene->materials[ground.material].kd.y, 0.2f);
  const TriangleMesh& mesh = scene->meshes[ground.mesh];
  EXPECT_TRUE(mesh.normals.empty());
  ASSERT_EQ(mesh.triangles.size(), 2u);
  for (const auto& t : mesh.triangles) {
    const Vec3 n = cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                         mesh.positions[t[2]] - mesh.positions[t[0]]);
    expect_point(n, {0, 400, 0});
    EXPECT_EQ(mesh.positions[t[0]].y, -1);
  }
}

TEST(Scene, TellsEveryFaultAtOnce) {
  JobSpec job = cube_job();
  job.scene.meshes["gone"] = {testing::TempDir() + "gone.ply", true};
  job.scene.meshes["flat"] = {test::write_test_file("scene_square.off", test::kSquareOff), true};
  job.scene.objects.push_back(object_of("sphere", "gold"));
  job.scene.objects.push_back(object_of("cube", "grey"));
  job.scene.objects[2].scale = {1, 0, 1};
  job.scene.objects.push_back(object_of("flat", "grey"));
  job.scene.objects[3].fit_height = 1.0f;
  job.scene.objects.push_back(object_of("gone", "grey"));
  job.scene.ground = GroundSpec{.material = "grass"};
  const auto scene = load_scene(job);
  ASSERT_FALSE(scene.ok());
  const std::string& message = scene.error().message;
  EXPECT_THAT(message, HasSubstr("scene.meshes.gone: "));
  EXPECT_THAT(message, HasSubstr("missing"));
  EXPECT_THAT(message, HasSubstr("scene.objects[1]: unknown mesh \"sphere\"\n"));
  EXPECT_THAT(message, HasSubstr("scene.objects[1]: unknown material \"gold\"\n"));
  EXPECT_THAT(message, HasSubstr("scene.objects[2]: expected a finite scale without zeros\n"));
  EXPECT_THAT(message, HasSubstr("scene.objects[3]: mesh \"flat\" is flat"));
  EXPECT_THAT(message, HasSubstr("scene.ground: unknown material \"grass\""));
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 5);
}

TEST(Scene, MayBeEmpty) {
  const auto scene = load_scene(JobSpec{});
  ASSERT_TRUE(scene.ok());
  EXPECT_TRUE(scene->instances.empty());
}

}  // namespace
}  // namespace baton
