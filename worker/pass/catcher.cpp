#include "worker/pass/catcher.h"

#include <algorithm>
#include <cmath>

#include "common/job/sequence.h"
#include "worker/accel/accel.h"
#include "worker/method/populations.h"

namespace baton {

void see_catcher(const JobSpec& job, const FrameGeometry& geometry, std::span<const Ray> rays,
                 std::span<SurfaceHit> hits) {
  if (!has_catcher(job)) return;
  const GroundSpec& ground = *job.scene.ground;
  const std::vector<Instance>& instances = geometry.scene->instances;
  const float half = 0.5f * ground.size;
  const auto num_sites = static_cast<std::size_t>(job.image.sites);
  for (std::size_t first = 0; first < hits.size(); first += num_sites) {
    const std::span<SurfaceHit> pixel = hits.subspan(first, num_sites);
    const bool sees_object =
        std::ranges::any_of(pixel, [](const SurfaceHit& hit) { return hit.hit; });
    for (std::size_t s = 0; s < num_sites; ++s) {
      const Ray& ray = rays[first + s];
      if (pixel[s].hit || !(ray.direction.y < 0)) continue;  // it is seen from above
      const float t = (ground.height - ray.origin.y) / ray.direction.y;
      Vec3 position = ray.origin + ray.direction * t;
      position.y = ground.height;
      if (!(t > 0) || std::fabs(position.x) > half || std::fabs(position.z) > half) continue;
      constexpr Vec3 kUp{0, 1, 0};
      pixel[s] = {.point = {.position = position, .ng = kUp, .ns = kUp, .wo = -ray.direction},
                  .ray_origin = lift_off(position, kUp),
                  .depth = t,
                  .instance = static_cast<std::uint32_t>(instances.size() - 1),
                  .material = instances.back().material,
                  .hit = !sees_object,
                  .is_catcher = true};
    }
  }
}

bool belongs_to_object(const SampleState& state, std::size_t index) {
  const PixelSource source = latest_source(state, index);
  return source != PixelSource::background && source != PixelSource::catcher;
}

bool takes_up(bool sees_catcher, SampleState& state, std::size_t index) {
  const bool is_grounds = latest_source(state, index) == PixelSource::catcher;
  if (sees_catcher) return is_grounds;
  if (!is_grounds) return belongs_to_object(state, index);
  if (PixelMemory* const memory = state.memory_of(index)) *memory = {};
  return false;
}

Rgb CatcherEdge::sample(const PixelMethod& method, const PixelInput& input, const FrameLight& light,
                        const SampleState& like, SamplerScratch& scratch) {
  // The sites on the ground alone.
  hits_.assign(input.hits.begin(), input.hits.end());
  SiteOrigins origins{.num_sites = static_cast<std::int32_t>(hits_.size())};
  for (std::size_t s = 0; s < hits_.size(); ++s) {
    hits_[s].hit = hits_[s].is_catcher;
    if (hits_[s].hit) origins.set(s, hits_[s].ray_origin);
  }
  gather_sites(*input.geometry, hits_, {}, sites_, light.catcher);
  // Random numbers of pixels that no picture has.
  RngKey key = input.key;
  key.pixel ^= 0x80000000u;
  const AsideSampler::Aside ground{
      .sites = sites_, .hits = hits_, .origins = origins, .light = light, .key = key};
  return aside_.sample(method, input, ground, like, scratch);
}

}  // namespace baton
