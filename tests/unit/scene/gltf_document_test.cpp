#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "common/scene/gltf/document.h"
#include "common/scene/mesh_loader.h"
#include "tests/support/gltf_files.h"
#include "tests/support/mesh_files.h"

namespace baton {
namespace {

using test::GltfWriter;
using test::mesh_json;
using test::write_test_file;
using testing::HasSubstr;

constexpr const char* kOneNode = R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)";

Result<TriangleMesh> load(const std::string& bytes) {
  return load_mesh(write_test_file("document.glb", bytes), true);
}

std::string error_of(const std::string& bytes) {
  const Result<TriangleMesh> mesh = load(bytes);
  return mesh ? "none" : mesh.error().message;
}

/// The error of a file with one triangle whose accessor 1, the indices, is `json`.
std::string error_of_indices(const std::string& json) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add_view(std::vector<std::uint16_t>{0, 1, 2});
  w.add_accessor(json);
  return error_of(w.glb(kOneNode + mesh_json("\"POSITION\":0", ",\"indices\":1")));
}

TEST(GltfDocument, ReadsIndicesOfEverySize) {
  const auto check = [](auto zero) {
    using T = decltype(zero);
    GltfWriter w;
    w.add(test::kTriangle, "VEC3", 3);
    w.add(std::vector<T>{0, 1, 2}, "SCALAR", 1);
    const auto mesh = load(w.glb(kOneNode + mesh_json("\"POSITION\":0", ",\"indices\":1")));
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), 1u);
    EXPECT_EQ(mesh->positions[1], (Vec3{1, 0, 0}));
  };
  check(std::uint8_t{});
  check(std::uint16_t{});
  check(std::uint32_t{});
}

TEST(GltfDocument, ReadsQuantisedAndSparsePositions) {
  GltfWriter quantised;
  quantised.add(std::vector<std::int16_t>{0, 0, 0, 32767, 0, 0, 0, -32768, 0}, "VEC3", 3,
                ",\"normalized\":true");
  const auto mesh = load(quantised.glb(kOneNode + mesh_json("\"POSITION\":0")));
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->positions[1], (Vec3{1, 0, 0}));
  EXPECT_EQ(mesh->positions[2], (Vec3{0, -1, 0}));

  // Zeros, but for two vertices.
  GltfWriter sparse;
  const int indices = sparse.add_view(std::vector<std::uint16_t>{1, 2});
  const int values = sparse.add_view(std::vector<float>{3, 0, 0, 0, 4, 0});
  sparse.add_accessor(R"("componentType":5126,"count":3,"type":"VEC3","sparse":{"count":2,
    "indices":{"bufferView":)" +
                      std::to_string(indices) + R"(,"componentType":5123},
    "values":{"bufferView":)" +
                      std::to_string(values) + "}}");
  const auto some = load(sparse.glb(kOneNode + mesh_json("\"POSITION\":0")));
  ASSERT_TRUE(some) << some.error().message;
  EXPECT_EQ(some->positions[1], (Vec3{3, 0, 0}));
  EXPECT_EQ(some->positions[2], (Vec3{0, 4, 0}));
}

TEST(GltfDocument, ReadsStripsFansAndTextureCoordinates) {
  for (const int mode : {5, 6}) {
    GltfWriter w;
    w.add(std::vector<float>{0, 0, 0, 1, 0, 0, mode == 5 ? 0.0f : 1.0f, 1, 0,
                             mode == 5 ? 1.0f : 0.0f, 1, 0},
          "VEC3", 3);
    w.add(std::vector<std::uint8_t>{0, 0, 255, 0, 0, 255, 255, 255}, "VEC2", 2,
          ",\"normalized\":true");
    const auto mesh = load(w.glb(kOneNode + mesh_json("\"POSITION\":0,\"TEXCOORD_0\":1",
                                                      ",\"mode\":" + std::to_string(mode))));
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->triangles.size(), 2u);
    double area = 0;
    for (const auto& t : mesh->triangles) {
      const Vec3 n = cross(mesh->positions[t[1]] - mesh->positions[t[0]],
                           mesh->positions[t[2]] - mesh->positions[t[0]]);
      EXPECT_GT(n.z, 0);
      area += n.z / 2;
    }
    EXPECT_NEAR(area, 1, 1e-6);
    ASSERT_EQ(mesh->uvs[0].size(), 4u);
    EXPECT_EQ(mesh->uvs[0][1], (Uv{1, 0}));
    EXPECT_TRUE(mesh->uvs[1].empty());
  }
}

