// Light between surfaces: against a closed form, and against a path tracer of our own that shares
// nothing with the product's but ray tracer and materials.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "tests/stat/against_brute_force.h"
#include "worker/pass/primary.h"

namespace baton {
namespace {

using test::Estimate;
using test::Moments;
using test::test_folder;

/// A sphere of radius 1 about the origin without its cap above z = 1 - 2 `open`, as an OFF file:
/// `open` is the cap's share of the area. Triangles are small beside what is told apart here.
std::string open_sphere(double open) {
  constexpr int kRings = 160, kSides = 320;
  const std::filesystem::path path = test_folder() / "sphere.off";
  std::ofstream file(path);
  file << "OFF\n" << (kRings + 1) * kSides << ' ' << 2 * kRings * kSides << " 0\n";
  for (int ring = 0; ring <= kRings; ++ring) {
    // Rings of equal height have equal areas.
    const double z = (1 - 2 * open) - (2 - 2 * open) * ring / kRings;
    const double radius = std::sqrt(std::max(1 - z * z, 1e-6));
    for (int side = 0; side < kSides; ++side) {
      const double angle = 2 * double{kPi} * side / kSides;
      file << radius * std::cos(angle) << ' ' << radius * std::sin(angle) << ' ' << z << '\n';
    }
  }
  for (int ring = 0; ring < kRings; ++ring) {
    for (int side = 0; side < kSides; ++side) {
      const int a = ring * kSides + side, b = ring * kSides + (side + 1) % kSides;
      file << "3 " << a << ' ' << b << ' ' << a + kSides << '\n';
      file << "3 " << b << ' ' << b + kSides << ' ' << a + kSides << '\n';
    }
  }
  return path.string();
}

/// The inside of such a sphere under light that is the same from everywhere.
JobSpec furnace(double open, float albedo, int bounces, int rounds) {
  JobSpec job = test::box_job();
  job.image = {.width = 24, .height = 24, .sites = 1, .tile_size = 4096};
  job.camera = {
      .position = {0, 0, 0.2f}, .look_at = {0.3f, 0, -1}, .up = {0, 1, 0}, .vertical_fov_deg = 60};
  job.scene = {};
  job.scene.materials["wall"] = {.kind = MaterialKind::diffuse,
                                 .base_color = {albedo, albedo, albedo}};
  job.scene.meshes["sphere"] = {.path = open_sphere(open), .smooth_normals = false};
  job.scene.objects = {{.mesh = "sphere", .material = "wall"}};
  job.environment.keys = {
      {.frame = 1, .map = test::write_map("one.exr", test::constant_map(8, 4, {1, 1, 1}))}};
  job.sampling.method = Method::mis;
  job.sampling.num_particles = 16;
  job.sampling.num_candidates = 64;
  job.quality.rounds = rounds;
  job.light.bounces = bounces;
  job.output.aovs = {Aov::indirect};
  return job;
}

/// Each inner point sees the share `open` of its cosine-weighted directions open, wherever it is:
/// albedo * open * sum_k (albedo (1 - open))^k, of which k = 0 is direct.
double furnace_light(double open, double albedo, int bounces) {
  double sum = 0, term = albedo * open;
  for (int k = 1; k <= bounces; ++k) sum += term *= albedo * (1 - open);
  return sum;
}

/// What came by other surfaces.
std::vector<double> indirect(const FilmTile& film) { return test::mean_rgb(film, "indirect"); }

// H0: the mean is the closed form. |z| < 3.5: level 5e-4 for each number of bounces. Seeds 1 to
// `runs`. What is resolved are 3.9 standard errors.
void expect_closed_form(int runs, double max_resolution) {
  constexpr double kOpen = 0.5, kAlbedo = 0.8;
  for (const int bounces : {1, 3, 12}) {
    const double truth = furnace_light(kOpen, kAlbedo, bounces);
    const Estimate seen =
        test::repeat(furnace(kOpen, static_cast<float>(kAlbedo), bounces, 16), runs, indirect);
    const double error = std::sqrt(seen.image_variance);
    EXPECT_LT(std::fabs(seen.image_mean - truth) / error, 3.5) << bounces << " bounces";
    EXPECT_LT(test::kResolvedErrors * error / truth, max_resolution);
    std::printf("  %d bounces: %+.3f %% (%.3f)\n", bounces, 100 * (seen.image_mean / truth - 1),
                100 * error / truth);
  }
}

TEST(Bounces, FurnaceHasItsClosedForm) { expect_closed_form(12, 0.01); }
TEST(Bounces, FurnaceHasItsClosedFormInTheLongRun) { expect_closed_form(600, 0.0012); }

/// Paths of cosine- and lobe-sampled directions, which add what they find where they leave the
/// scene and what glows on the way: what is seen directly left out.
class PathTracer {
 public:
  explicit PathTracer(const JobSpec& job)
      : job_(job), context_(load_render_context(job, Digest{1, 2}).value()) {
    geometry_ = context_->geometry->at(Step(0)).value();
    light_ = context_->lights->at(Step(0)).value();
  }

  Estimate render(int samples) {
    const TileSurfaces seen = trace_primary(job_, *geometry_, job_.image.rendered());
    Estimate estimate;
    double variance = 0, sum = 0;
    for (std::size_t pixel = 0; pixel < seen.pixels.size(); ++pixel) {
      Moments moments;
      for (int i = 0; i < samples; ++i) moments.add(path(seen.pixel(pixel)[0], pixel, i));
      estimate.mean.push_back(moments.mean());
      estimate.variance.push_back(moments.variance_of_mean());
      sum += moments.mean();
      variance += moments.variance_of_mean();
    }
    const auto n = static_cast<double>(estimate.mean.size());
    estimate.image_mean = sum / n;
    estimate.image_variance = variance / (n * n);
    return estimate;
  }

