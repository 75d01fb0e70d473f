// What sites see, and what textures say of it.
#include "worker/pass/primary.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/image_files.h"
#include "tests/support/render_tiled.h"

namespace baton {
namespace {

using test::render_tiled;
using test::sequence_job;

/// A tiled ground below a box that glows through its coat, and one without detail.
JobSpec detailed_job(int frames) {
  JobSpec job = sequence_job(frames);
  job.sampling.method = Method::pool;
  job.sampling.num_candidates = 32;
  MaterialSpec& ground = job.scene.materials["ground"];
  ground.kind = MaterialKind::metallic_roughness;
  const auto image = [](const std::string& name, int step) {
    std::vector<std::uint8_t> values;
    for (int i = 0; i < 3 * 16 * 16; ++i)
      values.push_back(static_cast<std::uint8_t>(step * i * i % 251));
    return TextureSpec{.file = test::write_targa(name, 16, 16, 3, values), .scale = {40, 40}};
  };
  ground.color_texture = image("color.tga", 7);
  ground.metallic_roughness_texture = image("rough.tga", 3);
  ground.normal_texture = image("normal.tga", 5);
  MaterialSpec& glowing = job.scene.materials["glossy"];
  glowing = {.kind = MaterialKind::metallic_roughness, .clearcoat = 0.7f, .emission = {1, 2, 3}};
  return job;
}

void expect_alike(const SeenSurface& a, const SeenSurface& b) {
  const Material &m = a.material, &n = b.material;
  EXPECT_EQ(a.point, b.point);
  EXPECT_EQ(a.emission, b.emission);
  EXPECT_EQ(m.lobe, n.lobe);
  EXPECT_EQ(m.kd, n.kd);
  EXPECT_EQ(m.ks, n.ks);
  EXPECT_EQ(m.shape, n.shape);
  EXPECT_EQ(m.specular_probability, n.specular_probability);
  EXPECT_EQ(m.f90, n.f90);
  EXPECT_EQ(m.dielectric_f0, n.dielectric_f0);
  EXPECT_EQ(m.dielectric_f90, n.dielectric_f90);
  EXPECT_EQ(m.metallic, n.metallic);
  EXPECT_EQ(m.coat.weight, n.coat.weight);
  EXPECT_EQ(m.coat.alpha, n.coat.alpha);
  EXPECT_EQ(m.coat.normal, n.coat.normal);
  EXPECT_EQ(m.coat.base_albedo, n.coat.base_albedo);
}

TEST(Primary, LooksAreWhatIsSeen) {
  const auto context = load_render_context(detailed_job(1), Digest{1, 2});
  ASSERT_TRUE(context.ok()) << context.error().message;
  const RenderContext& c = **context;
  const auto geometry = *c.geometry->at(Step(0));
  const TileSurfaces whole = trace_primary(c.job, *geometry, c.grid.rect(0));
  RoundPixels some;
  for (std::size_t i = 3; i < whole.pixels.size(); i += 4) some.add(i, 1);
  int num_detailed = 0, num_bare = 0;
  for (const TileSurfaces& surfaces : {whole, part_of(whole, some)}) {
    ASSERT_EQ(surfaces.shadings.size(), surfaces.hits.size());
    for (std::size_t i = 0; i < surfaces.hits.size(); ++i) {
      const SurfaceHit& hit = surfaces.hits[i];
      if (!hit.hit) continue;
      ++(geometry->material_of(hit).detail != nullptr ? num_detailed : num_bare);
      expect_alike(geometry->see(hit, surfaces.shading(i)), geometry->see(hit));
    }
  }
  EXPECT_GT(num_detailed, 100);
  EXPECT_GT(num_bare, 10);

  // Without detail there is nothing to keep.
  const auto bare = *load_render_context(sequence_job(1), Digest{1, 2});
  const auto place = *bare->geometry->at(Step(0));
  EXPECT_TRUE(trace_primary(bare->job, *place, bare->grid.rect(0)).shadings.empty());
}

// Where frames keep no surfaces they are looked up again.
TEST(Primary, SameBytesForAnyTilingWithTextures) {
  for (const bool moves : {false, true}) {
    JobSpec job = detailed_job(3);
    job.quality.rounds = 2;
    job.output.aovs = {Aov::albedo, Aov::normal};
    if (moves) test::set_in_motion(job, true, true);
    const std::vector<FilmTile> whole = render_tiled(job, 4096, 3);
    EXPECT_EQ(render_tiled(job, 5, 1), whole);
    EXPECT_EQ(render_tiled(job, 5, 1, test::keeping_nothing()), whole);
  }
}

}  // namespace
}  // namespace baton
