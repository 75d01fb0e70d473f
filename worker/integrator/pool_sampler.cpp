#include "worker/integrator/pool_sampler.h"

#include <algorithm>
#include <cmath>

#include "worker/integrator/candidate_samplers.h"
#include "worker/sampling/ess.h"
#include "worker/sampling/pool.h"
#include "worker/sampling/systematic_choice.h"

namespace baton {
namespace {

using kernels::PoolHalf;

/// Whether there is something to choose from; a NaN or an overflow counts as dark.
bool is_lit(float total) { return total > 0 && std::isfinite(total); }

/// Chooses particles to carry with probability proportional to carry_weight; their contributions
/// stand for half the pixel. Returns the sum of the contributions.
float carry(const PoolHalf& half, float u, const PixelSamples& samples, std::size_t first,
            std::size_t count) {
  const float total = half.carry_total;
  const std::span<float> weight = samples.weight.subspan(first, count);
  if (!is_lit(total)) {
    std::fill(weight.begin(), weight.end(), 0.0f);
    std::fill_n(samples.direction.begin() + static_cast<std::ptrdiff_t>(first), count,
                OctDirection{0});
    std::fill_n(samples.site.begin() + static_cast<std::ptrdiff_t>(first), count, std::uint8_t{0});
    return 0;
  }
  std::array<std::int32_t, limits::kMaxParticles> storage{};
  const std::span<std::int32_t> chosen = std::span(storage).first(count);
  systematic_choice({half.carry_weight, static_cast<std::size_t>(half.count)}, u, chosen);
  const float per_choice = 0.5f * total / static_cast<float>(count);
  float sum = 0;
  for (std::size_t j = 0; j < count; ++j) {
    const auto pick = static_cast<std::size_t>(chosen[j]);
    samples.direction[first + j] = half.code[pick];
    samples.site[first + j] = static_cast<std::uint8_t>(half.site[pick]);
    weight[j] = per_choice * (half.weight[pick] / half.carry_weight[pick]);
    sum += weight[j];
  }
  return sum;
}

/// How the rays of one half are chosen and counted. Either way is unbiased; which one, the pool and
/// the memory say before any ray is chosen.
struct RayPlan {
  const float* weight;  ///< (count)
  float total;          ///< their sum
  bool control;         ///< V^ is the control variate
};
RayPlan plan_rays(const PoolHalf& half) {
  if (use_control(half.visible, half.ray_total)) return {half.ray_weight, half.ray_total, true};
  return {half.carry_weight, half.carry_total, false};
}

/// Chooses the rays of one half, worth half the pixel; a direction that is chosen twice is traced
/// once.
void choose_half(const PoolHalf& half, float lns, float u, std::size_t count, PixelRays& rays,
                 Rgb& constant) {
  if (!is_lit(half.lns)) return;
  const RayPlan plan = plan_rays(half);
  if (plan.control) {
    constant += half.visible_color * 0.5f;
    rays.constant.visibility += 0.5f * half.visible / lns;
  }
  if (!is_lit(plan.total)) return;
  std::array<std::int32_t, limits::kMaxParticles> storage{};
  const std::span<std::int32_t> chosen = std::span(storage).first(count);
  systematic_choice({plan.weight, static_cast<std::size_t>(half.count)}, u, chosen);
  const float per_choice = 0.5f * plan.total / static_cast<float>(count);
  for (std::size_t j = 0; j < count;) {
    const auto pick = static_cast<std::size_t>(chosen[j]);
    float times = 0;
    for (; j < count && chosen[j] == chosen[j - static_cast<std::size_t>(times)]; ++j) times += 1;
    const float scale = times * per_choice / plan.weight[pick];
    const Rgb color = Rgb{half.r[pick], half.g[pick], half.b[pick]} * scale;
    const float visibility = half.weight[pick] * scale / lns;
    if (plan.control) {
      constant += color * -half.free[pick];
      rays.constant.visibility -= visibility * half.free[pick];
    }
    rays.push({half.x[pick], half.y[pick], half.z[pick]},
              static_cast<std::uint8_t>(half.site[pick]), {color, visibility});
  }
}

/// Factor on the gain, [0, 1]: how far the lobes of a pixel are still where they were, as seen from
/// the environment, with which the particles turn. Depends on surfaces alone.
float lobe_kinship(const PixelInput& input) {
  const SiteBlock& now = input.sites;
  const SiteBlock& before = input.old != nullptr ? input.old->sites : now;
  const Mat3 to_map_now = input.light.now.rotation.transposed();
  const Mat3 to_map_before = input.light.before.rotation.transposed();
  float lost = 0;
  for (std::int32_t k = 0; k < now.num_lobes; ++k) {
    const auto s = static_cast<std::size_t>(now.lobe_sites[static_cast<std::size_t>(k)]);
    const Vec3 shift =
        to_map_now * Vec3{now.mirror_x[s], now.mirror_y[s], now.mirror_z[s]} -
        to_map_before * Vec3{before.mirror_x[s], before.mirror_y[s], before.mirror_z[s]};
    const float shape = now.shape[s];
    const float variance = now.is_ggx[s] > 0 ? 4 * shape * shape : 1 / std::max(shape, 1.0f);
    lost += now.specular_probability[s] * (1 - std::exp(-4 * dot(shift, shift) / variance));
  }
  return 1 - lost / static_cast<float>(now.num_hits);
}

}  // namespace

PoolSampler::PoolSampler(const SamplingSpec& spec)
    : settings_{.num_carried = spec.num_carried, .gain = spec.pool_gain},
      half_candidates_(std::max(spec.num_candidates / 2, 1)),
      lobe_fraction_(spec.brdf_fraction),
      num_rays_(static_cast<std::size_t>(spec.num_particles)),
      remembers_(spec.visibility_memory) {}

PixelDiagnostics PoolSampler::sample(const PixelInput& input, SamplerScratch& scratch,
                                     const PixelSamples& samples) const {
  // Gather the pool.
  const std::size_t n = samples.weight.size();
  std::array<float, limits::kMaxParticles> contribution{};
  for (std::size_t j = 0; j < n; ++j) contribution[j] = samples.lns * samples.weight[j];
  const kernels::PoolInput pool{
      .sites = input.sites,
      .old = input.old,
      .now = input.light.now,
      .before = input.light.before,
      .light_pool = input.light.pool,
      .counts = candidate_counts(input.sites, half_candidates_, lobe_fraction_),
      .has_history = input.has_history,
      .code = samples.direction,
      .site = samples.site,
      .contribution = std::span(contribution).first(n),
      .memory = input.memory};
  PoolSettings settings = settings_;
  settings.gain *= input.light.gain * lobe_kinship(input);
  kernels::gather_pool(pool, settings, Rng(input.key, PassId::candidates), scratch.pool);

  // Choose what is carried, each half from its own.
  const auto u = Rng(input.key, PassId::choose).uniforms(0, 0);
  float lns = carry(scratch.pool[0], u[0], samples, 0, n / 2);
  lns += carry(scratch.pool[1], u[1], samples, n / 2, n / 2);
  for (float& weight : samples.weight) weight = lns > 0 ? weight / lns : 0.0f;
  samples.lns = samples.lns_fresh = lns;
  samples.source = input.has_history ? PixelSource::carried : PixelSource::fresh;
  const std::int32_t carried = input.has_history ? settings_.num_carried : 0;
  return {.ess = effective_sample_size(samples.weight),
          .target_evaluations = 2 * half_candidates_ + carried};
}

void PoolSampler::choose_rays(const PixelInput& input, SamplerScratch& scratch,
                              PixelRays& rays) const {
  rays.clear();
  const auto u = Rng(input.key, PassId::choose).uniforms(0, 0);
  const float lns = 0.5f * (scratch.pool[0].lns + scratch.pool[1].lns);
  Rgb first, second;
  choose_half(scratch.pool[0], lns, u[2], num_rays_ / 2, rays, first);
  rays.second_half = rays.count;
  choose_half(scratch.pool[1], lns, u[3], num_rays_ / 2, rays, second);
  rays.constant.color = first + second;
  rays.difference = first - second;
  rays.lns = 0.5f * (scratch.pool[0].lns_fresh + scratch.pool[1].lns_fresh);
}

}  // namespace baton