 private:
  double path(SurfaceHit hit, std::size_t pixel, int sample) const {
    if (!hit.hit) return 0;
    Rng rng({.job_seed = 4242,
             .frame = static_cast<std::uint32_t>(sample),
             .pixel = static_cast<std::uint32_t>(pixel)},
            PassId::reference);
    Rgb weight{1, 1, 1};
    double found = 0;
    for (int bounce = 0; bounce <= job_.light.bounces; ++bounce) {
      const SeenSurface seen = geometry_->see(hit);
      const auto u = rng.uniforms(static_cast<std::uint32_t>(bounce), 0);
      const Vec3 wi = sample_bsdf(seen.material, seen.point, {u[0], u[1], u[2]});
      const float pdf = bsdf_pdf_solid_angle(seen.material, seen.point, wi);
      if (!(pdf > 0)) return found;
      const float coat = evaluate_coat(seen.material, seen.point, wi);
      weight = weight *
               (evaluate_bsdf(seen.material, seen.point, wi) * dot(seen.point.ns, wi) +
                Rgb{coat, coat, coat}) /
               pdf;
      if (!(mean(weight) > 0)) return found;
      const Ray ray{hit.ray_origin, wi};
      geometry_->accel->intersect({&ray, 1}, {&hit, 1});
      if (!hit.hit) {
        const EnvironmentMap::Texel light = light_->now.evaluate(wi);
        if (bounce == 0) return 0;
        return found + mean(weight * Rgb{light.r, light.g, light.b});
      }
      if (bounce < job_.light.bounces) found += mean(weight * geometry_->see(hit).emission);
    }
    return found;
  }

  const JobSpec& job_;
  std::shared_ptr<const RenderContext> context_;
  std::shared_ptr<const FrameGeometry> geometry_;
  std::shared_ptr<const FrameLight> light_;
};

/// A box that is open above, of a red, a green and a grey wall, under a soft sky.
JobSpec room(Method method, int bounces) {
  JobSpec job = test::box_job();
  job.sampling.method = method;
  job.sampling.num_candidates = 64;
  job.environment.keys[0].map = test::write_map("soft.exr", test::sky_map(32, 16, 3));
  job.scene.materials["red"] = {.kind = MaterialKind::diffuse, .base_color = {0.8f, 0.1f, 0.1f}};
  job.scene.materials["green"] = {.kind = MaterialKind::diffuse, .base_color = {0.1f, 0.7f, 0.2f}};
  const auto wall = [](const char* material, float x, float z, float width, float depth) {
    return ObjectSpec{.mesh = "box",
                      .material = material,
                      .translate = {x, 0, z},
                      .scale = {width, 2, depth},
                      .place_on_ground = true};
  };
  job.scene.objects.push_back(wall("red", -1.7f, 0, 0.2f, 4));
  job.scene.objects.push_back(wall("green", 1.7f, 0, 0.2f, 4));
  job.scene.objects.push_back(wall("ground", 0, -1.5f, 4, 0.2f));
  job.output.background = Background::transparent;
  job.light = {.bounces = bounces, .filter_glossy = false};
  job.output.aovs = {Aov::indirect};
  return job;
}

// H0: pixels and the image's mean are those of the path tracer; levels as for all methods
// (against_brute_force.h). Seeds 1 to 48 times `longer`.
void expect_same_as_paths(const JobSpec& job, double max_resolution, int longer = 1) {
  const Estimate truth = PathTracer(job).render(longer * 40000),
                 seen = test::repeat(job, longer * 48, indirect);
  const test::Verdict v = test::compare(seen, truth);
  EXPECT_LT(v.worst_pixel, test::kPixelLimit);
  EXPECT_LT(v.image, test::kImageLimit);
  EXPECT_LT(v.resolution, max_resolution);
  std::printf("  %+.3f %%, |z| %.2f, worst pixel |z| %.2f, resolves a bias of %.2f %%\n",
              100 * (seen.image_mean / truth.image_mean - 1), v.image, v.worst_pixel,
              100 * v.resolution);
}

/// The room with a lacquered floor and a wall that glows.
JobSpec lacquered_room(Method method) {
  JobSpec job = room(method, 2);
  job.scene.materials["ground"] = {.kind = MaterialKind::metallic_roughness,
                                   .base_color = {0.4f, 0.4f, 0.3f},
                                   .roughness = 0.6f,
                                   .clearcoat = 1.0f,
                                   .clearcoat_roughness = 0.5f};
  job.scene.materials["green"].emission = {0, 0.5f, 0.1f};
  return job;
}

TEST(Bounces, RoomAgreesWithPaths) {
  for (const int bounces : {1, 2, 5}) expect_same_as_paths(room(Method::pool, bounces), 0.035);
}
TEST(Bounces, CoatsAgreeWithPaths) { expect_same_as_paths(lacquered_room(Method::pool), 0.035); }
TEST(Bounces, RoomsAgreeWithPathsInTheLongRun) {
  expect_same_as_paths(room(Method::bidirectional, 2), 0.006, 16);
  expect_same_as_paths(lacquered_room(Method::bidirectional), 0.006, 16);
}

}  // namespace
}  // namespace baton
