// Numbers of sites that follow the geometry.
#include "worker/pass/fine_sites.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/support/render_tiled.h"
#include "worker/pass/primary.h"
#include "worker/pass/site_rays.h"

namespace baton {
namespace {

using test::render_tiled;
using test::sequence_job;

JobSpec fine_job(Method method, int frames) {
  JobSpec job = sequence_job(frames);
  job.image.max_sites = 64;
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.sampling.num_particles = 4;
  job.quality.rounds = 2;
  job.output.aovs = {Aov::lns,    Aov::object, Aov::variance,     Aov::albedo,
                     Aov::motion, Aov::rounds, Aov::crypto_object};
  return job;
}

std::vector<PixelPlace> places_of(const PixelRect& rect) {
  std::vector<PixelPlace> places;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rect.area()); ++i)
    places.push_back(rect.place(i));
  return places;
}

// A plane has the least, an edge the most; no number depends on the pixels beside it.
TEST(FineSites, AreWhereGeometryIsFine) {
  const auto context = *load_render_context(fine_job(Method::pool, 1), Digest{1, 2});
  const auto geometry = *context->geometry->at(Step(0));
  const PixelRect rect = context->grid.rect(0);
  const std::vector<PixelPlace> places = places_of(rect);
  const auto counts = count_sites(context->job, *geometry, places);
  JobSpec many = context->job;  // by many sites: what a pixel truly sees
  many.image.sites = 16;
  const TileSurfaces seen = trace_primary(many, *geometry, rect);
  int num_flat = 0, num_least = 0, num_edges = 0, num_found = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_EQ(count_sites(context->job, *geometry, std::span(places).subspan(i, 1)).front(),
              counts[i]);
    const auto hits = seen.pixel(i);
    const bool flat = std::ranges::all_of(hits, [&](const SurfaceHit& hit) {
      return hit.hit == hits[0].hit && hit.instance == hits[0].instance &&
             hit.point.ns == hits[0].point.ns;
    });
    const bool edge = std::ranges::any_of(
        hits, [&](const SurfaceHit& hit) { return hit.instance != hits[0].instance; });
    num_least += flat && counts[i] == 4 ? 1 : 0;
    num_flat += flat ? 1 : 0;
    num_edges += edge ? 1 : 0;
    num_found += edge && counts[i] == 64 ? 1 : 0;
  }
  EXPECT_GT(num_flat, 20);
  EXPECT_GT(num_least, 0.9 * num_flat);
  EXPECT_GT(num_edges, 5);
  EXPECT_GT(num_found * 2, num_edges);  // four probes miss small parts
}

// Jobs of one siteSeed see the same points, whatever their seeds.
TEST(FineSites, FollowTheSeedOfTheSites) {
  const auto counts_of = [](std::uint64_t seed, std::uint64_t site_seed) {
    JobSpec job = fine_job(Method::pool, 1);
    job.seed = seed;
    job.image.site_seed = site_seed;
    const auto context = *load_render_context(job, Digest{1, 2});
    return count_sites(job, **context->geometry->at(Step(0)), places_of(context->grid.rect(0)));
  };
  EXPECT_EQ(counts_of(1, 9), counts_of(2, 9));
  EXPECT_NE(counts_of(1, 0), counts_of(2, 0));
}

TEST(FineSites, ContrastIsThatOfWhatReflects) {
  const auto context = *load_render_context(fine_job(Method::pool, 1), Digest{1, 2});
  FrameGeometry geometry = **context->geometry->at(Step(0));
  Scene scene = *context->scene;
  scene.materials = {
      make_material({.kind = MaterialKind::diffuse}),
      make_material({.kind = MaterialKind::metallic_roughness, .metallic = 1, .roughness = 0.3f})};
  geometry.scene = &scene;
  std::array<SurfaceHit, 4> hits;
  for (SurfaceHit& hit : hits) {
    hit.hit = true;
    hit.point.ns = {0, 1, 0};
  }
  EXPECT_EQ(site_contrast(geometry, hits), 0);
  // Normals 0.02 to either side.
  for (std::size_t i = 0; i < 4; ++i)
    hits[i].point.ns = normalize({i % 2 == 0 ? 0.02f : -0.02f, 1, 0});
  const float diffuse = site_contrast(geometry, hits);
  EXPECT_NEAR(diffuse, 0.02f, 1e-4f);
  for (SurfaceHit& hit : hits) hit.material = 1;
  const float alpha = 0.3f * 0.3f;
  EXPECT_GT(site_contrast(geometry, hits), diffuse * 0.5f / alpha);
  hits[3].material = 0;
  EXPECT_EQ(site_contrast(geometry, hits), 1);
  hits[3].material = 1;
  hits[2].hit = false;
  EXPECT_EQ(site_contrast(geometry, hits), 1);
  for (SurfaceHit& hit : hits) hit.hit = false;
  EXPECT_EQ(site_contrast(geometry, hits), 0);
}

