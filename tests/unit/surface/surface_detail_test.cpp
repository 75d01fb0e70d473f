#include "worker/surface/seen_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/scene/material/detail_loader.h"
#include "common/scene/mesh/tangents.h"
#include "tests/support/image_files.h"

namespace baton {
namespace {

using test::write_targa;
using test::write_test_file;
using testing::HasSubstr;

constexpr ShadingPoint kFromAbove{{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};

/// A square in the plane z = 0, an image upright on it, as an OBJ file; mirrored: left to right.
std::string square_obj(bool mirrored = false) {
  return write_test_file("square.obj", std::string("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n") +
                                           (mirrored ? "vt 1 0\nvt 0 0\nvt 0 1\nvt 1 1\n"
                                                     : "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n") +
                                           "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n");
}

JobSpec job_of(const MaterialSpec& material, const std::string& mesh) {
  JobSpec job;
  job.scene.materials["paper"] = material;
  job.scene.meshes["square"] = {.path = mesh};
  job.scene.objects = {{.mesh = "square", .material = "paper"}};
  return job;
}

/// What is seen of the square at (x, y), from straight above.
SeenSurface seen_at(const Scene& scene, float x, float y, float width = 0) {
  const bool lower = x > y;
  const SurfacePlace place =
      lower ? SurfacePlace{0, x - y, y, width} : SurfacePlace{1, x, y - x, width};
  ShadingPoint point = kFromAbove;
  point.position = {x, y, 0};
  return see_detail(scene, scene.instances[0], place, point);
}

Scene scene_of(const MaterialSpec& material, const std::string& mesh = square_obj()) {
  Result<Scene> scene = load_scene(job_of(material, mesh));
  EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
  return scene.ok() ? std::move(*scene) : Scene{};
}

std::string error_of(const JobSpec& job) {
  const Result<Scene> scene = load_scene(job);
  return scene.ok() ? "none" : scene.error().message;
}

/// Red and green above, blue and white below, without blending.
TextureSpec four_colors() {
  return {
      .file = write_targa("four.tga", 2, 2, 3, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}),
      .filter = TextureFilter::nearest};
}

TEST(SurfaceDetail, AnImageLiesUprightAndIsAFactor) {
  const Scene scene = scene_of({.base_color = {0.5f, 1, 1}, .color_texture = four_colors()});
  EXPECT_EQ(seen_at(scene, 0.2f, 0.7f).material.kd, (Rgb{0.5f, 0, 0}));
  EXPECT_EQ(seen_at(scene, 0.7f, 0.8f).material.kd, (Rgb{0, 1, 0}));
  EXPECT_EQ(seen_at(scene, 0.2f, 0.3f).material.kd, (Rgb{0, 0, 1}));
  EXPECT_EQ(seen_at(scene, 0.8f, 0.3f).material.kd, (Rgb{0.5f, 1, 1}));
  // Seen from afar it is the mean.
  EXPECT_NEAR(seen_at(scene, 0.5f, 0.5f, 1).material.kd.x, 0.25f, 1e-4f);
}

TEST(SurfaceDetail, ATransformTurnsScalesAndMoves) {
  // The lower left quarter of the image, turned: the example of KHR_texture_transform.
  TextureSpec texture = four_colors();
  texture.offset = {0, 1};
  texture.scale = {0.5f, 0.5f};
  texture.rotate_deg = 90;
  const Scene quarter = scene_of({.base_color = {1, 1, 1}, .color_texture = texture});
  for (const float x : {0.1f, 0.6f, 0.9f})
    EXPECT_EQ(seen_at(quarter, x, 0.5f).material.kd, (Rgb{0, 0, 1}));
  // All of it, turned by a right angle: what was above on the left is now at the right... of below.
  texture.scale = {1, 1};
  const Scene turned = scene_of({.base_color = {1, 1, 1}, .color_texture = texture});
  EXPECT_EQ(seen_at(turned, 0.8f, 0.7f).material.kd, (Rgb{1, 0, 0}));
  EXPECT_EQ(seen_at(turned, 0.2f, 0.7f).material.kd, (Rgb{0, 0, 1}));
}

TEST(SurfaceDetail, TexturesThatLieDifferentlyAreFoundApart) {
  // Left half rough, right half metal.
  const std::string file = write_targa("mr.tga", 2, 1, 3, {0, 255, 0, 0, 51, 255});
  MaterialSpec spec{.kind = MaterialKind::metallic_roughness,
                    .base_color = {1, 1, 1},
                    .metallic = 1,
                    .roughness = 1};
  spec.color_texture = four_colors();
  spec.metallic_roughness_texture = TextureSpec{.file = file, .filter = TextureFilter::nearest};
  const auto is_metal = [&](float x) {
    const Scene scene = scene_of(spec);
    const Material seen = seen_at(scene, x, 0.7f).material;
    const bool is_green = x > 0.5f;
    EXPECT_EQ(seen.ks.x > 0.9f, false);
    EXPECT_NEAR(std::max(seen.kd.y, seen.ks.y), is_green ? 1 : 0.04f, 1e-4f) << x;
    return seen.kd == Rgb{};
  };
  EXPECT_EQ(is_metal(0.7f), true);
  EXPECT_EQ(is_metal(0.2f), false);
  spec.metallic_roughness_texture->offset = {0.5f, 0};
  EXPECT_EQ(scene_of(spec).materials[0].detail->alike.size(), 2u);
  EXPECT_EQ(is_metal(0.7f), false);
  spec.metallic_roughness_texture->offset = {0, 0};
  spec.metallic_roughness_texture->scale = {-1, 1};
  EXPECT_EQ(is_metal(0.7f), false);
  spec.metallic_roughness_texture->scale = {1, 1};
  spec.normal_texture =
      TextureSpec{.file = write_targa("n.tga", 4, 4, 3, std::vector<std::uint8_t>(48, 128))};
  EXPECT_EQ(scene_of(spec).materials[0].detail->alike.size(), 2u);  // it blends
  spec.normal_texture->filter = TextureFilter::nearest;
  EXPECT_EQ(scene_of(spec).materials[0].detail->alike.size(), 1u);
}

TEST(SurfaceDetail, MetalAndRoughnessAreFactors) {
  const std::string file = write_targa("mr.tga", 1, 1, 3, {9, 128, 51});
  MaterialSpec spec{.kind = MaterialKind::metallic_roughness,
                    .base_color = {1, 0.5f, 0.25f},
                    .metallic = 0.5f,
                    .roughness = 0.8f};
  spec.metallic_roughness_texture = TextureSpec{.file = file};
  const Material got = seen_at(scene_of(spec), 0.5f, 0.4f).material;
  const Material expected = make_material(spec, spec.base_color, 0.5f * 0.2f, 0.8f * 128 / 255.0f);
  EXPECT_NEAR(got.shape, expected.shape, 1e-5f);
  EXPECT_NEAR(got.ks.x, expected.ks.x, 1e-5f);
  EXPECT_NEAR(got.kd.y, expected.kd.y, 1e-5f);
}

// The coat keeps the normal of the mesh where a map turns that of what is below.
TEST(SurfaceDetail, ACoatHasImagesAndANormalOfItsOwn) {
  MaterialSpec spec{
      .kind = MaterialKind::metallic_roughness, .clearcoat = 0.8f, .clearcoat_roughness = 0.5f};
  spec.emission = {2, 2, 2};
  spec.clearcoat_texture = TextureSpec{.file = write_targa("c.tga", 1, 1, 3, {128, 9, 7})};
  spec.clearcoat_roughness_texture =
      TextureSpec{.file = write_targa("r.tga", 1, 1, 3, {9, 102, 7})};
  spec.normal_texture = TextureSpec{.file = write_targa("n.tga", 1, 1, 3, {255, 128, 255})};
  const SeenSurface seen = seen_at(scene_of(spec), 0.3f, 0.4f);
  const float weight = 0.8f * 128 / 255, alpha = 0.2f * 0.2f;
  EXPECT_NEAR(seen.material.coat.weight, weight, 1e-4f);
  EXPECT_NEAR(seen.material.coat.alpha, alpha, 1e-4f);
  EXPECT_EQ(seen.material.coat.normal, (Vec3{0, 0, 1}));
  EXPECT_NEAR(seen.point.ns.x, std::sqrt(0.5f), 0.01f);
  // What glows below shines through.
  EXPECT_NEAR(seen.emission.x, 2 * (1 - 0.04f * weight), 1e-4f);

  // A map of the coat turns it alone, by its own strength; bent so that it mirrors no light from
  // below.
  spec.clearcoat_normal_texture =
      TextureSpec{.file = write_targa("cn.tga", 1, 1, 3, {128, 255, 255}), .strength = 0.5f};
  const SeenSurface both = seen_at(scene_of(spec), 0.3f, 0.4f);
  EXPECT_EQ(both.point.ns, seen.point.ns);
  EXPECT_NEAR(both.material.coat.normal.y, 0.5f / std::sqrt(1.25f), 0.01f);
  EXPECT_NEAR(both.material.coat.normal.x, 0, 0.01f);
  spec.clearcoat_normal_texture->strength = 30;
  const Vec3 steep = seen_at(scene_of(spec), 0.3f, 0.4f).material.coat.normal;
  EXPECT_GT(reflect({0, 0, 1}, steep).z, 0.005f);
  MaterialSpec coat_only = spec;
  coat_only.normal_texture.reset();
  EXPECT_EQ(seen_at(scene_of(coat_only), 0.3f, 0.4f).point.ns, (Vec3{0, 0, 1}));
  spec.clearcoat_normal_texture.reset();

  // Grey images stand for all channels; smoother than smooth is smooth.
  spec.clearcoat_roughness_texture = TextureSpec{.file = write_targa("g.tga", 1, 1, 1, {1})};
  EXPECT_FLOAT_EQ(seen_at(scene_of(spec), 0.3f, 0.4f).material.coat.alpha, 0.02f * 0.02f);
}

TEST(SurfaceDetail, ANormalMapTurnsTheNormalAsItsImageLies) {
  // 45 degrees to the right of the image; then upward.
  for (const bool mirrored : {false, true}) {
    for (const bool upward : {false, true}) {
      const auto across = static_cast<std::uint8_t>(upward ? 128 : 255);
      const auto up = static_cast<std::uint8_t>(upward ? 255 : 128);
      MaterialSpec spec{.base_color = {1, 1, 1}};
      spec.normal_texture = TextureSpec{.file = write_targa("n.tga", 1, 1, 3, {across, up, 255})};
      const Vec3 n = seen_at(scene_of(spec, square_obj(mirrored)), 0.3f, 0.4f).point.ns;
      const float half = std::sqrt(0.5f);
      EXPECT_NEAR(n.x, upward ? 0 : (mirrored ? -half : half), 0.01f) << mirrored << upward;
      EXPECT_NEAR(n.y, upward ? half : 0, 0.01f) << mirrored << upward;
      spec.normal_texture->strength = 0;
      EXPECT_NEAR(seen_at(scene_of(spec), 0.3f, 0.4f).point.ns.z, 1, 1e-5f);
    }
  }
}

TEST(SurfaceDetail, MirroredImagesThatMeetPartTheirVertices) {
  TriangleMesh mesh{.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}},
                    .normals = std::vector<Vec3>(6, Vec3{0, 0, 1}),
                    .triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}}};
  mesh.uvs[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}, {0, 1}, {0, 0}};
  derive_tangents(mesh, 0);
  EXPECT_EQ(mesh.positions.size(), 8u);
  for (std::size_t t = 0; t < 4; ++t) {
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      EXPECT_NEAR(mesh.tangents[vertex].direction.x, t < 2 ? 1 : -1, 1e-5f);
      EXPECT_EQ(mesh.tangents[vertex].side, t < 2 ? 1 : -1);
    }
  }
}

