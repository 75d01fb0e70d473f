#include "worker/pass/neighborhood.h"

#include <algorithm>
#include <cmath>

#include "common/base/poison.h"
#include "common/state/sample_planes.h"

namespace baton {
namespace {

/// How much farther or nearer a neighbour may be, as a share of the pixel's depth [Bitterli et al.
/// 2020, section 5].
constexpr float kDepthTolerance = 0.1f;

const SurfaceHit* first_surface(std::span<const SurfaceHit> hits) {
  const auto found =
      std::find_if(hits.begin(), hits.end(), [](const SurfaceHit& hit) { return hit.hit; });
  return found == hits.end() ? nullptr : &*found;
}

}  // namespace

Neighborhood::Neighborhood(const RenderContext& context, const FrameGeometry& now,
                           OldPixels& old_pixels)
    : context_(context),
      now_(now),
      old_pixels_(old_pixels),
      cos_normal_tolerance_(std::cos(context.job.motion.normal_tolerance_deg * kPi / 180)) {}

void Neighborhood::clear(std::size_t count) { places_.assign(count, {}); }

void Neighborhood::look_up(std::size_t i, std::span<const SurfaceHit> hits, const RngKey& key,
                           std::int32_t x, std::int32_t y) {
  if (first_surface(hits) == nullptr) return;
  const SamplingSpec& sampling = context_.job.sampling;
  const Rng rng(key, PassId::neighbor);
  for (std::int32_t k = 0; k < sampling.num_neighbors; ++k) {
    const std::array<float, 4> u = rng.uniforms(0, static_cast<std::uint32_t>(k));
    const float distance = static_cast<float>(sampling.neighbor_radius) * std::sqrt(u[0]);
    const auto dx = static_cast<std::int32_t>(std::lround(distance * std::cos(2 * kPi * u[1])));
    const auto dy = static_cast<std::int32_t>(std::lround(distance * std::sin(2 * kPi * u[1])));
    if (dx == 0 && dy == 0) continue;
    const auto place = old_pixels_.ask(x + dx, y + dy);
    if (place) places_[i][static_cast<std::size_t>(k)] = *place;
  }
}

/// Whether the first surface of now is like that of then.
bool Neighborhood::agrees(std::span<const SurfaceHit> now, std::span<const SurfaceHit> old) const {
  const SurfaceHit* const a = first_surface(now);
  const SurfaceHit* const b = first_surface(old);
  if (a == nullptr || b == nullptr || a->instance != b->instance) return false;
  const Vec3 normal = now_.normal_in(old_pixels_.geometry().pose, *a);
  return dot(b->point.ns, normal) >= cos_normal_tolerance_ &&
         std::fabs(b->depth - a->depth) <= kDepthTolerance * a->depth;
}

std::span<const CarriedSet> Neighborhood::sets(std::size_t i, std::span<const SurfaceHit> hits,
                                               CatcherAlbedo& catchers) {
  std::size_t count = 0;
  for (const OldPixels::Place& place : places_[i]) {
    if (place.state == nullptr) continue;
    const std::span<const SurfaceHit> old = old_pixels_.hits(place);
    const SampleState& state = *place.state;
    if (!agrees(hits, old) || confidence_plane(state)[place.index] == 0) continue;
    poison(surfaces_[count].sites);
    gather_sites(old_pixels_.geometry(), old, old_pixels_.shadings(place), surfaces_[count].sites,
                 catchers);
    const auto n = static_cast<std::size_t>(state.num_particles);
    const std::size_t first = place.index * n;
    const ConstSamplePlanes samples(state);
    sets_[count] = {.direction = samples.direction.subspan(first, n),
                    .site = samples.site.subspan(first, n),
                    .weight = samples.weight.subspan(first, n),
                    .lns = samples.lns[place.index],
                    .confidence = confidence_plane(state)[place.index],
                    .surfaces = &surfaces_[count]};
    ++count;
  }
  return std::span(sets_).first(count);
}

}  // namespace baton