// The first image.sites of a pixel are one in each cell, and all together one in each small cell.
TEST(FineSites, AreStratified) {
  for (const int coarse : {1, 4, 9, 16}) {
    JobSpec job = fine_job(Method::pool, 1);
    job.image.sites = coarse;
    job.image.max_sites = 16 * coarse;
    const auto context = *load_render_context(job, Digest{1, 2});
    const auto geometry = *context->geometry->at(Step(0));
    const Camera& camera = geometry->pose.camera;
    std::vector<Ray> rays;
    SiteRays(context->job, camera, 1).append(3, 4, 16 * coarse, rays);
    ASSERT_EQ(rays.size(), static_cast<std::size_t>(16 * coarse));
    const auto cells = [&](int count, int side) {
      std::vector<int> hits(static_cast<std::size_t>(side * side));
      for (int i = 0; i < count; ++i) {
        const auto at = *camera.project_direction(rays[static_cast<std::size_t>(i)].direction);
        const auto cell = [side](double x) {
          return std::clamp(static_cast<int>(std::floor(x * side)), 0, side - 1);
        };
        ++hits[static_cast<std::size_t>(cell(at[1] - 4) * side + cell(at[0] - 3))];
      }
      return std::ranges::count(hits, 1);
    };
    const auto side = static_cast<int>(std::lround(std::sqrt(coarse)));
    // A ray on a cell's edge may be rounded into the next one.
    EXPECT_GE(cells(coarse, side), coarse - 1);
    EXPECT_GE(cells(16 * coarse, 4 * side), 16 * coarse - 3);
  }
}

TEST(FineSites, OfAnyTilingAreTheSame) {
  for (const bool in_motion : {false, true}) {
    JobSpec job = fine_job(Method::pool, 3);
    if (in_motion) test::set_in_motion(job, true, true);
    const auto whole = render_tiled(job, 64, 3);
    EXPECT_EQ(render_tiled(job, 8, 1), whole) << in_motion;
    EXPECT_EQ(render_tiled(job, 16, 2, test::keeping_nothing()), whole) << in_motion;
  }
}

// A tile of more than limits::kMaxSitesAtOnce is rendered in parts.
TEST(FineSites, OfLargeTilesAreTheSame) {
  for (const bool in_motion : {false, true}) {
    JobSpec job = fine_job(Method::pool, 2);
    job.image.width = 96;
    job.image.height = 72;
    job.image.filter = PixelFilter::blackman_harris;
    job.image.max_sites = 256;
    job.scene.materials.at("ground") = {
        .kind = MaterialKind::metallic_roughness, .metallic = 1, .roughness = 0.02f};
    if (in_motion) test::set_in_motion(job, true, false);
    const auto context = *load_render_context(job, Digest{1, 2});
    const auto counts =
        count_sites(job, **context->geometry->at(Step(0)), places_of({0, 0, 96, 72}));
    const auto sum = std::accumulate(counts.begin(), counts.end(), std::size_t{0});
    EXPECT_GT(sum, 6912u * 4);
    EXPECT_EQ(render_tiled(job, 16, 1), render_tiled(job, 96, 2)) << in_motion << ", " << sum;
  }
}

TEST(FineSites, OfOneKindAreTheUsualOnes) {
  JobSpec job = fine_job(Method::pool, 2);
  job.image.max_sites = 4;
  const auto usual = render_tiled(job, 16, 2);
  job.image.max_sites = 0;
  EXPECT_EQ(render_tiled(job, 16, 2), usual);
}

}  // namespace
}  // namespace baton
