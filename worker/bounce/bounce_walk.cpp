#include "worker/bounce/bounce_walk.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/poison.h"
#include "common/math/low_discrepancy.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

/// Surfaces that are worked on together: lanes for the kernels, and their targets stay in the
/// cache.
constexpr std::size_t kBlock = 64;
/// Candidates of a surface from the presampled light: a block of it, an eighth of the light each.
constexpr std::size_t kFromLight = PresampledLight::kBlock;
/// Width of the cone that textures are averaged over, as a share of the distance between two paths
/// of a pixel: neighbours overlap by little, and what is blurred stays below what their noise
/// hides.
constexpr float kConeShare = 0.125f;
/// Paths that carry more than this share of their first piece's light never end early.
constexpr float kSurelyKept = 0.5f;

/// Random numbers of a path at a surface.
enum Draw : std::uint32_t { kChoose, kLobe };

/// Steps of PassId::bounce before those of surfaces.
enum FirstStep : std::uint32_t { kScramble, kScrambleAside, kShift };
/// The step of a path's surface. bounce: from 1.
std::uint32_t step_at(std::int32_t bounce, std::uint32_t path) {
  return static_cast<std::uint32_t>(bounce) * BounceWalk::kPaths + path;
}

template <std::size_t kSize>
struct Directions {
  std::array<float, kSize> x, y, z;

  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
};
template <std::size_t kSize>
struct Colors {
  std::array<float, kSize> r, g, b;

  Rgb operator[](std::size_t i) const { return {r[i], g[i], b[i]}; }
};
/// (surface, direction) pairs, and what surfaces make of light from there.
template <std::size_t kSize>
struct Pairs {
  std::array<std::int32_t, kSize> site;
  Directions<kSize> direction;
  Colors<kSize> reflected;  ///< BRDF times cosine
  std::array<float, kSize> density;
  std::array<float, kSize> u0, u1;  ///< that directions are drawn with
  std::size_t count;

  Pairs() {
    poison(*this);
    count = 0;
  }
  void add(std::size_t at, float u, float v) {
    site[count] = static_cast<std::int32_t>(at);
    u0[count] = u;
    u1[count++] = v;
  }
  template <class T>
  std::span<T> used(std::array<T, kSize>& column) {
    return std::span(column).first(count);
  }
  /// Directions of the BRDFs, by u0 and u1.
  void draw(const SiteBlock& sites) {
    kernels::sample_bsdf(sites, used(site), used(u0), used(u1), used(direction.x),
                         used(direction.y), used(direction.z));
  }
  void evaluate(const SiteBlock& sites) {
    kernels::evaluate_bsdf(sites, used(site), used(direction.x), used(direction.y),
                           used(direction.z), used(reflected.r), used(reflected.g),
                           used(reflected.b), used(density));
  }
};

/// Least alpha of what is seen through scattering of such a density at least: what Cycles' filter
/// of glossy surfaces makes of it at its default, 1.
float least_alpha(float least_pdf) { return least_pdf < 1 ? 0.5f * std::sqrt(1 - least_pdf) : 0; }

/// The material, with lobes no sharper than alpha.
void roughen(Material& material, float alpha) {
  if (material.lobe == Material::Lobe::ggx) material.shape = std::max(material.shape, alpha);
  if (material.lobe == Material::Lobe::phong && alpha > 0)
    material.shape = std::min(material.shape, 2 / (alpha * alpha) - 2);
  if (material.coat.weight > 0) material.coat.alpha = std::max(material.coat.alpha, alpha);
}

/// One candidate of a surface: where light comes from, and how much over the density of all ways to
/// draw it.
struct Candidate {
  Vec3 direction;
  Rgb value;
  float weight = 0;  ///< mean of the value
};
Candidate candidate(const Vec3& direction, const Rgb& reflected, const Rgb& radiance,
                    float light_density, float own_density) {
  const float density = static_cast<float>(kFromLight) * std::abs(light_density) + own_density;
  if (!(density > 0)) return {};
  const Rgb value = reflected * radiance / density;
  return {direction, value, mean(value)};
}

}  // namespace

/// The surfaces that some paths have met.
struct BounceWalk::Surfaces {
  SiteBlock sites;
  std::array<std::size_t, kBlock> path;  ///< indices of paths and hits
  std::size_t count = 0;
};

Rng BounceWalk::random_of(const Path& path) const {
  return {starts_[path.start].key, PassId::bounce};
}