TEST(GltfDocument, MatricesPlaceAndMirror) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
  const auto mesh = load(w.glb(R"("scenes":[{"nodes":[0]}],
    "nodes":[{"mesh":0,"matrix":[-2,0,0,0, 0,1,0,0, 0,0,1,0, 5,6,7,1]}],)" +
                               mesh_json("\"POSITION\":0,\"NORMAL\":1")));
  ASSERT_TRUE(mesh) << mesh.error().message;
  const auto& t = mesh->triangles[0];
  for (const Vec3& n : mesh->normals) EXPECT_NEAR(n.z, 1, 1e-6f);
  // The corners still turn about the normal.
  EXPECT_GT(cross(mesh->positions[t[1]] - mesh->positions[t[0]],
                  mesh->positions[t[2]] - mesh->positions[t[0]])
                .z,
            0);
  EXPECT_THAT(mesh->positions, testing::Contains(Vec3{3, 6, 7}));
}

TEST(GltfDocument, AbsurdAccessorsAreErrors) {
  const std::string start = R"("bufferView":1,"type":"SCALAR","componentType":5123,)";
  EXPECT_THAT(error_of_indices(start + "\"count\":3"), "none");
  EXPECT_THAT(error_of_indices(start + "\"count\":4"),
              HasSubstr("$.accessors[1]: 4 elements end at byte 8 of a view of 6 bytes"));
  for (const char* odd :
       {"\"count\":9007199254740992", "\"count\":3,\"byteOffset\":9007199254740992",
        "\"count\":9007199254740992,\"byteOffset\":9007199254740992"})
    EXPECT_THAT(error_of_indices(start + odd), HasSubstr("$.accessors[1]: ")) << odd;
  EXPECT_THAT(error_of_indices(start + "\"count\":-1"),
              HasSubstr("$.accessors[1].count: expected"));
  EXPECT_THAT(error_of_indices(start + "\"count\":1e300"),
              HasSubstr("$.accessors[1].count: expected"));
  EXPECT_THAT(error_of_indices(R"("type":"SCALAR","componentType":5123,"count":9007199254740992)"),
              HasSubstr("expected at most"));
  // Half a gigabyte of nothing, from a file of some hundred bytes.
  EXPECT_THAT(error_of_indices(R"("type":"SCALAR","componentType":5123,"count":134217728)"),
              HasSubstr("elements that are not stored, got 134217728"));
  EXPECT_THAT(error_of_indices(R"("bufferView":7,"type":"SCALAR","componentType":5123,"count":3)"),
              HasSubstr("$.accessors[1].bufferView: expected an index below 2, got 7"));
  EXPECT_THAT(error_of_indices(R"("bufferView":1,"type":"SCALAR","componentType":9,"count":3)"),
              HasSubstr("componentType: expected one of"));
  EXPECT_THAT(error_of_indices(R"("bufferView":1,"type":"VEC3","componentType":5123,"count":1)"),
              HasSubstr("expected 1 numbers an element, got 3"));
  EXPECT_THAT(error_of_indices(R"("bufferView":1,"type":"SCALAR","componentType":5122,"count":3)"),
              HasSubstr("expected indices without sign"));
  EXPECT_THAT(error_of_indices(start + R"("count":3,"sparse":{"count":1,
                 "indices":{"bufferView":1,"byteOffset":4,"componentType":5123},
                 "values":{"bufferView":1,"byteOffset":9007199254740992}})"),
              HasSubstr("$.accessors[1]: 1 elements end at byte"));
  EXPECT_THAT(error_of_indices(start + R"("count":2,"sparse":{"count":1,
                 "indices":{"bufferView":1,"byteOffset":4,"componentType":5123},
                 "values":{"bufferView":1}})"),
              HasSubstr("expected sparse indices below 2, got 2"));
}

TEST(GltfDocument, OddListsAndIndicesAreErrors) {
  GltfWriter few;
  few.add(test::kTriangle, "VEC3", 3);
  few.add(std::vector<float>{0, 0, 1, 0}, "VEC2", 2);
  EXPECT_THAT(error_of(few.glb(kOneNode + mesh_json("\"POSITION\":0,\"TEXCOORD_0\":1"))),
              HasSubstr("TEXCOORD_0: expected one for each of 3 vertices, got 2"));
  GltfWriter range;
  range.add(test::kTriangle, "VEC3", 3);
  range.add(std::vector<std::uint16_t>{0, 1, 9}, "SCALAR", 1);
  EXPECT_THAT(error_of(range.glb(kOneNode + mesh_json("\"POSITION\":0", ",\"indices\":1"))),
              HasSubstr("expected a vertex index below 3, found 9"));
}

TEST(GltfDocument, NodesAreTrees) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  const std::string mesh = "," + mesh_json("\"POSITION\":0");
  EXPECT_THAT(error_of(w.glb(R"("nodes":[{"children":[1]},{"children":[0],"mesh":0}])" + mesh)),
              HasSubstr("is its own ancestor"));
  EXPECT_THAT(error_of(w.glb(R"("nodes":[{"children":[0],"mesh":0}])" + mesh)),
              HasSubstr("node 0 is its own ancestor"));
  EXPECT_THAT(error_of(w.glb(R"("nodes":[{"children":[2]},{"children":[2]},{"mesh":0}])" + mesh)),
              HasSubstr("node 2 is a child of two nodes"));
}

