// Extensions of glTF files: compressed data, instances, colours of vertices, materials.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include "common/scene/gltf/materials.h"
#include "common/scene/mesh_loader.h"
#include "common/scene/scene.h"
#include "common/scene/scene_warnings.h"
#include "tests/support/gltf_jobs.h"

namespace baton {
namespace {

using test::GltfWriter;
using test::write_test_file;
using testing::Contains;
using testing::HasSubstr;

constexpr const char* kCamera = R"(, "camera": {"position": [0, 0, 9], "lookAt": [0, 0, 0]})";

Result<TriangleMesh> load(const std::string& bytes) {
  return load_mesh(write_test_file("extended.glb", bytes), true);
}

TEST(GltfExtensions, RequiredOnesThatOnlyAddAreSaid) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  for (const std::string name : {"KHR_lights_punctual", "KHR_materials_unlit",
                                 "KHR_materials_transmission", "EXT_lights_image_based"}) {
    const std::string file = write_test_file(
        "required.glb",
        w.glb(R"("nodes":[{"mesh":0}],)" + test::mesh_json("\"POSITION\":0") +
              ",\"extensionsUsed\":[\"" + name + "\"],\"extensionsRequired\":[\"" + name + "\"]"));
    const JobSpec job = test::settled(test::job_of(file, "", kCamera));
    EXPECT_EQ(job.scene.objects.size(), 1u) << name;
    EXPECT_THAT(scene_warnings(job), Contains(HasSubstr(name + " is not read")));
  }
}

/// A triangle as Draco has it, with normals along y.
std::vector<char> draco_triangle() {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(1);
  const int positions =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int normals = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
  const float p[3][3] = {{0, 0, 0}, {0, 0, 2}, {2, 0, 0}}, n[3] = {0, 1, 0};
  builder.SetAttributeValuesForFace(positions, draco::FaceIndex(0), p[0], p[1], p[2]);
  builder.SetAttributeValuesForFace(normals, draco::FaceIndex(0), n, n, n);
  const auto mesh = builder.Finalize();
  draco::EncoderBuffer buffer;
  draco::Encoder encoder;
  encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {buffer.data(), buffer.data() + buffer.size()};
}

std::string draco_glb(const std::vector<char>& data) {
  GltfWriter w;
  const int view = w.add_view(data);
  w.add_accessor(R"("componentType":5126,"count":3,"type":"VEC3")");
  w.add_accessor(R"("componentType":5126,"count":3,"type":"VEC3")");
  return w.glb(R"("extensionsRequired":["KHR_draco_mesh_compression"],"nodes":[{"mesh":0}],)" +
               test::mesh_json(R"("POSITION":0,"NORMAL":1)",
                               R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":)" +
                                   std::to_string(view) +
                                   R"(,"attributes":{"POSITION":0,"NORMAL":1}}})"));
}

TEST(GltfExtensions, DracoIsDecoded) {
  const auto mesh = load(draco_glb(draco_triangle()));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_THAT(mesh->positions,
              testing::UnorderedElementsAre(Vec3{0, 0, 0}, Vec3{0, 0, 2}, Vec3{2, 0, 0}));
  for (const Vec3& n : mesh->normals) EXPECT_NEAR(n.y, 1, 1e-6f);
  std::vector<char> damaged = draco_triangle();
  for (const std::size_t size : {std::size_t{0}, std::size_t{4}, damaged.size() / 2}) {
    std::vector<char> cut(damaged.begin(), damaged.begin() + static_cast<std::ptrdiff_t>(size));
    cut.resize(std::max<std::size_t>(cut.size(), 1));
    EXPECT_THAT(load(draco_glb(cut)).error().message, HasSubstr("KHR_draco_mesh_compression"));
  }
}

TEST(GltfExtensions, MeshoptViewsAreDecoded) {
  const std::vector<float> positions{0, 0, 0, 0, 0, 2, 2, 0, 0};
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(3, 12));
  packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), positions.data(), 3, 12));
  const auto file = [](const std::vector<unsigned char>& data, const std::string& count) {
    GltfWriter w;
    const int view = w.add_view(data);
    std::string glb_json = R"("nodes":[{"mesh":0}],)" + test::mesh_json("\"POSITION\":0");
    w.add_accessor(R"("bufferView":1,"componentType":5126,"count":3,"type":"VEC3")");
    w.add_raw_view(R"("buffer":0,"byteLength":0,"extensions":{"EXT_meshopt_compression":
      {"buffer":0,"byteOffset":0,"byteLength":)" +
                   std::to_string(data.size()) + ",\"byteStride\":12,\"count\":" + count +
                   R"(,"mode":"ATTRIBUTES"}})");
    EXPECT_EQ(view, 0);
    return w.glb(glb_json);
  };
  const auto mesh = load(file(packed, "3"));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_THAT(mesh->positions, testing::Contains(Vec3{0, 0, 2}));
  EXPECT_THAT(load(file(packed, "1e15")).error().message, HasSubstr("expected a layout"));
  EXPECT_THAT(load(file(packed, "30000000")).error().message,
              HasSubstr("30000000 elements of 12 bytes in"))
      << "before a third of a gigabyte is taken for it";
  packed.resize(packed.size() / 2);
  EXPECT_THAT(load(file(packed, "3")).error().message, HasSubstr("its data is damaged"));
}

