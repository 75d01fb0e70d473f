#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "common/scene/mesh_loader.h"
#include "tests/support/mesh_files.h"

namespace baton {
namespace {

using test::write_test_file;
using testing::HasSubstr;

const std::string kPlyHeader =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kPlyBody = "0 0 0\n0 0 1\n1 0 1\n1 0 0\n3 0 1 2\n3 0 2 3\n";

template <class T>
void put(std::string& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string binary_ply() {
  std::string bytes = kPlyHeader;
  bytes.replace(bytes.find("ascii"), 5, "binary_little_endian");
  for (const int x : {0, 0, 0, 0, 0, 1, 1, 0, 1, 1, 0, 0}) put(bytes, static_cast<float>(x));
  for (const auto& face : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
    put(bytes, std::uint8_t{3});
    for (const int index : face) put(bytes, index);
  }
  return bytes;
}

/// The square as glTF, moved by its node to x + 10 and scaled by 2.
std::string square_gltf_json(const std::string& buffer) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"children":[1],"translation":[10,0,0]},{"mesh":0,"scale":[2,2,2]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"buffers":[{"byteLength":60)" +
         buffer + R"(}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},
{"buffer":0,"byteOffset":48,"byteLength":12}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3",
"min":[0,0,0],"max":[1,0,1]},
{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}]})";
}

std::string square_buffer() {
  std::string bytes;
  for (const int x : {0, 0, 0, 0, 0, 1, 1, 0, 1, 1, 0, 0}) put(bytes, static_cast<float>(x));
  for (const int index : {0, 1, 2, 0, 2, 3}) put(bytes, static_cast<std::uint16_t>(index));
  return bytes;
}

std::string square_glb() {
  std::string json = square_gltf_json("");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string buffer = square_buffer();
  std::string bytes = "glTF";
  put(bytes, std::uint32_t{2});
  put(bytes, static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + buffer.size()));
  put(bytes, static_cast<std::uint32_t>(json.size()));
  bytes += "JSON" + json;
  put(bytes, static_cast<std::uint32_t>(buffer.size()));
  bytes += std::string("BIN\0", 4) + buffer;
  return bytes;
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += length(cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                        mesh.positions[t[2]] - mesh.positions[t[0]])) /
           2;
  }
  return sum;
}

void expect_square(const std::string& path, double expected_area = 1) {
  const auto mesh = load_mesh(path, true);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->positions.size(), 4u) << path;
  EXPECT_EQ(mesh->triangles.size(), 2u) << path;
  EXPECT_EQ(mesh->dropped_triangles, 0u);
  EXPECT_NEAR(area(*mesh), expected_area, 1e-6) << path;
  ASSERT_EQ(mesh->normals.size(), 4u);
  for (const Vec3& n : mesh->normals) EXPECT_NEAR(n.y, 1, 1e-6f) << path;
}

void expect_error(const std::string& path, const std::string& part) {
  const auto mesh = load_mesh(path, true);
  ASSERT_FALSE(mesh.ok()) << path;
  EXPECT_EQ(mesh.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(mesh.error().message, testing::StartsWith(path + ": "));
  EXPECT_THAT(mesh.error().message, HasSubstr(part));
}

TEST(MeshLoader, ReadsEveryFormat) {
  expect_square(write_test_file("square.off", test::kSquareOff));
  expect_square(write_test_file("square.ply", kPlyHeader + kPlyBody));
  expect_square(write_test_file("square_binary.ply", binary_ply()));
  expect_square(write_test_file("square.obj", "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nf 1 2 3 4\n"));
  write_test_file("square.bin", square_buffer());
  expect_square(write_test_file("square.gltf", square_gltf_json(R"(,"uri":"square.bin")")), 4);
  expect_square(write_test_file("square.glb", square_glb()), 4);
}

TEST(MeshLoader, FlattensNodeTransforms) {
  const auto mesh = load_mesh(write_test_file("moved.glb", square_glb()), true);
  ASSERT_TRUE(mesh.ok());
  for (const Vec3& p : mesh->positions) {
    EXPECT_TRUE(p.x == 10 || p.x == 12) << p.x;
    EXPECT_TRUE(p.z == 0 || p.z == 2) << p.z;
  }
}

TEST(MeshLoader, AMeshOfTwoNodesHasTheVerticesOfBoth) {
  std::string json = square_gltf_json(R"(,"uri":"square.bin")");
  const auto replace = [&](const std::string& from, const std::string& to) {
    json.replace(json.find(from), from.size(), to);
  };
  replace(R"("children":[1])", R"("children":[1,2])");
  replace(R"("scale":[2,2,2]})", R"("scale":[2,2,2]},{"mesh":0,"translation":[5,0,0]})");
  write_test_file("square.bin", square_buffer());
  const auto mesh = load_mesh(write_test_file("two_nodes.gltf", json), true);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->positions.size(), 8u);
  EXPECT_NEAR(area(*mesh), 5, 1e-6);
}