TEST(GltfDocument, ContainersAndBuffersAreChecked) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  const std::string json = kOneNode + mesh_json("\"POSITION\":0");
  std::string bytes = w.glb(json);
  bytes[4] = 1;
  EXPECT_THAT(error_of(bytes), HasSubstr("expected version 2 of GLB, got 1"));
  const auto text = [](const std::string& rest) {
    return error_of(R"({"asset":{"version":"2.0"})" + rest + "}");
  };
  EXPECT_THAT(error_of("{}"), HasSubstr("expected asset.version 2.x"));
  EXPECT_THAT(error_of(R"({"asset":{"version":"1.0"}})"), HasSubstr("expected version 2.x"));
  EXPECT_THAT(text(R"(,"buffers":[{"byteLength":9,"uri":"nowhere.bin"}])"),
              HasSubstr("$.buffers[0]: its file: "));
  EXPECT_THAT(text(R"(,"buffers":[{"byteLength":9,"uri":"data:x;base64,AAAA"}])"),
              HasSubstr("$.buffers[0]: expected 9 bytes, got 3"));
  EXPECT_THAT(text(R"(,"buffers":[{"byteLength":9,"uri":"data:x;base64,A*AA"}])"),
              HasSubstr("expected data in base64"));
  EXPECT_THAT(text(R"(,"buffers":[{"byteLength":3,"uri":"data:x;base64,AAAA"}],
                     "bufferViews":[{"buffer":0,"byteOffset":2,"byteLength":2}])"),
              HasSubstr("view 0: bytes 2 to 4 of a buffer of 3"));
  EXPECT_THAT(text(R"(,"extensionsRequired":["KHR_texture_transform","EXT_a","EXT_b"])"),
              HasSubstr("$.extensionsRequired: the file cannot be shown without what is not read: "
                        "EXT_a, EXT_b"));
}

// Whoever submits a job lists its files; a worker opens no other, whatever a file of it says.
TEST(GltfDocument, FilesThatAreNotListedAreNotOpened) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "listed";
  std::filesystem::create_directories(folder / "scene");
  std::ofstream(folder / "secret") << "the secret";
  std::ofstream(folder / "scene/a.gltf")
      << R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":9,"uri":"../secret"}]})";
  const std::string scene = (folder / "scene/a.gltf").string();
  const std::set<std::string> none, listed{(folder / "secret").string()};
  EXPECT_TRUE(gltf::read_document(scene).ok()) << "whoever submits it";
  EXPECT_TRUE(gltf::read_document(scene, &listed).ok());
  const auto refused = gltf::read_document(scene, &none);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("which the job was not submitted with"));
  EXPECT_THAT(load_mesh(scene, false, false, &none).error().message,
              HasSubstr("which the job was not submitted with"));
  std::filesystem::remove_all(folder);
}

/// A file of several kilobytes.
std::string large_glb() {
  GltfWriter w;
  std::vector<float> positions;
  for (int i = 0; i < 900; ++i)
    positions.push_back(std::sin(static_cast<float>(i * i)) + static_cast<float>(i % 7));
  w.add(positions, "VEC3", 3);
  return w.glb(kOneNode + mesh_json("\"POSITION\":0"));
}

TEST(GltfDocument, CutAtEveryKilobyteIsAnError) {
  const std::string bytes = large_glb();
  ASSERT_TRUE(load(bytes));
  ASSERT_GT(bytes.size(), 3000u);
  for (std::size_t size = 0; size < bytes.size(); size += 1024)
    EXPECT_THAT(error_of(bytes.substr(0, size)), HasSubstr("not a glTF file: ")) << size;
  EXPECT_THAT(error_of(bytes.substr(0, bytes.size() - 1)), HasSubstr("not a glTF file: "));
}

TEST(GltfDocument, AnyChangedByteEndsWell) {
  GltfWriter w;
  w.add(test::kTriangle, "VEC3", 3);
  w.add(std::vector<std::uint8_t>{0, 1, 2}, "SCALAR", 1);
  w.add(std::vector<float>{0, 0, 1, 0, 0, 1}, "VEC2", 2);
  const std::string bytes =
      w.glb(R"("scenes":[{"nodes":[0]}],"nodes":[{"children":[1]},{"mesh":0}],)" +
            mesh_json("\"POSITION\":0,\"TEXCOORD_0\":2", ",\"indices\":1"));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const int flip : {0x01, 0x10, 0x80}) {
      std::string damaged = bytes;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      const auto mesh = load(damaged);
      if (!mesh) continue;
      for (const auto& triangle : mesh->triangles) {
        for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh->positions.size());
      }
    }
  }
}

}  // namespace
}  // namespace baton