namespace {

/// Owen-scrambled points of a sequence that belongs to a pixel or block and frame: its rounds
/// follow each other in it.
class Points {
 public:
  Points(RngKey key, bool is_aside, std::uint32_t number = 0) {
    key.round = 0;
    scramble_ = Rng(key, PassId::bounce).bits(is_aside ? kScrambleAside : kScramble, number);
  }
  std::array<float, 2> operator[](std::uint32_t index) const {
    const auto point = sobol_2d(index);
    return {uniform_float(owen_scramble(point[0], scramble_[0])),
            uniform_float(owen_scramble(point[1], scramble_[1]))};
  }

 private:
  Philox4x32::Counter scramble_;
};

/// The sites of a pixel that its paths start from, in turn.
class Turns {
 public:
  Turns(const BounceStart& start, std::uint32_t paths)
      : shift_(uniform_float(Rng(start.key, PassId::bounce).bits(kShift, 0)[0])),
        scale_(static_cast<float>(start.hits.size()) / static_cast<float>(paths)),
        last_(start.hits.size() - 1) {}
  std::size_t operator[](std::uint32_t path) const {
    return std::min(static_cast<std::size_t>((static_cast<float>(path) + shift_) * scale_), last_);
  }

 private:
  float shift_, scale_;
  std::size_t last_;
};

bool sees_surface(const SurfaceHit& hit) { return hit.hit && !hit.is_catcher; }

/// Whether a surface looks the same from everywhere above it.
bool is_matt(const Material& material) {
  const bool bends = material.detail != nullptr && material.detail->has(DetailImage::normal);
  return material.lobe == Material::Lobe::none && !(material.coat.weight > 0) && !bends;
}

}  // namespace

void BounceWalk::push_path(std::uint32_t pixel, const SurfaceHit& hit, const Vec3& direction,
                           float pdf, std::uint32_t number, const Rgb& weight, bool is_member) {
  paths_.push_back({.ray = {hit.ray_origin, direction},
                    .throughput = {1, 1, 1},
                    .width = hit.place.width,
                    .spread = kConeShare / std::sqrt(pdf),
                    .least_pdf = pdf,
                    .first = static_cast<std::uint32_t>(firsts_.size()),
                    .number = number,
                    .start = static_cast<std::uint32_t>(starts_.size() - 1)});
  firsts_.push_back({.pixel = pixel, .weight = weight, .is_member = is_member});
}

void BounceWalk::add(std::uint32_t pixel, const BounceStart& start) {
  starts_.push_back({&start.presampled, start.key});
  const SiteBlock& sites = start.sites;
  const bool is_glossy = sites.any_phong || sites.any_ggx || sites.any_measured || sites.any_coat;
  is_glossy ? add_alone(pixel, start) : add_member(pixel, start);
}

void BounceWalk::add_alone(std::uint32_t pixel, const BounceStart& start) {
  const Points points(start.key, start.is_aside);
  const Turns turns(start, kPaths);
  Pairs<kPaths> first;
  std::array<std::uint32_t, kPaths> number;
  for (std::uint32_t k = 0; k < kPaths; ++k) {
    const std::size_t site = turns[k];
    if (!sees_surface(start.hits[site])) continue;
    const auto u = points[start.key.round * kPaths + k];
    number[first.count] = k;
    first.add(site, u[0], u[1]);
  }
  first.draw(start.sites);
  first.evaluate(start.sites);
  for (std::size_t i = 0; i < first.count; ++i) {
    const float pdf = first.density[i];
    const Rgb reflected = first.reflected[i];
    if (!(pdf > 0) || !(mean(reflected) > 0)) continue;
    push_path(pixel, start.hits[static_cast<std::size_t>(first.site[i])], first.direction[i], pdf,
              number[i], reflected / (pdf * static_cast<float>(kPaths)), false);
  }
}

BounceGroup BounceGroup::of(std::uint64_t job_seed, std::int32_t frame, std::int32_t image_width,
                            std::int32_t x, std::int32_t y, std::int32_t round) {
  constexpr std::int32_t kLast = limits::kBounceBlock - 1;
  const RngKey block = pixel_key(job_seed, frame, image_width, x & ~kLast, y & ~kLast, round);
  const Philox4x32::Counter shift = Rng(block, PassId::bounce).bits(kShift, 0);
  const auto square = [](std::int32_t at, std::uint32_t by) {
    return ((static_cast<std::uint32_t>(at) + by) & kLast) / kSide;
  };
  return {.block = block,
          .number = 2 * square(y, shift[1]) + square(x, shift[0]),
          .member = static_cast<std::uint32_t>((y & (kSide - 1)) * kSide + (x & (kSide - 1)))};
}