TEST(MeshLoader, VerticesAtOnePlaceAreOneAndUnusedOnesAreNone) {
  // The edge that both triangles share is in the list twice; nobody uses the last one.
  const std::string vertices = "0 0 0\n0 0 1\n1 0 1\n0 0 0\n1 0 1\n1 0 0\n9 9 9\n";
  const std::string faces = "3 0 1 2\n3 3 4 5\n";
  std::string ply = kPlyHeader;
  ply.replace(ply.find("vertex 4"), 8, "vertex 7");
  for (const std::string& path :
       {write_test_file("twice.off", "OFF 7 2 0\n" + vertices + faces),
        write_test_file("twice.ply", ply + vertices + faces),
        write_test_file("twice.obj",
                        "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 0 0 0\nv 1 0 1\nv 1 0 0\nv 9 9 9\n"
                        "f 1 2 3\nf 4 5 6\n")})
    expect_square(path);
}

TEST(MeshLoader, ReadsOffAsPeopleWriteIt) {
  expect_square(write_test_file(
      "comments.off",
      "# a square\nOFF # really\n# counts\n4 2 0\n\n0 0 0\n0 0 1 # c\n# more\n1 0 1\n1 0 0\n"
      "3 0 1 2 # first\n3 0 2 3"));
  expect_square(write_test_file(
      "crlf.off", "OFF\r\n4 2 0\r\n0 0 0\r\n0 0 1\r\n1 0 1\r\n1 0 0\r\n3 0 1 2\r\n3 0 2 3\r\n"));
  expect_square(write_test_file("one_line.off",
                                "OFF 4 1 0\n0 0 0\n0 0 1\n+1 0 1e0\n1 0 0\n4 0 1 2 3 255 0 0\n"));
  expect_square(write_test_file("colours.off",
                                "COFF\n4 1 0\n0 0 0 9 9 9 255\n0 0 1 9 9 9 255\n1 0 1 9 9 9 255\n1 "
                                "0 0 9 9 9 255\n4 0 1 2 3\n"));
  expect_square(write_test_file("upper.OFF", test::kSquareOff));
}

TEST(MeshLoader, DropsAndCountsTrianglesWithoutArea) {
  const auto mesh = load_mesh(
      write_test_file("degenerate.off",
                      "OFF\n6 5 0\n0 0 0\n0 0 1\n1 0 1\n1 0 0\n0 0 0\n0.5 0 0.5\n3 0 1 2\n"
                      "3 0 2 3\n3 0 0 1\n3 0 4 1\n3 0 5 2\n"),
      true);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 2u);
  EXPECT_EQ(mesh->dropped_triangles, 3u);
  EXPECT_EQ(mesh->positions.size(), 4u);
}

TEST(MeshLoader, KeepsTinyAndHugeTriangles) {
  EXPECT_TRUE(
      load_mesh(write_test_file("tiny.off", "OFF\n3 1 0\n0 0 0\n1e-15 0 0\n0 1e-15 0\n3 0 1 2\n"),
                true)
          .ok());
  EXPECT_TRUE(
      load_mesh(write_test_file("huge.off", "OFF\n3 1 0\n0 0 0\n1e15 0 0\n0 1e15 0\n3 0 1 2\n"),
                true)
          .ok());
}

TEST(MeshLoader, SmoothNormalsAreWeightedByAngle) {
  // At a corner of the cube three faces meet at right angles, however they are cut into triangles.
  const auto mesh = load_mesh(write_test_file("cube.off", test::kCubeOff), true);
  ASSERT_TRUE(mesh.ok());
  ASSERT_EQ(mesh->positions.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(dot(mesh->normals[i], normalize(mesh->positions[i])), 1, 1e-6f);
  }
  EXPECT_TRUE(load_mesh(testing::TempDir() + "cube.off", false)->normals.empty());
}

TEST(MeshLoader, TwoSidedSheetsHaveUsableNormals) {
  const auto mesh = load_mesh(
      write_test_file("sheet.off", "OFF\n3 2 0\n0 0 0\n0 0 1\n1 0 0\n3 0 1 2\n3 0 2 1\n"), true);
  ASSERT_TRUE(mesh.ok());
  for (const Vec3& n : mesh->normals) EXPECT_NEAR(std::fabs(n.y), 1, 1e-6f);
}

TEST(MeshLoader, UsesNormalsOfTheFile) {
  const auto mesh = load_mesh(
      write_test_file("normals.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nvn 0 3 4\nf 1//1 2//1 3//1\n"),
      true);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  for (const Vec3& n : mesh->normals) EXPECT_NEAR(dot(n, {0, 0.6f, 0.8f}), 1, 1e-6f);

  // Normals that are no directions are computed instead.
  const auto repaired =
      load_mesh(write_test_file("zero_normals.obj",
                                "v 0 0 0\nv 0 0 1\nv 1 0 0\nvn 0 0 0\nf 1//1 2//1 3//1\n"),
                true);
  ASSERT_TRUE(repaired.ok());
  for (const Vec3& n : repaired->normals) EXPECT_NEAR(n.y, 1, 1e-6f);
}