TEST(SurfaceDetail, BentNormalsKeepTheMirrorImageAbove) {
  std::mt19937 random(3);
  std::normal_distribution<float> gauss;
  const auto direction = [&] { return normalize({gauss(random), gauss(random), gauss(random)}); };
  int bent = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 ng = direction();
    Vec3 normal = direction(), wo = direction();
    if (dot(normal, ng) < 0) normal = -normal;
    if (dot(wo, ng) < 0) wo = -wo;
    const Vec3 got = bent_normal(normal, ng, wo);
    EXPECT_NEAR(length(got), 1, 1e-4f);
    const float threshold = std::min(0.9f * dot(wo, ng), 0.01f);
    EXPECT_GE(dot(reflect(wo, got), ng), threshold - 2e-4f);
    if (got == normal) continue;
    ++bent;
    EXPECT_GE(dot(got, ng), dot(normal, ng) - 1e-4f);
    EXPECT_NEAR(dot(cross(normal, ng), got), 0, 1e-4f);  // in the plane of both
  }
  EXPECT_GT(bent, 2000);
  EXPECT_LT(bent, 18000);
}

TEST(SurfaceDetail, NothingIsThereBelowTheCutOff) {
  const std::string file =
      write_targa("holes.tga", 2, 1, 4, {255, 255, 255, 255, 255, 255, 255, 100});
  MaterialSpec spec{.base_color = {1, 1, 1}, .alpha = 1, .alpha_cutoff = 0.5f};
  spec.color_texture = TextureSpec{.file = file, .filter = TextureFilter::nearest};
  const Scene scene = scene_of(spec);
  const auto is_away = [](const Scene& s, float x, float y) {
    const SurfacePlace place{x > y ? 0u : 1u, x > y ? x - y : x, x > y ? y : y - x};
    return is_cut_away(s, s.instances[0], place, 0.9f);
  };
  EXPECT_FALSE(is_away(scene, 0.3f, 0.2f));
  EXPECT_TRUE(is_away(scene, 0.8f, 0.2f));
  spec.alpha_cutoff = 0.3f;
  EXPECT_FALSE(is_away(scene_of(spec), 0.8f, 0.2f));
  spec.alpha = 0.5f;
  EXPECT_TRUE(is_away(scene_of(spec), 0.8f, 0.2f));
  // An image without alpha has no holes.
  spec.color_texture = four_colors();
  EXPECT_FALSE(is_away(scene_of(spec), 0.8f, 0.2f));
}

