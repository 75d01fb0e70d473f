#include "worker/pass/fine_sites.h"

#include <algorithm>
#include <cmath>

#include "worker/pass/primary.h"
#include "worker/pass/site_rays.h"
#include "worker/sampling/pixel_filter.h"

namespace baton {
namespace {

constexpr std::size_t kProbes = limits::kGeometryProbes;

/// Contrast that the mean of a pixel's sites may leave; an edge gets the most. With half
/// and twice of it the efficiency on white metal is about a tenth lower and higher.
constexpr float kContrastLeft = 1.0f / 16;

/// A probe in each quarter of what the pixel's filter sees.
void append_probes(const JobSpec& job, const Camera& camera, const PixelPlace& pixel,
                   std::vector<Ray>& rays) {
  const Rng rng = site_random(job, pixel[0], pixel[1]);
  for (std::uint32_t i = 0; i < kProbes; ++i) {
    const std::array<float, 4> u = rng.uniforms(2, i);
    const auto at = filter_position(job.image.filter, {0.5f * (static_cast<float>(i % 2) + u[0]),
                                                       0.5f * (static_cast<float>(i / 2) + u[1])});
    const float x = static_cast<float>(pixel[0]) + at[0], y = static_cast<float>(pixel[1]) + at[1];
    rays.push_back(camera.has_lens() ? camera.ray(x, y, {u[2], u[3]}) : camera.ray(x, y));
  }
}

/// By how much the light that a surface reflects changes with its normal, per radian.
float sharpness(const Material& material) {
  switch (material.lobe) {
    case Material::Lobe::none:
      break;
    case Material::Lobe::phong:
      return std::max(1.0f, std::sqrt(0.5f * material.shape));
    case Material::Lobe::ggx:
    case Material::Lobe::measured: {
      const float alpha =
          material.coat.weight > 0 ? std::min(material.shape, material.coat.alpha) : material.shape;
      return 1 + material.specular_probability / alpha;
    }
  }
  return 1;
}

}  // namespace

float site_contrast(const FrameGeometry& geometry, std::span<const SurfaceHit> hits) {
  const SurfaceHit& first = hits.front();
  const auto is_like = [&](const SurfaceHit& hit) {
    return hit.hit == first.hit && hit.is_catcher == first.is_catcher &&
           (!hit.hit || (hit.instance == first.instance && hit.material == first.material));
  };
  if (!std::ranges::all_of(hits, is_like)) return 1;
  if (!first.hit) return 0;

  // Add up normals and albedos.
  const auto count = static_cast<float>(hits.size());
  Vec3 normal{};
  float albedo = 0, albedo_squares = 0, sharpest = 0;
  for (const SurfaceHit& hit : hits) {
    const SeenSurface seen = geometry.see(hit);
    normal = normal + seen.point.ns;
    const float reflected = mean(seen.material.kd) + mean(seen.material.ks);
    albedo += reflected;
    albedo_squares += reflected * reflected;
    sharpest = std::max(sharpest, sharpness(seen.material));
  }
  // The variance of unit vectors is 1 - |their mean|^2.
  const float spread = std::max(0.0f, 1 - dot(normal, normal) / (count * count));
  const float of_albedo =
      albedo > 0 ? std::max(0.0f, albedo_squares * count / (albedo * albedo) - 1) : 0;
  return std::min(1.0f, std::sqrt(spread * sharpest * sharpest + of_albedo));
}

std::vector<std::uint16_t> count_sites(const JobSpec& job, const FrameGeometry& geometry,
                                       std::span<const PixelPlace> pixels) {
  std::vector<Ray> rays;
  rays.reserve(pixels.size() * kProbes);
  for (const PixelPlace& pixel : pixels) append_probes(job, geometry.pose.camera, pixel, rays);
  std::vector<SurfaceHit> hits(rays.size());
  const std::vector<std::uint16_t> of_pixels(pixels.size(), kProbes);
  trace_primary_rays(geometry, rays, of_pixels, hits);

  std::vector<std::uint16_t> counts;
  counts.reserve(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const float contrast = site_contrast(geometry, std::span(hits).subspan(i * kProbes, kProbes));
    const float wanted = contrast * contrast / (kContrastLeft * kContrastLeft);
    std::int32_t sites = job.image.sites;
    while (static_cast<float>(sites) < wanted && sites < job.image.max_sites) sites *= 4;
    counts.push_back(static_cast<std::uint16_t>(sites));
  }
  return counts;
}

}  // namespace baton
