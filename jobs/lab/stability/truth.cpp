#include "jobs/lab/stability/truth.h"

#include <cmath>
#include <numbers>

#include "common/base/check.h"
#include "jobs/lab/stability/parallel.h"
#include "worker/pass/primary.h"
#include "worker/pass/render_context.h"

namespace baton::stability {
namespace {

/// Light that arrives along one direction: radiance times solid angle; is_hidden: no part of Lns.
struct Node {
  Vec3 wi;
  Rgb power;
  bool is_hidden = false;
};

/// The midpoints of nodes x nodes cells in each texel that are not black, in world space.
std::vector<Node> light_nodes(const Environment& environment, int nodes) {
  const int columns = environment.map->width() * nodes;
  const int rows = environment.map->height() * nodes;
  std::vector<Node> list;
  for (int j = 0; j < rows; ++j) {
    const double polar = (j + 0.5) / rows * std::numbers::pi;
    const double solid_angle =
        4 * std::numbers::pi / columns * std::sin(polar) * std::sin(0.5 * std::numbers::pi / rows);
    for (int i = 0; i < columns; ++i) {
      const double longitude = (0.5 - (i + 0.5) / columns) * 2 * std::numbers::pi;
      const Vec3 direction{static_cast<float>(std::sin(polar) * std::sin(longitude)),
                           static_cast<float>(std::cos(polar)),
                           static_cast<float>(std::sin(polar) * std::cos(longitude))};
      const EnvironmentMap::Texel light = environment.map->evaluate(direction);
      const Rgb power = Rgb{light.r, light.g, light.b} * static_cast<float>(solid_angle);
      if (mean(power) > 0)
        list.push_back({environment.rotation * direction, power, light.is_hidden()});
    }
  }
  return list;
}

/// Adds up one pixel. rays and weights: scratch.
void sum_pixel(const FrameGeometry& geometry, const SurfaceHit& hit, const std::vector<Node>& nodes,
               ShadowRays& rays, std::vector<double>& weights, double& lns, double& radiance) {
  if (!hit.hit) return;
  rays.clear();
  weights.clear();
  const SeenSurface seen = geometry.see(hit);
  const Vec3 origin = hit.ray_origin;
  for (const Node& node : nodes) {
    const double value = mean(evaluate_bsdf(seen.material, seen.point, node.wi) * node.power) *
                             dot(seen.point.ns, node.wi) +
                         mean(node.power) * evaluate_coat(seen.material, seen.point, node.wi);
    if (!(value > 0)) continue;
    if (!node.is_hidden) lns += value;
    rays.push(origin, node.wi);
    weights.push_back(value);
  }
  geometry.accel->occluded(rays);
  for (std::size_t r = 0; r < weights.size(); ++r) {
    if (!(rays.t_far[r] < 0)) radiance += weights[r];
  }
}

FrameTruth sum_frame(const RenderContext& context, const FrameGeometry& geometry,
                     const Environment& environment, int nodes) {
  const TileSurfaces surfaces = trace_primary(
      context.job, geometry, {0, 0, context.job.image.width, context.job.image.height});
  const std::vector<Node> light = light_nodes(environment, nodes);
  FrameTruth truth{std::vector<double>(surfaces.hits.size()),
                   std::vector<double>(surfaces.hits.size())};
  ShadowRays rays;
  std::vector<double> weights;
  for (std::size_t p = 0; p < surfaces.hits.size(); ++p) {
    sum_pixel(geometry, surfaces.hits[p], light, rays, weights, truth.lns[p], truth.radiance[p]);
  }
  return truth;
}

/// Root mean square difference over the mean of b; 0 when b is black.
double relative_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0;
  double sum = 0;
  for (std::size_t p = 0; p < a.size(); ++p) {
    squares += (a[p] - b[p]) * (a[p] - b[p]);
    sum += b[p];
  }
  const auto n = static_cast<double>(a.size());
  return sum > 0 ? std::sqrt(squares / n) / (sum / n) : 0.0;
}

}  // namespace

Result<Truth> exact_truth(const JobSpec& job, int nodes, int threads) {
  BATON_CHECK(nodes > 0 && nodes % 2 == 0 && job.image.sites == 1);
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 2}));

  // Lights and geometry one after the other, the sums side by side.
  std::vector<Environment> lights;
  std::vector<std::shared_ptr<const FrameGeometry>> geometry;
  for (std::size_t f = 0; f < job.frames.size(); ++f) {
    BATON_ASSIGN(const auto light, context->lights->at(Step(static_cast<std::int32_t>(f))));
    lights.push_back(light->now);
    BATON_ASSIGN(auto placed, context->geometry->at(Step(static_cast<std::int32_t>(f))));
    geometry.push_back(std::move(placed));
  }
  Truth truth;
  truth.frames.resize(lights.size());
  parallel_for(lights.size(), threads, [&](std::size_t f) {
    truth.frames[f] = sum_frame(*context, *geometry[f], lights[f], nodes);
  });

  // How much is left to the number of nodes.
  for (std::size_t f = 0; f < lights.size() && truth.quadrature_error == 0; ++f) {
    if (lights[f].map->black()) continue;
    truth.quadrature_error = relative_difference(
        sum_frame(*context, *geometry[f], lights[f], nodes / 2).radiance, truth.frames[f].radiance);
  }
  return truth;
}

}  // namespace baton::stability
