#include "worker/method/reference/reference.h"

#include <algorithm>
#include <vector>

#include "common/state/sample_planes.h"

namespace baton {
namespace {

/// Pairs traced together.
constexpr std::int32_t kBatch = 64;

/// One half of a pair: what it adds if its ray is free.
struct Contribution {
  Rgb value;
  std::int32_t pair = 0;
  bool is_hidden = false;
};

/// Colours in double.
struct ColorSum {
  std::array<double, 3> value{};

  void add(const Rgb& color) {
    value[0] += color.x;
    value[1] += color.y;
    value[2] += color.z;
  }
  void add_squares(const ColorSum& of) {
    for (std::size_t c = 0; c < 3; ++c) value[c] += of.value[c] * of.value[c];
  }
  Rgb over(double n) const {
    return {static_cast<float>(value[0] / n), static_cast<float>(value[1] / n),
            static_cast<float>(value[2] / n)};
  }
};

/// f cos L / (q_environment + q_bsdf): the balance heuristic with one sample of each kind. What
/// hidden_light.h leaves out is traced, too: a reference tells whether it was hidden.
Contribution weighted_radiance(const SeenSurface& site, const Environment& environment,
                               const Vec3& wi) {
  const float coat = evaluate_coat(site.material, site.point, wi);
  if (!(coat > 0) && !above_horizon(site.point, wi)) return {};
  const EnvironmentMap::Texel light = environment.evaluate(wi);
  const float density = light.density + bsdf_pdf_solid_angle(site.material, site.point, wi);
  if (!(density > 0)) return {};
  const Rgb radiance{light.r, light.g, light.b};
  Rgb value =
      evaluate_bsdf(site.material, site.point, wi) * radiance * (dot(site.point.ns, wi) / density);
  if (coat > 0) value += radiance * (coat / density);
  return {.value = value, .is_hidden = light.is_hidden()};
}

/// What site s sees. A catcher has the albedo with which `sites` know it.
SeenSurface see(const FrameGeometry& geometry, const SiteBlock& sites, const SurfaceHit& hit,
                std::size_t s) {
  if (!hit.hit) return {};
  if (!hit.is_catcher) return geometry.see(hit);
  return as_catcher(hit.point, {sites.kd_r[s], sites.kd_g[s], sites.kd_b[s]});
}

}  // namespace

ReferenceEstimate ReferenceRenderer::render(std::span<const SurfaceHit> hits,
                                            const SiteBlock& sites, const Environment& environment,
                                            std::int32_t num_samples, const RngKey& key,
                                            ShadowRays& rays, std::uint64_t& rays_traced) const {
  const Rng rng(key, PassId::reference);
  ColorSum sum, squares, unshadowed;
  double sum_lns = 0, sum_mean = 0;
  if (environment.map->black()) return {};
  std::vector<SeenSurface> seen;
  for (std::size_t s = 0; s < hits.size(); ++s) seen.push_back(see(geometry_, sites, hits[s], s));
  std::vector<Contribution> contributions;
  for (std::int32_t first = 0; first < num_samples; first += kBatch) {
    const std::int32_t count = std::min(kBatch, num_samples - first);

    // Draw the pairs of this batch.
    rays.clear();
    contributions.clear();
    for (std::int32_t pair = 0; pair < count; ++pair) {
      const auto step = static_cast<std::uint32_t>(first + pair);
      const auto u = rng.uniforms(step, 0);
      const auto v = rng.uniforms(step, 1);
      const auto s = static_cast<std::size_t>(u[0] * static_cast<float>(hits.size()));
      if (!hits[s].hit) continue;
      const SeenSurface& site = seen[s];
      const Vec3 origin = hits[s].ray_origin;
      for (const Vec3& wi : {environment.sample({u[1], u[2]}),
                             sample_bsdf(site.material, site.point, {v[0], v[1], v[2]})}) {
        Contribution found = weighted_radiance(site, environment, wi);
        if (!(mean(found.value) > 0)) continue;
        found.pair = pair;
        rays.push(origin, wi);
        contributions.push_back(found);
      }
    }
    geometry_.accel->occluded(rays);
    rays_traced += rays.size();

    // Add them up, pair by pair.
    std::array<ColorSum, kBatch> of_pair{};
    std::array<double, kBatch> mean_of_pair{};
    for (std::size_t i = 0; i < contributions.size(); ++i) {
      const Contribution& c = contributions[i];
      if (!c.is_hidden) {
        unshadowed.add(c.value);
        sum_lns += mean(c.value);
      }
      if (rays.t_far[i] < 0) continue;
      sum.add(c.value);
      of_pair[static_cast<std::size_t>(c.pair)].add(c.value);
      mean_of_pair[static_cast<std::size_t>(c.pair)] += mean(c.value);
    }
    for (const ColorSum& pair : of_pair) squares.add_squares(pair);
    for (const double m : mean_of_pair) sum_mean += m;
  }

  const double n = num_samples;
  ColorSum variance;
  for (std::size_t c = 0; c < 3; ++c) {
    const double mean = sum.value[c] / n;
    variance.value[c] = std::max(squares.value[c] / n - mean * mean, 0.0) / std::max(n - 1, 1.0);
  }
  return {.radiance = sum.over(n),
          .unshadowed = unshadowed.over(n),
          .lns = static_cast<float>(sum_lns / n),
          .visibility = sum_lns > 0 ? static_cast<float>(sum_mean / sum_lns) : 0.0f,
          .variance = variance.over(1)};
}

namespace {

class ReferenceSampler final : public TileSampler {
 public:
  explicit ReferenceSampler(std::int32_t num_samples) : num_samples_(num_samples) {}

  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel,
                          RayWriter& rays) override {
    PixelDiagnostics did{.target_evaluations = 2 * num_samples_};
    ShadowRays own;
    const ReferenceEstimate estimate = ReferenceRenderer(*input.geometry)
                                           .render(input.hits, input.sites, input.light.frame.now,
                                                   num_samples_, input.key, own, did.rays_traced);
    rays.known = {.color = estimate.radiance,
                  .visibility = estimate.visibility,
                  .variance = estimate.variance,
                  .unshadowed = estimate.unshadowed,
                  .blocked = estimate.visibility < 1};
    did.lns = estimate.lns;
    pixel.tile.set_source(pixel.index, PixelSource::fresh);
    return did;
  }

 private:
  std::int32_t num_samples_;
};

}  // namespace

PixelMethod make_reference_method(const JobSpec& job) {
  return {.format = &sample_format(), .start = [count = job.sampling.reference_samples] {
            return std::make_unique<ReferenceSampler>(count);
          }};
}

}  // namespace baton