std::vector<BounceWalk::Member>& BounceWalk::exchange_of(const BounceStart& start,
                                                         std::uint32_t path) {
  const auto used = std::span(exchanges_).first(num_exchanges_);
  const auto found = std::ranges::find_if(used, [&](const Exchange& exchange) {
    return exchange.path == path && exchange.is_aside == start.is_aside &&
           exchange.group.is_same(start.group);
  });
  if (found != used.end()) return found->members;
  if (num_exchanges_ == exchanges_.size()) exchanges_.emplace_back();
  Exchange& next = exchanges_[num_exchanges_++];
  next.group = start.group;
  next.path = path;
  next.is_aside = start.is_aside;
  next.members.clear();
  return next.members;
}

void BounceWalk::add_member(std::uint32_t pixel, const BounceStart& start) {
  constexpr std::uint32_t kMembers = BounceGroup::kMembers;
  const BounceGroup& group = start.group;
  const Points points(group.block, start.is_aside, group.number);
  const Turns turns(start, kSharedPaths);
  const SiteBlock& sites = start.sites;
  Pairs<kSharedPaths> first;
  std::array<std::uint32_t, kSharedPaths> number;
  for (std::uint32_t k = 0; k < kSharedPaths; ++k) {
    const std::size_t site = turns[k];
    // What reflects nothing draws nothing that others could take.
    if (!sees_surface(start.hits[site]) ||
        !(sites.kd_r[site] + sites.kd_g[site] + sites.kd_b[site] > 0))
      continue;
    // A pixel has another point of its group's each time, and so has each of its sites.
    const std::uint32_t turn = start.key.round * kSharedPaths + k;
    const std::uint32_t member = (group.member + turn + start.key.round) % kMembers;
    const auto u = points[turn * kMembers + member];
    number[first.count] = k;
    first.add(site, u[0], u[1]);
  }
  first.draw(sites);
  first.evaluate(sites);
  for (std::size_t i = 0; i < first.count; ++i) {
    const auto site = static_cast<std::size_t>(first.site[i]);
    const SurfaceHit& hit = start.hits[site];
    Member member{.origin = hit.ray_origin,
                  .ns = {sites.ns_x[site], sites.ns_y[site], sites.ns_z[site]},
                  .ng = {sites.ng_x[site], sites.ng_y[site], sites.ng_z[site]},
                  .weight = Rgb{sites.kd_r[site], sites.kd_g[site], sites.kd_b[site]} /
                            static_cast<float>(kSharedPaths),
                  .pixel = pixel,
                  .first = -1};
    const float pdf = first.density[i];
    const Rgb reflected = first.reflected[i];
    if (pdf > 0 && mean(reflected) > 0) {
      member.first = static_cast<std::int32_t>(firsts_.size());
      push_path(pixel, hit, first.direction[i], pdf, number[i],
                reflected / (pdf * static_cast<float>(kSharedPaths)), true);
    }
    exchange_of(start, number[i]).push_back(member);
  }
}

void BounceWalk::follow(const EnvironmentView& light, std::span<Rgb> found) {
  for (std::int32_t bounce = 1; bounce <= spec_.bounces && !paths_.empty(); ++bounce) {
    rays_.clear();
    for (const Path& path : paths_) rays_.push_back(path.ray);
    hits_.resize(rays_.size());
    geometry_.accel->intersect(rays_, hits_);
    num_rays_ += rays_.size();

    next_.clear();
    shadows_.clear();
    values_.clear();
    firsts_lit_.clear();
    std::array<std::size_t, kBlock> met;
    std::size_t count = 0;
    for (std::size_t i = 0; i < hits_.size(); ++i) {
      if (hits_[i].hit) met[count++] = i;
      if (count == kBlock || (count > 0 && i + 1 == hits_.size())) {
        shade(std::span(met).first(count), bounce, light);
        count = 0;
      }
    }
    geometry_.accel->occluded(shadows_);
    num_rays_ += shadows_.size();
    for (std::size_t i = 0; i < shadows_.size(); ++i) {
      if (!(shadows_.t_far[i] < 0)) firsts_[firsts_lit_[i]].radiance += values_[i];
    }
    std::swap(paths_, next_);
  }

  // Hand out.
  for (const First& first : firsts_) {
    if (!first.is_shared) found[first.pixel] += first.weight * first.radiance;
  }
  for (std::size_t i = 0; i < num_exchanges_; ++i) share(exchanges_[i].members, found);
  num_exchanges_ = 0;
  paths_.clear();
  firsts_.clear();
  starts_.clear();
}