TEST(SurfaceDetail, AlphaAtTheCutOffIsThere) {
  const std::string file = write_targa("whole.tga", 8, 8, 4, std::vector<std::uint8_t>(256, 255));
  MaterialSpec spec{.base_color = {1, 1, 1}, .alpha = 0.5f, .alpha_cutoff = 0.5f};
  spec.color_texture = TextureSpec{.file = file};
  const auto count_away = [&] {
    const Scene scene = scene_of(spec);
    int count = 0;
    for (int i = 0; i < 5000; ++i) {
      const float u = static_cast<float>(i % 71) / 142, v = static_cast<float>(i % 53) / 106;
      count += is_cut_away(scene, scene.instances[0], {0, u, v}, 0.9f);
    }
    return count;
  };
  EXPECT_EQ(count_away(), 0);
  spec.alpha = 0.4999f;
  EXPECT_EQ(count_away(), 5000);
  // However low the cut-off, nothing is below it where alpha is 0.
  spec.alpha = 0;
  spec.alpha_cutoff = 1e-6f;
  EXPECT_EQ(count_away(), 5000);
}

TEST(SurfaceDetail, ColoursOfVerticesAreFactorsOfColourAndAlpha) {
  const std::string ply = write_test_file(
      "coloured.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nproperty float red\nproperty float green\n"
      "property float blue\nproperty float alpha\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n"
      "0 0 0 1 0 0 1\n1 0 0 0 1 0 0.5\n1 1 0 0 0 1 0\n3 0 1 2\n");
  const Scene plain = scene_of({.base_color = {0.5f, 0.5f, 1}}, ply);
  const Rgb seen = seen_at(plain, 0.75f, 0.25f).material.kd;  // a quarter, a half, a quarter
  EXPECT_NEAR(seen.x, 0.125f, 1e-6f);
  EXPECT_NEAR(seen.y, 0.25f, 1e-6f);
  EXPECT_NEAR(seen.z, 0.25f, 1e-6f);
  const Scene holed = scene_of({.base_color = {1, 1, 1}, .alpha = 1, .alpha_cutoff = 0.5f}, ply);
  EXPECT_FALSE(is_cut_away(holed, holed.instances[0], {0, 0.1f, 0.1f}, 1));
  EXPECT_TRUE(is_cut_away(holed, holed.instances[0], {0, 0.1f, 0.8f}, 1));
}