TEST(GltfExtensions, InstancesAreObjects) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{1, 0, 0, 0, 5, 0}, "VEC3", 3);
  w.add(std::vector<float>{1, 1, 1, 2, 2, 2}, "VEC3", 3);
  const std::string bytes = w.glb(R"("nodes":[{"mesh":0,"translation":[0,0,3],"extensions":{
      "EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1,"SCALE":2}}}}],)" +
                                  test::mesh_json("\"POSITION\":0"));
  const JobSpec job =
      test::settled(test::job_of(write_test_file("instances.glb", bytes), "", kCamera));
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->instances[0].to_world.point({1, 0, 0}), (Vec3{2, 0, 3}));
  EXPECT_EQ(scene->instances[1].to_world.point({1, 0, 0}), (Vec3{2, 5, 3}));
  EXPECT_EQ(scene->meshes.size(), 1u);
  const auto whole = load(bytes);
  EXPECT_EQ(whole->triangles.size(), 2u);
}

TEST(GltfExtensions, ColoursOfVerticesBelongToTheMesh) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<std::uint8_t>{255, 0, 0, 51, 0, 255, 0, 255, 0, 0, 255, 255}, "VEC4", 4,
        ",\"normalized\":true");
  w.add(std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 2}, "VEC3", 3);
  for (const int accessor : {1, 2}) {
    const JobSpec job = test::settled(test::job_of(
        write_test_file("coloured.glb", w.glb(R"("nodes":[{"mesh":0}],)" +
                                              test::mesh_json("\"POSITION\":0,\"COLOR_0\":" +
                                                              std::to_string(accessor)))),
        "", kCamera));
    const auto scene = load_scene(job);
    ASSERT_TRUE(scene) << scene.error().message;
    const std::vector<VertexColor>& colors = scene->meshes.at(0).colors;
    EXPECT_THAT(colors, Contains(VertexColor{1, 0, 0, accessor == 1 ? 51 / 255.0f : 1}));
    EXPECT_THAT(colors, Contains(VertexColor{0, 0, 1, 1})) << "cut at 1";
    EXPECT_NE(scene->materials.at(scene->instances[0].material).detail, nullptr);
  }
}

TEST(GltfExtensions, SpecularGlossinessIsConverted) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  const auto material = [&](const std::string& inner, const std::string& beside = "") {
    const auto document = gltf::read_document(
        write_test_file("glossy.glb", w.glb(R"("textures":[{}],"materials":[{"extensions":{
        "KHR_materials_pbrSpecularGlossiness":{)" +
                                            inner + "}}" + beside + "}]")));
    EXPECT_TRUE(document) << document.error().message;
    return gltf::material_spec(**document, 0);
  };
  const MaterialSpec plain = material(
      R"("diffuseFactor":[0.5,0.25,0.125,1],"specularFactor":[0.08,0.04,0],"glossinessFactor":0.7)");
  EXPECT_EQ(plain.base_color, (Rgb{0.5f, 0.25f, 0.125f}));
  EXPECT_NEAR(plain.specular_color.x, 2, 1e-6f);
  EXPECT_EQ(plain.specular_color.z, 0);
  EXPECT_EQ(plain.metallic, 0);
  EXPECT_NEAR(plain.roughness, 0.3f, 1e-6f);
  // A texture of gloss is not read: what stands beside it holds, or a usual surface.
  const std::string gloss = R"("specularGlossinessTexture":{"index":0})";
  EXPECT_EQ(material(gloss).roughness, 0.5f);
  EXPECT_EQ(material(gloss, R"(,"pbrMetallicRoughness":{"roughnessFactor":0.25})").roughness,
            0.25f);
}

}  // namespace
}  // namespace baton