/// Hands the light of surfaces that members have met to all that see them.
void BounceWalk::share(std::span<const Member> members, std::span<Rgb> found) {
  shadows_.clear();
  densities_.clear();
  const auto is_met = [&](const Member& member) {
    if (member.first < 0) return false;
    const First& first = firsts_[static_cast<std::size_t>(member.first)];
    return first.is_shared && mean(first.radiance) > 0;
  };
  for (const Member& met : members) {
    if (!is_met(met)) continue;
    const First& first = firsts_[static_cast<std::size_t>(met.first)];
    for (const Member& member : members) {
      const Vec3 way = first.origin - member.origin;
      const float above = std::min(dot(way, member.ns), dot(way, member.ng));
      const float facing = -dot(way, first.ng), d2 = dot(way, way);
      const bool sees = (above > 0 && facing > 0) || &member == &met;
      // cos cos / d^2 of directions that are not of length 1; the factor 1 / pi is everyone's.
      densities_.push_back(sees ? std::abs(dot(way, member.ns) * facing) / (d2 * d2) : 0);
      if (!sees || &member == &met) continue;
      shadows_.push(member.origin, way);
      shadows_.t_far[shadows_.size() - 1] = 1;
    }
  }
  geometry_.accel->occluded(shadows_);
  num_rays_ += shadows_.size();

  std::size_t ray = 0, first_density = 0;
  for (const Member& met : members) {
    if (!is_met(met)) continue;
    const auto density = std::span(densities_).subspan(first_density, members.size());
    first_density += members.size();
    float sum = 0;
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (&members[i] != &met && density[i] > 0 && shadows_.t_far[ray++] < 0) density[i] = 0;
      sum += density[i];
    }
    if (!(sum > 0) || !std::isfinite(sum)) continue;
    const Rgb radiance = firsts_[static_cast<std::size_t>(met.first)].radiance;
    for (std::size_t i = 0; i < members.size(); ++i)
      found[members[i].pixel] += members[i].weight * radiance * (density[i] / sum);
  }
}

/// What paths find at the surfaces that they have met. met: indices of paths.
void BounceWalk::shade(std::span<const std::size_t> met, std::int32_t bounce,
                       const EnvironmentView& light) {
  Surfaces at;
  poison(at.sites);
  at.count = met.size();
  std::ranges::copy(met, at.path.begin());
  at.sites.clear(static_cast<int>(at.count));
  for (std::size_t i = 0; i < at.count; ++i) {
    Path& path = paths_[at.path[i]];
    SurfaceHit& hit = hits_[at.path[i]];
    path.width += hit.depth * path.spread;
    hit.place.width = path.width;
    SeenSurface seen = geometry_.see(hit);
    if (spec_.filter_glossy) roughen(seen.material, least_alpha(path.least_pdf));
    at.sites.add(static_cast<int>(i), seen.point, seen.material);
    First& first = firsts_[path.first];
    first.radiance += path.throughput * seen.emission;
    if (bounce > 1 || !first.is_member || !is_matt(seen.material)) continue;
    first.origin = hit.ray_origin;
    first.ng = seen.point.ng;
    first.is_shared = true;
  }
  light_up(at, bounce, light);
  if (bounce < spec_.bounces) go_on(at, bounce);
}