TEST(MeshLoader, ErrorsNameFileAndFault) {
  expect_error(testing::TempDir() + "nowhere.ply", "missing");
  expect_error(testing::TempDir(), "is a folder, expected a file");
  for (const std::string extension : {"off", "ply", "obj", "gltf", "glb"}) {
    const std::string expected = extension.starts_with("gl") ? "not a glTF file: " : "not a mesh: ";
    expect_error(write_test_file("garbage." + extension, "hello, this is no mesh\n"), expected);
    expect_error(write_test_file("empty." + extension, ""), expected);
  }
  expect_error(write_test_file(
                   "cloud.ply",
                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n0 0 0\n"),
               "no triangles");
  expect_error(write_test_file("flat.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"),
               "no triangles (1 without area)");
}

TEST(MeshLoader, ErrorsOfIndicesAndCoordinates) {
  expect_error(write_test_file("range.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n"),
               "line 6: expected a vertex index below 3");
  expect_error(write_test_file("negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
               "expected a vertex index below 3");
  expect_error(write_test_file("nan.off", "OFF\n3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n"),
               "no triangles");
  std::string ply = kPlyHeader + kPlyBody;
  ply.replace(ply.rfind('3'), 1, "9");
  expect_error(write_test_file("range.ply", ply), "face 1: expected a vertex index below 4");
  expect_error(write_test_file("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"),
               "no triangles");
  expect_error(write_test_file("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
               "not a mesh: ");
}

TEST(MeshLoader, EveryTruncationIsAnError) {
  const std::string off(test::kSquareOff);
  for (std::size_t size = 0; size + 2 < off.size(); ++size) {
    EXPECT_FALSE(load_mesh(write_test_file("cut.off", off.substr(0, size)), true).ok()) << size;
  }
  const std::string ply = kPlyHeader + kPlyBody;
  for (std::size_t size = 0; size + 8 < ply.size(); ++size) {
    EXPECT_FALSE(load_mesh(write_test_file("cut.ply", ply.substr(0, size)), true).ok()) << size;
  }
  const std::string binary = binary_ply();
  for (std::size_t size = kPlyHeader.size() + 20; size < binary.size(); ++size) {
    EXPECT_FALSE(load_mesh(write_test_file("cut_binary.ply", binary.substr(0, size)), true).ok())
        << size;
  }
  const std::string glb = square_glb();
  for (std::size_t size = 0; size < glb.size(); size += 7) {
    EXPECT_FALSE(load_mesh(write_test_file("cut.glb", glb.substr(0, size)), true).ok()) << size;
  }
}

TEST(MeshLoader, AnyChangedByteEndsWell) {
  // A damaged file is an error or another mesh, never a crash or a hang.
  for (const auto& [name, bytes] :
       {std::pair<std::string, std::string>{"damaged.ply", binary_ply()},
        {"damaged_text.ply", kPlyHeader + kPlyBody},
        {"damaged.off", std::string(test::kSquareOff)}}) {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      for (const int flip : {0x01, 0x10, 0x80}) {
        std::string damaged = bytes;
        damaged[i] = static_cast<char>(damaged[i] ^ flip);
        const auto mesh = load_mesh(write_test_file(name, damaged), true);
        if (!mesh.ok()) continue;
        for (const auto& triangle : mesh->triangles) {
          for (const std::uint32_t corner : triangle) ASSERT_LT(corner, mesh->positions.size());
        }
      }
    }
  }
}

TEST(MeshLoader, ReadsBigEndianPlyAndSkipsWhatItDoesNotKnow) {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\ncomment made by hand\nelement camera 1\nproperty double "
      "focus\n"
      "element vertex 3\nproperty uchar red\nproperty float x\nproperty float y\nproperty double "
      "z\n"
      "element face 1\nproperty list uchar uint vertex_index\nproperty list uchar float "
      "texcoord\nend_header\n";
  const auto put_big = [&bytes](auto value) {
    std::string raw;
    put(raw, value);
    bytes.append(raw.rbegin(), raw.rend());
  };
  put_big(1.5);
  for (const int i : {0, 1, 2}) {
    put_big(std::uint8_t{200});
    put_big(i == 1 ? 2.0f : 0.0f);
    put_big(7.0f);
    put_big(i == 2 ? -3.0 : 0.0);
  }
  put_big(std::uint8_t{3});
  for (const std::uint32_t index : {0u, 1u, 2u}) put_big(index);
  put_big(std::uint8_t{1});
  put_big(0.5f);
  const auto mesh = load_mesh(write_test_file("big.ply", bytes), true);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  EXPECT_NEAR(area(*mesh), 3, 1e-6);
  EXPECT_EQ(mesh->positions[1], (Vec3{2, 7, 0}));
}

TEST(MeshLoader, CountsThatNoFileCouldHoldAreRefused) {
  expect_error(write_test_file("bomb.off", "OFF\n4000000000 4000000000 0\n0 0 0\n"),
               "too small to hold");
  std::string ply = kPlyHeader;
  ply.replace(ply.find("vertex 4"), 8, "vertex 4000000000");
  expect_error(write_test_file("bomb.ply", ply + kPlyBody), "expected a number");
}

}  // namespace
}  // namespace baton
