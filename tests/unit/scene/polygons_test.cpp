// Faces of any form, through every reader: their area is that of the polygon.
#include "common/scene/mesh/polygons.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/scene/mesh_loader.h"
#include "common/scene/scene.h"
#include "tests/support/gltf_jobs.h"
#include "tests/support/mesh_area.h"

namespace baton {
namespace {

using test::area_of;
using test::write_test_file;
using testing::HasSubstr;
using Corners = std::vector<Position>;

/// Of a polygon in a plane z = const.
double area_of(const Corners& c) {
  double twice = 0;
  for (std::size_t i = 0; i < c.size(); ++i) {
    const Position &a = c[i], &b = c[(i + 1) % c.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return std::fabs(twice) / 2;
}

std::vector<Corners> shapes() {
  Corners star, spiral;
  for (int k = 0; k < 10; ++k) {
    const double r = k % 2 == 0 ? 1 : 0.4, angle = 0.6283185307 * k;
    star.push_back({r * std::sin(angle), r * std::cos(angle), 0});
  }
  for (int k = 0; k <= 20; ++k)
    spiral.push_back({(1 + k * 0.2) * std::cos(k * 0.5), (1 + k * 0.2) * std::sin(k * 0.5), 0});
  for (int k = 20; k >= 0; --k)
    spiral.push_back({(1.5 + k * 0.2) * std::cos(k * 0.5), (1.5 + k * 0.2) * std::sin(k * 0.5), 0});
  return {{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}},
          {{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {0.8, 1, 0}},
          {{0, 0, 0},
           {2, 0, 0},
           {2, 0.5, 0},
           {0.5, 0.5, 0},
           {0.5, 1.5, 0},
           {2, 1.5, 0},
           {2, 2, 0},
           {0, 2, 0}},
          {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 1, 0}, {0, 2, 0}},
          // A square with a square hole, reached by a cut.
          {{0, 0, 0},
           {3, 0, 0},
           {3, 3, 0},
           {0, 3, 0},
           {0, 0, 0},
           {1, 1, 0},
           {1, 2, 0},
           {2, 2, 0},
           {2, 1, 0},
           {1, 1, 0}},
          // Outlines that touch themselves in a corner: two triangles, three, a hole.
          {{-0.8, -0.8, 0}, {0, 0, 0}, {0.8, -0.8, 0}, {0.8, 0.8, 0}, {0, 0, 0}, {-0.8, 0.8, 0}},
          {{0, 0, 0},
           {2, -1, 0},
           {2, 1, 0},
           {0, 0, 0},
           {1, 2, 0},
           {-1, 2, 0},
           {0, 0, 0},
           {-2, 1, 0},
           {-2, -1, 0}},
          {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {0, 0, 0}, {1, 2, 0}, {2, 1, 0}},
          // Ways there and back: outside, askew, two at a corner, inside.
          {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {1, 3, 0}, {1, 2, 0}, {0, 2, 0}},
          {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {1.3, 2.7, 0}, {1, 2, 0}, {0, 2, 0}},
          {{0, 0, 0},
           {2, 0, 0},
           {2, 2, 0},
           {1, 2, 0},
           {1, 3, 0},
           {1, 2, 0},
           {0.5, 3, 0},
           {1, 2, 0},
           {0, 2, 0}},
          {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 1, 0}, {1.1, 1.2, 0}, {0, 1, 0}},
          star,
          spiral};
}

std::string file_of(const Corners& c, const std::string& kind) {
  std::string vertices, face;
  for (std::size_t i = 0; i < c.size(); ++i) {
    const std::string xyz =
        std::to_string(c[i][0]) + " " + std::to_string(c[i][1]) + " " + std::to_string(c[i][2]);
    vertices += (kind == "obj" ? "v " : "") + xyz + "\n";
    face += " " + std::to_string(kind == "obj" ? i + 1 : i);
  }
  const std::string n = std::to_string(c.size());
  if (kind == "obj") return write_test_file("face.obj", vertices + "f" + face + "\n");
  if (kind == "off")
    return write_test_file("face.off", "OFF\n" + n + " 1 0\n" + vertices + n + face + "\n");
  return write_test_file("face.ply", "ply\nformat ascii 1.0\nelement vertex " + n +
                                         "\nproperty float x\nproperty float y\nproperty float z\n"
                                         "element face 1\nproperty list int int vertex_indices\n"
                                         "end_header\n" +
                                         vertices + n + face + "\n");
}

TEST(Polygons, HaveTheirAreaWhicheverCornerComesFirst) {
  for (Corners c : shapes()) {
    for (const bool turned : {false, true}) {
      if (turned) std::ranges::reverse(c);
      for (std::size_t first = 0; first < c.size(); ++first) {
        std::ranges::rotate(c, c.begin() + 1);
        for (const char* kind : {"ply", "off", "obj"}) {
          const auto mesh = load_mesh(file_of(c, kind), true);
          ASSERT_TRUE(mesh) << mesh.error().message;
          EXPECT_NEAR(area_of(*mesh), area_of(c), 1e-4) << kind << ", " << c.size() << " corners";
          EXPECT_EQ(mesh->repairs.crossing, 0u);
          for (const Vec3& n : mesh->normals) EXPECT_NEAR(n.z, mesh->normals[0].z, 1e-5f);
        }
      }
    }
  }
}

TEST(Polygons, ABentQuadrilateralIsCutAlongItsShorterDiagonal) {
  Corners quad{{0, 0, 0}, {1, 0, 0}, {1, 1, 0.5}, {0, 1, 0}};
  double area = 0;
  for (int first = 0; first < 4; ++first) {
    std::ranges::rotate(quad, quad.begin() + 1);
    const auto mesh = load_mesh(file_of(quad, "ply"), true);
    ASSERT_TRUE(mesh);
    if (first == 0) area = area_of(*mesh);
    EXPECT_NEAR(area_of(*mesh), area, 1e-6) << "the same form whichever corner comes first";
  }
}

TEST(Polygons, EdgesThatCrossAreSaid) {
  const auto mesh = load_mesh(file_of({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}, "off"), true);
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->repairs.crossing, 1u);
}

/// A square of PLY with a header and a body.
Result<TriangleMesh> ply(const std::string& rest) {
  return load_mesh(write_test_file("form.ply", "ply\nformat ascii 1.0\n" + rest), true);
}
const std::string kVertices =
    "element vertex 4\nproperty double x\nproperty double y\nproperty double z\n";
const std::string kSquare = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

TEST(Polygons, PlyFormsOfOtherMakers) {
  const std::string faces = "element face 2\nproperty list uchar int vertex_indices\n";
  const std::string strips = "element tristrips 1\nproperty list int int vertex_indices\n";
  const std::string end = "end_header\n";
  for (const std::string& file : {faces + kVertices + end + "3 0 1 2\n3 0 2 3\n" + kSquare,
                                  kVertices + strips + end + kSquare + "4 0 1 3 2\n",
                                  kVertices + strips + end + kSquare + "7 0 1 2 -1 0 2 3\n",
                                  strips + kVertices + end + "4 0 1 3 2\n" + kSquare}) {
    const auto mesh = ply(file);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_NEAR(area_of(*mesh), 1, 1e-6);
    for (const Vec3& n : mesh->normals) EXPECT_NEAR(n.z, 1, 1e-6f);
  }
  EXPECT_THAT(ply(faces + kVertices + end + "3 0 1 9\n3 0 2 3\n" + kSquare).error().message,
              HasSubstr("face 0: expected a vertex index below 4"));
  const auto lines = ply(kVertices + "element face 3\nproperty list uchar int vertex_indices\n" +
                         end + kSquare + "4 0 1 2 3\n2 0 1\n1 3\n");
  EXPECT_EQ(lines->repairs.lines, 2u);
}

TEST(Polygons, ColoursOfPlyFilesAreLinear) {
  const std::string rest =
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 255 188 0 127\n1 0 0 0 0 0 255\n0 1 0 0 0 0 255\n3 0 1 2\n";
  const auto mesh =
      ply("element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
          "property uchar red\nproperty uchar green\nproperty uchar blue\n"
          "property uchar alpha\n" +
          rest);
  ASSERT_TRUE(mesh) << mesh.error().message;
  ASSERT_EQ(mesh->colors.size(), 3u);
  EXPECT_EQ(mesh->colors[0][0], 1);
  EXPECT_NEAR(mesh->colors[0][1], 0.5029f, 1e-3f);
  EXPECT_NEAR(mesh->colors[0][3], 127 / 255.0f, 1e-6f);
}

/// A triangle whose vertices have a line of numbers behind their coordinates.
Result<TriangleMesh> colored_ply(const std::string& properties, const std::string& numbers) {
  std::string body;
  for (const char* at : {"0 0 0 ", "1 0 0 ", "0 1 0 "}) body += at + numbers + "\n";
  return ply("element vertex 3\nproperty float x\nproperty float y\nproperty float z\n" +
             properties + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
             body + "3 0 1 2\n");
}
std::string three(const std::string& type, const std::string& before,
                  const std::array<const char*, 3>& names = {"red", "green", "blue"}) {
  std::string text;
  for (const char* name : names) text += "property " + type + " " + before + name + "\n";
  return text;
}

TEST(Polygons, ColoursThatPlyFilesWriteInOtherWays) {
  for (const std::string& properties :
       {three("int", ""), three("uint", ""), three("uchar", "diffuse_"),
        three("uchar", "", {"r", "g", "b"}), three("int8", "")}) {
    const bool is_signed_byte = properties.find("int8") != std::string::npos;
    const auto mesh = colored_ply(properties, is_signed_byte ? "127 0 0" : "255 0 0");
    ASSERT_TRUE(mesh) << mesh.error().message;
    ASSERT_EQ(mesh->colors.size(), 3u) << properties;
    EXPECT_EQ(mesh->colors[0], (VertexColor{1, 0, 0, 1})) << properties;
    EXPECT_EQ(mesh->repairs.colors + mesh->repairs.unread_colors, 0u);
  }
}

TEST(Polygons, ColoursThatAreCutOrNotReadAreCounted) {
  const auto cut = colored_ply(three("float", ""), "nan -0.5 2");
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_EQ(cut->colors[0], (VertexColor{1, 0, 1, 1}));
  EXPECT_EQ(cut->repairs.colors, 3u);
  EXPECT_EQ(colored_ply(three("float", ""), "1.0001 0 0")->repairs.colors, 0u) << "rounding";

  const auto red = colored_ply("property uchar red\n", "255");
  EXPECT_TRUE(red->colors.empty());
  EXPECT_EQ(red->repairs.unread_colors, 3u);
  const auto faces =
      ply("element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 1\nproperty list uchar int vertex_indices\nproperty uchar red\n"
          "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
          "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 9\n0 1\n");
  EXPECT_EQ(faces->repairs.unread_colors, 1u);
  EXPECT_EQ(faces->repairs.lines, 1u);

  const auto load = [](const char* name, const std::string& text) {
    return *load_mesh(write_test_file(name, text), true);
  };
  const std::string off = "3 1 0\n0 0 0 1 0 0 1\n1 0 0 1 0 0 1\n0 1 0 1 0 0 1\n3 0 1 2";
  EXPECT_EQ(load("c.off", "COFF\n" + off + "\n").repairs.unread_colors, 3u);
  EXPECT_EQ(load("f.off", "OFF\n" + off + " 255 0 0\n").repairs.unread_colors, 1u);
  EXPECT_EQ(load("p.off", "OFF\n" + off + " # plain\n").repairs.unread_colors, 0u);
  const std::string v = "v 0 0 0 1 0 0\nv 1 0 0 1 1 0 0\nv 0 1 0 1\nf 1 2 3\n";
  EXPECT_EQ(load("c.obj", v).repairs.unread_colors, 2u);
}

TEST(Polygons, ObjFilesAsPeopleWriteThem) {
  const auto obj = [](const std::string& text) {
    return load_mesh(write_test_file("form.obj", text), true, true);
  };
  const std::string vertices = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\n";
  for (const std::string& faces :
       {std::string("f 1 2 3 4\n"), std::string("f -4 -3 -2 -1"), std::string("f 1 2 \\\n 3 4\r\n"),
        std::string("o a\ng b\nusemtl c\ns 1\nf 1// 2// 3//\nf 1/0 3 4 # end\n")}) {
    const auto mesh = obj(vertices + faces);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_NEAR(area_of(*mesh), 1, 1e-6);
    for (const Vec3& n : mesh->normals) EXPECT_NEAR(n.z, 1, 1e-6f);
  }
  // One face without normals, one without coordinates: the others keep theirs.
  const auto some = obj(vertices +
                        "vn 0 .6 .8\nvt 0 0\nvt 1 0\nvt 1 1\n"
                        "f 1/1/1 2/2/1 3/3/1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 5 6 7\n");
  ASSERT_TRUE(some) << some.error().message;
  for (std::size_t i = 0; i < some->normals.size(); ++i)
    EXPECT_NEAR(some->normals[i].z, some->positions[i].x >= 5 ? 1 : 0.8f, 1e-6f);
  EXPECT_EQ(some->repairs.normals, 3u);
  EXPECT_EQ(some->repairs.uvs, 3u);
  EXPECT_EQ(obj(vertices + "l 1 2\np 1\nf 1 2 3\n")->repairs.lines, 2u);
}

TEST(Polygons, PositionsFarAwayKeepTheirForm) {
  const double north = 5411932;
  const std::string path = write_test_file(
      "utm.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
      "property double z\nelement face 1\nproperty list uchar int vertex_indices\n"
      "end_header\n448262 5411932 310\n448262.01 5411932 310\n448262 5411932.01 310\n3 0 1 2\n");
  const auto mesh = load_mesh(path, true);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_NEAR(area_of(*mesh), 5e-5, 1e-9);
  const auto job = parse_job(R"({"name": "j", "frames": "1", "environment": {"map": "/m.exr"},
      "camera": {"position": [0, 0, 9], "lookAt": [0, 0, 0]}, "scene": {"meshes": {"a": ")" +
                                 path +
                                 R"("}, "materials": {"m": {"type": "diffuse"}}, "objects": [
      {"mesh": "a", "material": "m", "upAxis": "z", "center": true, "placeOnGround": true},
      {"mesh": "a", "material": "m"}]}})",
                             "job", "/");
  ASSERT_TRUE(job) << job.error().message;
  const auto scene = load_scene(*job);
  ASSERT_TRUE(scene) << scene.error().message;
  const auto corner = [&](std::size_t i, std::size_t k) {
    return scene->instances[i].to_world.point(scene->meshes[0].positions[k]);
  };
  EXPECT_NEAR(corner(0, 0).x, -0.005f, 1e-6f);
  EXPECT_NEAR(corner(0, 0).y, 0, 1e-6f);
  EXPECT_NEAR(corner(0, 1).x, 0.005f, 1e-6f);
  EXPECT_NEAR(corner(1, 0).y, north, 1) << "where the file has it, to the float's spacing";
}

}  // namespace
}  // namespace baton