/// Shadow rays to some of the light.
void BounceWalk::light_up(const Surfaces& at, std::int32_t bounce, const EnvironmentView& light) {
  if (starts_[paths_[at.path[0]].start].presampled->empty()) return;  // a black map
  Pairs<kBlock * kFromLight> from_light;
  Colors<kBlock * kFromLight> radiance;
  std::array<float, kBlock * kFromLight> density;
  Pairs<kBlock> own;
  std::array<float, kBlock> choice;

  // Draw.
  for (std::size_t i = 0; i < at.count; ++i) {
    const Path& path = paths_[at.path[i]];
    const Rng rng = random_of(path);
    const std::uint32_t step = step_at(bounce, path.number);
    const Philox4x32::Counter bits = rng.bits(step, kChoose);
    choice[i] = uniform_float(bits[1]);
    const PresampledLight::Block& block =
        starts_[path.start].presampled->blocks[bits[0] % PresampledLight::kNumBlocks];
    for (std::size_t c = 0; c < kFromLight; ++c) {
      const std::size_t n = from_light.count++;
      from_light.site[n] = static_cast<std::int32_t>(i);
      from_light.direction.x[n] = block.x[c];
      from_light.direction.y[n] = block.y[c];
      from_light.direction.z[n] = block.z[c];
      radiance.r[n] = block.r[c];
      radiance.g[n] = block.g[c];
      radiance.b[n] = block.b[c];
      density[n] = block.density[c];
    }
    if (at.sites.specular_probability[i] > 0)
      own.add(i, uniform_float(bits[2]), uniform_float(bits[3]));
  }

  // Evaluate.
  from_light.evaluate(at.sites);
  Colors<kBlock> own_radiance;
  std::array<float, kBlock> own_density;
  if (own.count > 0) {
    own.draw(at.sites);
    own.evaluate(at.sites);
    kernels::evaluate_environment(light, own.used(own.direction.x), own.used(own.direction.y),
                                  own.used(own.direction.z), own.used(own_radiance.r),
                                  own.used(own_radiance.g), own.used(own_radiance.b),
                                  own.used(own_density));
  }

  // Choose.
  std::size_t next_own = 0;
  for (std::size_t i = 0; i < at.count; ++i) {
    const bool is_glossy = at.sites.specular_probability[i] > 0;
    std::array<Candidate, kFromLight + 1> candidates;
    float total = 0;
    for (std::size_t c = 0; c < kFromLight; ++c) {
      const std::size_t n = i * kFromLight + c;
      candidates[c] = candidate(from_light.direction[n], from_light.reflected[n], radiance[n],
                                density[n], is_glossy ? from_light.density[n] : 0);
      total += candidates[c].weight;
    }
    if (is_glossy) {
      const std::size_t n = next_own++;
      candidates[kFromLight] = candidate(own.direction[n], own.reflected[n], own_radiance[n],
                                         own_density[n], own.density[n]);
      total += candidates[kFromLight].weight;
    }
    if (!(total > 0) || !std::isfinite(total)) continue;
    const Path& path = paths_[at.path[i]];
    float passed = candidates[0].weight;
    for (std::size_t ray = 0, c = 0; ray < kRays; ++ray) {
      const float place = (static_cast<float>(ray) + choice[i]) / static_cast<float>(kRays) * total;
      while (passed <= place && c < kFromLight) passed += candidates[++c].weight;
      const Candidate& chosen = candidates[c];
      if (!(chosen.weight > 0)) continue;  // rounding, at the end of the line
      shadows_.push(hits_[at.path[i]].ray_origin, chosen.direction);
      values_.push_back(path.throughput * chosen.value *
                        (total / (chosen.weight * static_cast<float>(kRays))));
      firsts_lit_.push_back(path.first);
    }
  }
}

/// The next directions of the paths that go on.
void BounceWalk::go_on(const Surfaces& at, std::int32_t bounce) {
  Pairs<kBlock> on;
  std::array<float, kBlock> survival;
  for (std::size_t i = 0; i < at.count; ++i) {
    const Path& path = paths_[at.path[i]];
    const auto u =
        random_of(path).uniforms(16 * static_cast<std::uint32_t>(bounce) + path.number, kLobe);
    on.add(i, u[0], u[1]);
    survival[i] = u[2];
  }
  on.draw(at.sites);
  on.evaluate(at.sites);
  for (std::size_t i = 0; i < at.count; ++i) {
    const Path& path = paths_[at.path[i]];
    const float pdf = on.density[i];
    Rgb throughput = path.throughput * on.reflected[i] / pdf;
    const float kept = std::max({throughput.x, throughput.y, throughput.z}) / kSurelyKept;
    if (!(pdf > 0) || !(survival[i] < kept)) continue;
    if (kept < 1) throughput = throughput / kept;
    next_.push_back({.ray = {hits_[at.path[i]].ray_origin, on.direction[i]},
                     .throughput = throughput,
                     .width = path.width,
                     .spread = path.spread + kConeShare / std::sqrt(pdf),
                     .least_pdf = std::min(path.least_pdf, pdf),
                     .first = path.first,
                     .number = path.number,
                     .start = path.start});
  }
}

}  // namespace baton