TEST(SurfaceDetail, EmissionIsRadianceTimesItsImage) {
  MaterialSpec spec{.base_color = {0, 0, 0}, .emission = {4, 2, 1}};
  spec.emission_texture = four_colors();
  const Scene scene = scene_of(spec);
  EXPECT_EQ(seen_at(scene, 0.2f, 0.7f).emission, (Rgb{4, 0, 0}));
  EXPECT_EQ(seen_at(scene, 0.8f, 0.3f).emission, (Rgb{4, 2, 1}));
}

TEST(SurfaceDetail, SaysWhatIsMissing) {
  MaterialSpec spec{.color_texture = TextureSpec{.file = "/no/such.png"}};
  EXPECT_EQ(error_of(job_of(spec, square_obj())),
            "scene.materials.paper: /no/such.png: missing: expected an image file");
  spec.color_texture = four_colors();
  spec.color_texture->uv = 1;
  EXPECT_THAT(error_of(job_of(spec, square_obj())),
              HasSubstr("square.obj, mesh \"square\" has no texture coordinates of set 1, which "
                        "colorTexture of material \"paper\" needs"));
  spec.color_texture->uv = 0;
  const std::string bare = write_test_file("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_THAT(error_of(job_of(spec, bare)), HasSubstr("no texture coordinates of set 0"));
  const std::string odd = write_test_file(
      "odd.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nvt 0 0\nvt 0 1\nf 1/1 2/2 3/3\n");
  EXPECT_EQ(error_of(job_of(spec, odd)), "none");
}

}  // namespace
}  // namespace baton
