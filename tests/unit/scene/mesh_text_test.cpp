// Texts of meshes as other programs and editors write them: the same mesh, or what is left out
// said.
#include "common/scene/mesh/mesh_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <regex>
#include <string>

#include "common/scene/mesh_loader.h"
#include "tests/support/mesh_area.h"
#include "tests/support/mesh_files.h"

namespace baton {
namespace {

using test::area_of;
using test::write_test_file;
using testing::HasSubstr;

Result<TriangleMesh> load(const std::string& extension, const std::string& text) {
  return load_mesh(write_test_file("text." + extension, text), false);
}
std::string error_of(const Result<TriangleMesh>& mesh) {
  return mesh ? "no error" : mesh.error().message;
}
/// A square of area 1, of which nothing is repaired.
void expect_square(const std::string& extension, const std::string& text) {
  const auto mesh = load(extension, text);
  ASSERT_TRUE(mesh) << mesh.error().message << "\n" << text;
  EXPECT_EQ(mesh->positions.size(), 4u) << text;
  EXPECT_NEAR(area_of(*mesh), 1, 1e-6) << text;
  EXPECT_EQ(mesh->repairs, MeshRepairs()) << text;
}

const std::string kObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
const std::string kOff = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

TEST(MeshText, LinesEndInAnyWayBehindAMarkOrWithout) {
  for (const auto& [extension, text] :
       {std::pair{"obj", kObj}, {"off", kOff}, {"off", "# a\n" + kOff}, {"ply", kPly}}) {
    for (const std::string end : {"\n", "\r\n", "\r"}) {
      const std::string ended = std::regex_replace(text, std::regex("\n"), end);
      expect_square(extension, ended);
      expect_square(extension, "\xEF\xBB\xBF" + ended);
      expect_square(extension, ended.substr(0, ended.size() - end.size()));
    }
    for (const std::string mark : {"\xFF\xFE", "\xFE\xFF"})
      EXPECT_THAT(error_of(load(extension, mark + text)), HasSubstr("UTF-16"));
  }
  // Without an unused vertex at the end a lost first line would be an error.
  expect_square("obj", "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 5 0\nf 1 2 3 4\n");
  EXPECT_THAT(error_of(load("obj", "v 0 0 0\rv 1 0 0\rv 0 x 0\r")), HasSubstr("line 3: "));
  EXPECT_THAT(error_of(load("off", "OFF\r\n3 1\r\n0 0 0\r\n0 x 0\r\n")), HasSubstr("line 4: "));
}

// Data may begin with the byte of a line end.
TEST(MeshText, ABinaryBodyBeginsBehindTheHeader) {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string bytes = kPly.substr(0, kPly.find("0 0 0"));
    bytes = std::regex_replace(bytes, std::regex("ascii"), "binary_little_endian");
    bytes = std::regex_replace(bytes, std::regex("\n"), end);
    float x = 0;
    const char raw[4] = {'\n', 0, 0, 0};
    std::memcpy(&x, raw, 4);
    ASSERT_LT(x, 1e-30f);
    for (const float v : {x, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f})
      bytes.append(reinterpret_cast<const char*>(&v), 4);
    bytes += '\x04';
    for (const int v : {0, 1, 2, 3}) bytes.append(reinterpret_cast<const char*>(&v), 4);
    expect_square("ply", bytes);
  }
}

TEST(MeshText, FacesOfObjFilesMayComeFirst) {
  const std::string vertices = kObj.substr(0, kObj.find('f'));
  expect_square("obj", "f 1 2 3 4\n" + vertices);
  expect_square("obj", vertices.substr(0, 16) + "f -2 -1 3 4\n" + vertices.substr(16));
  const auto full =
      load_mesh(write_test_file("first.obj", "f 1/1/1 2/2/1 3/3/1\n" + vertices +
                                                 "vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\n"),
                true, true);
  ASSERT_TRUE(full) << full.error().message;
  EXPECT_EQ(full->repairs, MeshRepairs());
  EXPECT_FALSE(full->normals.empty() || full->uvs[0].empty());

  // What is not there at the end is said with its line and its list.
  EXPECT_THAT(error_of(load("obj", vertices + "f 1 2 3\nf 1 2 9\nf 1 2 7\n")),
              HasSubstr("line 6: expected vertices from 1 to 4, which the file has, got 9"));
  EXPECT_THAT(error_of(load("obj", vertices + "vt 0 0\nf 1/1 2/1 3/2\n")),
              HasSubstr("line 6: expected texture coordinates from 1 to 1"));
  EXPECT_THAT(error_of(load("obj", vertices + "f 1//1 2//1 3//1\n")),
              HasSubstr("line 5: expected normals from 1 to 0"));
  for (const std::string face : {"f -5 1 2\n", "f 99999999999 1 2\n", "f 1 2 1.5\n", "f 0 1 2\n"})
    EXPECT_THAT(error_of(load("obj", vertices + face)),
                HasSubstr("line 5: expected corners of vertices"));
}

TEST(MeshText, WhatOfObjFilesIsNotReadIsCounted) {
  const auto repairs = [](const std::string& more) { return load("obj", kObj + more)->repairs; };
  EXPECT_EQ(repairs("cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 4 3\nparm u 0 1\nparm v 0 1\nend\n"
                    "cstype bspline\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\n"),
            MeshRepairs{.formulas = 2});
  EXPECT_EQ(repairs("bzp 1 2 3 4\ncdc 1 2 3\n"), MeshRepairs{.formulas = 2});
  EXPECT_EQ(repairs("call more.obj\nvertex 1 2 3\nF 1 2 3\n"), (MeshRepairs{.unread_lines = 3}));
  EXPECT_EQ(repairs("mtllib a.mtl\nusemtl b\no c\ng d e\ns off\nmg 1 2\nlod 3\n# f\n\n \t\n"),
            MeshRepairs());
}

TEST(MeshText, NumbersBeyondADoubleAreNotFinite) {
  for (const std::string number : {"1e400", "-1e400", "inf", "nan", "1.#INF", "-1.#IND"}) {
    const std::string rest = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv " + number + " 1 0\nf 1 2 3\nf 2 4 3\n";
    const auto mesh = load("obj", rest);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(mesh->repairs, MeshRepairs{.nowhere = 1}) << number;
    std::string off = kOff, ply = kPly;
    off.replace(off.find("1 1 0"), 1, number);
    off.replace(off.find("4 1 0"), 3, "4 2");
    off.replace(off.find("4 0 1 2 3"), 9, "3 0 1 3\n3 1 2 3");
    ASSERT_TRUE(load("off", off)) << error_of(load("off", off));
    EXPECT_EQ(load("off", off)->repairs, MeshRepairs{.nowhere = 1});
    ply.replace(ply.find("1 1 0"), 1, number);
    ply.replace(ply.find("face 1"), 6, "face 2");
    ply.replace(ply.find("4 0 1 2 3"), 9, "3 0 1 3\n3 1 2 3");
    ASSERT_TRUE(load("ply", ply)) << error_of(load("ply", ply));
    EXPECT_EQ(load("ply", ply)->repairs, MeshRepairs{.nowhere = 1});
  }
  EXPECT_EQ(real_number("1e-400"), 0);
  EXPECT_EQ(real_number("+.5"), 0.5);
  for (const char* word : {"", "+", "x", "1x", "0x10", "1,5", "5.0D-1"})
    EXPECT_FALSE(real_number(word)) << word;
}

TEST(MeshText, OffFilesOfEveryForm) {
  const std::string v[] = {"0 0 0", "1 0 0", "1 1 0", "0 1 0"};
  const auto with = [&](const std::string& first, const std::string& more,
                        const std::string& between = "\n") {
    std::string text = first;
    for (const std::string& p : v) text += p + more + between;
    return text + "4 0 1 2 3\n";
  };
  for (const std::string between : {"\n", " "}) {
    expect_square("off", with("4 1 0\n", "", between));  // without the word
    expect_square("off", with("4 1\n", "", between));
    expect_square("off", with("OFF 4 1 0 ", "", between));
    expect_square("off", with("nOFF 3\n4 1 0\n", "", between));
    expect_square("off", with("NOFF\n4 1 0\n", " 0 0 1", between));
    expect_square("off", with("STOFF\n4 1 0\n", " .1 .2", between));
    expect_square("off", with("STNOFF\n4 1 0\n", " 0 0 1 .1 .2", between));
    const auto full = load("off", with("STCNOFF\n4 1 0\n", " 0 0 1 1 0 0 1 .1 .2", between));
    ASSERT_TRUE(full) << full.error().message;
    EXPECT_NEAR(area_of(*full), 1, 1e-6);
    EXPECT_EQ(full->repairs, MeshRepairs{.unread_colors = 4});
    const auto scaled = load("off", with("4OFF\n4 1 0\n", " 2", between));
    ASSERT_TRUE(scaled) << scaled.error().message;
    EXPECT_NEAR(area_of(*scaled), 0.25, 1e-6);
  }
  expect_square("off", "OFF\n4 1 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n4 0 1 2 3\n");
  expect_square("off", "OFF\n4 2 0\n0\n0\n0\n1 0\n0 1 1 0\n0 1 0\n3 0 1\n2 3\n0 2 3");
  expect_square("off", "OFF 4 2 0 0 0 0 1 0 0 1 1 0 0 1 0 3 0 1 2 3 0 2 3");
  // Behind counts and faces of a line each anything may stand.
  const auto colored = load("off", "OFF\n4 1 0 9\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n");
  ASSERT_TRUE(colored) << colored.error().message;
  EXPECT_EQ(colored->repairs, MeshRepairs{.unread_colors = 1});

  EXPECT_THAT(error_of(load("off", "OFF BINARY\n4 1 0\n")), HasSubstr("binary OFF, expected text"));
  EXPECT_THAT(error_of(load("off", "nOFF 4\n4 1 0\n")), HasSubstr("expected 3, "));
  EXPECT_THAT(error_of(load("off", "LIST\n4 1 0\n")), HasSubstr("expected \"OFF\""));
}

TEST(MeshText, AlphaOfPlyFilesWithoutColoursIsCounted) {
  std::string text = kPly;
  text.replace(text.find("element face"), 0, "property uchar alpha\n");
  for (const char* place : {"0 0 0\n", "1 0 0\n", "1 1 0\n", "0 1 0\n"})
    text.insert(text.find(place) + 5, " 100");
  EXPECT_EQ(load("ply", text)->repairs, MeshRepairs{.unread_colors = 4});
}

}  // namespace
}  // namespace baton
