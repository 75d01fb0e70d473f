#include "worker/bounce/bounce_walk.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/poison.h"
#include "worker/bounce/surface_light.h"

namespace baton {
namespace {

/// Surfaces that are worked on together: lanes for the kernels, and they stay in the cache.
constexpr std::size_t kBlock = SurfaceLight::kMost;
/// Width of the cone that textures are averaged over, as a share of the distance between two paths
/// of a pixel: neighbours overlap by little, and what is blurred stays below what their noise
/// hides.
constexpr float kConeShare = 0.125f;
/// Paths that carry more than this share of their first piece's light never end early.
constexpr float kSurelyKept = 0.5f;

/// Indices of a path's random numbers at a surface.
enum Draw : std::uint32_t { kChoose, kLobe };

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

/// Alpha from which on a lobe's paths are worth sharing.
constexpr float kRoughLobe = 0.3f;
/// Share of a pixel's paths that sharp lobes may take where it shares.
constexpr float kMostSharp = 0.5f;

/// Whether the sites of a pixel reflect so sharply that others meet nothing for it.
bool is_sharp(const SiteBlock& sites) {
  if (sites.num_lobes == 0) return false;
  float sharp = 0;
  for (std::int32_t i = 0; i < sites.num_lobes; ++i) {
    const auto site = static_cast<std::size_t>(sites.lobe_sites[static_cast<std::size_t>(i)]);
    const float in_coat = sites.any_coat ? sites.coats.chance[site] : 0;
    const bool is_rough = sites.is_ggx[site] > 0 && sites.shape[site] >= kRoughLobe;
    sharp += sites.specular_probability[site] * (is_rough ? in_coat : 1);
  }
  return sharp > kMostSharp * static_cast<float>(sites.num_hits);
}

/// What a surface reflects alike to all sides of all that it reflects: the albedo of a Lambertian
/// surface about the mesh's normal. It depends on the place alone (and on the width that textures
/// are averaged over): not on who looks.
Rgb alike_albedo(const Material& material) {
  switch (material.lobe) {
    case Material::Lobe::none:
    case Material::Lobe::phong:
      return material.kd;
    case Material::Lobe::ggx:
      return material.kd * (Rgb{1, 1, 1} - material.dielectric_f0);
    case Material::Lobe::measured:
      break;
  }
  return {};
}

/// The sites of a pixel that its paths start from, in turn.
class Turns {
 public:
  Turns(const BounceStart& start, std::uint32_t paths)
      : shift_(uniform_float(bounce_bits(start.key, BounceStep::shift)[0])),
        scale_(static_cast<float>(start.hits.size()) / static_cast<float>(paths)),
        last_(start.hits.size() - 1) {}
  std::size_t operator[](std::uint32_t path) const {
    return std::min(static_cast<std::size_t>((static_cast<float>(path) + shift_) * scale_), last_);
  }

 private:
  float shift_, scale_;
  std::size_t last_;
};

}  // namespace

/// The surfaces that some paths have met.
struct BounceWalk::Surfaces {
  SiteBlock sites;
  std::array<std::size_t, kBlock> path;  ///< indices of paths and hits
  /// alike_albedo over pi of those that are shared, else 0; and the normal that it is about.
  std::array<Rgb, kBlock> alike;
  std::array<Vec3, kBlock> ns;
  std::size_t count = 0;

  bool is_shared(std::size_t i) const { return mean(alike[i]) > 0; }
  /// What of the light from a direction is reflected alike.
  Rgb reflected_alike(std::size_t i, const Vec3& direction) const {
    const Vec3 ng{sites.ng_x[i], sites.ng_y[i], sites.ng_z[i]};
    if (!(dot(ng, direction) > 0)) return {};
    return alike[i] * std::max(dot(ns[i], direction), 0.0f);
  }
};

Rng BounceWalk::random_of(const Path& path) const {
  return {starts_[path.start].key, PassId::bounce};
}

void BounceWalk::push_path(std::uint32_t pixel, const SurfaceHit& hit, const Vec3& direction,
                           float pdf, std::uint32_t number, const Rgb& weight, Kind kind) {
  paths_.push_back({.ray = {hit.ray_origin, direction},
                    .throughput = {1, 1, 1},
                    .shared = {1, 1, 1},
                    .width = hit.place.width,
                    .spread = kConeShare / std::sqrt(pdf),
                    .least_pdf = pdf,
                    .first = static_cast<std::uint32_t>(firsts_.size()),
                    .number = number,
                    .start = static_cast<std::uint32_t>(starts_.size() - 1)});
  firsts_.push_back({.pixel = pixel, .weight = weight, .kind = kind});
}

BounceWalk::BounceWalk(const LightSpec& spec, const FrameGeometry& geometry)
    : spec_(spec), geometry_(geometry) {
  has_metal_ = std::ranges::any_of(geometry.scene->materials, [](const Material& material) {
    return material.specular_probability > kMostSharp || material.lobe == Material::Lobe::measured;
  });
}

void BounceWalk::add(std::uint32_t pixel, const BounceStart& start) {
  starts_.push_back({&start.presampled, start.key});
  if (is_sharp(start.sites)) return add_own(pixel, start, 0, Kind::alone);
  add_member(pixel, start);
  if (has_metal_) add_own(pixel, start, kSharedPaths, Kind::rest);
}

/// Paths that belong to the pixel alone, from that number on.
void BounceWalk::add_own(std::uint32_t pixel, const BounceStart& start, std::uint32_t first_path,
                         Kind kind) {
  const BouncePoints points(start.key, start.is_aside);
  const Turns turns(start, kPaths - first_path);
  SurfacePairs<kPaths> first;
  std::array<std::uint32_t, kPaths> number;
  for (std::uint32_t k = first_path; k < kPaths; ++k) {
    const std::size_t site = turns[k - first_path];
    if (!start.hits[site].hit) continue;
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
              number[i], reflected / (pdf * static_cast<float>(kPaths)), kind);
  }
}

BounceWalk::Exchange& BounceWalk::exchange_of(const BounceStart& start, std::uint32_t path) {
  const auto used = std::span(exchanges_).first(num_exchanges_);
  const auto found = std::ranges::find_if(used, [&](const Exchange& exchange) {
    return exchange.path == path && exchange.is_aside == start.is_aside &&
           exchange.group.is_same(start.group);
  });
  if (found != used.end()) return *found;
  if (num_exchanges_ == exchanges_.size()) exchanges_.emplace_back();
  Exchange& next = exchanges_[num_exchanges_++];
  next.group = start.group;
  next.path = path;
  next.is_aside = start.is_aside;
  next.members.clear();
  next.sites.clear(BounceGroup::kMembers);
  return next;
}

void BounceWalk::add_member(std::uint32_t pixel, const BounceStart& start) {
  constexpr std::uint32_t kMembers = BounceGroup::kMembers;
  const BounceGroup& group = start.group;
  const BouncePoints points(group.block, start.is_aside, group.number);
  const Turns turns(start, kSharedPaths);
  const SiteBlock& sites = start.sites;
  SurfacePairs<kSharedPaths> first;
  std::array<std::uint32_t, kSharedPaths> number;
  for (std::uint32_t k = 0; k < kSharedPaths; ++k) {
    const std::size_t site = turns[k];
    if (!start.hits[site].hit) continue;
    // A pixel has another point of its group's each time, and so has each of its sites.
    const std::uint32_t turn = start.key.round * kSharedPaths + k;
    const std::uint32_t member = (group.member + turn + start.key.round) % kMembers;
    const auto u = points[turn * kMembers + member];
    number[first.count] = k;
    first.add(site, u[0], u[1]);
  }
  first.draw(sites);
  first.evaluate(sites);
  const std::uint32_t num_own = has_metal_ ? kPaths : kSharedPaths;
  for (std::size_t i = 0; i < first.count; ++i) {
    const auto site = static_cast<std::size_t>(first.site[i]);
    const SurfaceHit& hit = start.hits[site];
    Member member{.origin = hit.ray_origin, .pixel = pixel, .first = -1};
    const float pdf = first.density[i];
    const Rgb reflected = first.reflected[i];
    if (pdf > 0 && mean(reflected) > 0) {
      member.first = static_cast<std::int32_t>(firsts_.size());
      push_path(pixel, hit, first.direction[i], pdf, number[i],
                reflected / (pdf * static_cast<float>(num_own)), Kind::member);
    }
    Exchange& exchange = exchange_of(start, number[i]);
    exchange.sites.add_copy(static_cast<int>(exchange.members.size()), sites,
                            static_cast<int>(site));
    exchange.members.push_back(member);
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
    lit_.clear();
    std::array<std::size_t, kBlock> met;
    std::size_t count = 0;
    for (std::size_t i = 0; i < hits_.size(); ++i) {
      if (hits_[i].hit && is_wanted(i, bounce)) met[count++] = i;
      if (count == kBlock || (count > 0 && i + 1 == hits_.size())) {
        shade(std::span(met).first(count), bounce, light);
        count = 0;
      }
    }
    geometry_.accel->occluded(shadows_);
    num_rays_ += shadows_.size();
    for (std::size_t i = 0; i < shadows_.size(); ++i) {
      if (shadows_.t_far[i] < 0) continue;
      First& first = firsts_[lit_[i].first];
      first.radiance += lit_[i].radiance;
      first.shared += lit_[i].shared;
    }
    std::swap(paths_, next_);
  }

  // Hand out.
  for (const First& first : firsts_) {
    found[first.pixel] += first.weight * (first.radiance - first.shared);
  }
  for (std::size_t i = 0; i < num_exchanges_; ++i) share(exchanges_[i], found);
  num_exchanges_ = 0;
  paths_.clear();
  firsts_.clear();
  starts_.clear();
}

/// Hands the light of surfaces that members have met to all that see them.
void BounceWalk::share(const Exchange& exchange, std::span<Rgb> found) {
  constexpr std::size_t kMost = BounceGroup::kMembers;
  const std::span<const Member> members = exchange.members;
  // Who may see what: pairs in the order of the surfaces.
  SurfacePairs<kMost * kMost> pairs;
  std::array<float, kMost * kMost> measure;  // cos / d^2 at the surface
  std::array<std::size_t, kMost + 1> end;
  std::array<const First*, kMost> met;
  std::size_t num_met = 0;
  shadows_.clear();
  for (const Member& finder : members) {
    if (finder.first < 0) continue;
    const First& first = firsts_[static_cast<std::size_t>(finder.first)];
    if (!(mean(first.shared) > 0)) continue;
    met[num_met] = &first;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const Vec3 way = first.origin - members[i].origin;
      const float facing = -dot(way, first.ng), d2 = dot(way, way);
      if (!(facing > 0 && d2 > 0)) continue;
      const float inverse = 1 / std::sqrt(d2);
      measure[pairs.count] = facing * inverse / d2;
      pairs.add(i, way * inverse);
      shadows_.push(members[i].origin, way);
      shadows_.t_far[shadows_.size() - 1] = 1;
    }
    end[num_met++] = pairs.count;
  }
  if (pairs.count == 0) return;
  pairs.evaluate(exchange.sites);
  geometry_.accel->occluded(shadows_);
  num_rays_ += shadows_.size();

  std::size_t begin = 0;
  for (std::size_t m = 0; m < num_met; begin = end[m++]) {
    float sum = 0;
    for (std::size_t n = begin; n < end[m]; ++n) {
      const Member& member = members[static_cast<std::size_t>(pairs.site[n])];
      const bool is_finder =
          member.first >= 0 && &firsts_[static_cast<std::size_t>(member.first)] == met[m];
      // A path is drawn where it reflects something, and its finder sees a surface.
      const bool draws = mean(pairs.reflected[n]) > 0;
      if (!draws || (!is_finder && shadows_.t_far[n] < 0)) measure[n] = 0;
      sum += measure[n] * pairs.density[n];
    }
    if (!(sum > 0) || !std::isfinite(sum)) continue;
    const float scale = 1 / (sum * static_cast<float>(kSharedPaths));
    for (std::size_t n = begin; n < end[m]; ++n) {
      if (measure[n] > 0)
        found[members[static_cast<std::size_t>(pairs.site[n])].pixel] +=
            pairs.reflected[n] * met[m]->shared * (measure[n] * scale);
    }
  }
}

/// Whether a surface that a path has met can add to it.
bool BounceWalk::is_wanted(std::size_t path, std::int32_t bounce) const {
  if (bounce > 1 || firsts_[paths_[path].first].kind != Kind::rest) return true;
  const Material& material = geometry_.material_of(hits_[path]);
  return material.lobe != Material::Lobe::none || material.coat.weight > 0 ||
         (material.detail != nullptr && material.detail->has(DetailImage::normal));
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
    at.alike[i] = {};
    if (bounce == 1 && first.kind != Kind::alone) {
      at.alike[i] = alike_albedo(seen.material) * kInvPi;
      at.ns[i] = hit.point.ns;
      first.origin = hit.ray_origin;
      first.ng = hit.point.ng;
      path.shared = at.is_shared(i) ? Rgb{1, 1, 1} : Rgb{};
    } else if (bounce == 1) {
      path.shared = {};
    }
    first.radiance += path.throughput * seen.emission;
    first.shared += path.shared * seen.emission;
  }
  light_up(at, bounce, light);
  if (bounce < spec_.bounces) go_on(at, bounce);
}

/// Shadow rays to some of the light.
void BounceWalk::light_up(const Surfaces& at, std::int32_t bounce, const EnvironmentView& light) {
  if (starts_[paths_[at.path[0]].start].presampled->empty()) return;  // a black map
  SurfaceLight candidates;
  std::array<float, kBlock> choice;
  for (std::size_t i = 0; i < at.count; ++i) {
    const Path& path = paths_[at.path[i]];
    const Philox4x32::Counter bits =
        random_of(path).bits(bounce_step(bounce, path.number), kChoose);
    choice[i] = uniform_float(bits[1]);
    candidates.add(at.sites, i,
                   starts_[path.start].presampled->blocks[bits[0] % PresampledLight::kNumBlocks],
                   {uniform_float(bits[2]), uniform_float(bits[3])});
  }
  candidates.evaluate(at.sites, light);
  for (std::size_t i = 0; i < at.count; ++i)
    keep_some(at, i, candidates.of(at.sites, i), choice[i]);
}

/// Traces some candidates of surface i, drawn systematically in proportion to what they bring. u:
/// uniform in [0, 1).
void BounceWalk::keep_some(const Surfaces& at, std::size_t i,
                           std::span<const SurfaceCandidate> candidates, float u) {
  float total = 0;
  for (const SurfaceCandidate& one : candidates) total += one.weight;
  if (!(total > 0) || !std::isfinite(total)) return;
  const Path& path = paths_[at.path[i]];
  const bool is_shared = at.is_shared(i);
  const bool is_member = is_shared && firsts_[path.first].kind == Kind::member;
  const int num_rays = is_member ? limits::kSharedBounceRays : limits::kBounceRays;
  const float share = total / static_cast<float>(num_rays);
  float passed = candidates[0].weight;
  std::size_t c = 0;
  for (int ray = 0; ray < num_rays; ++ray) {
    const float place = (static_cast<float>(ray) + u) * share;
    while (passed <= place && c + 1 < candidates.size()) passed += candidates[++c].weight;
    const SurfaceCandidate& chosen = candidates[c];
    if (!(chosen.weight > 0)) continue;  // rounding, at the end of the line
    shadows_.push(hits_[at.path[i]].ray_origin, chosen.direction);
    const float scale = share / chosen.weight;
    const Rgb alike =
        is_shared ? at.reflected_alike(i, chosen.direction) * chosen.arriving : chosen.value;
    lit_.push_back({.first = path.first,
                    .radiance = path.throughput * chosen.value * scale,
                    .shared = path.shared * alike * scale});
  }
}

/// The next directions of the paths that go on.
void BounceWalk::go_on(const Surfaces& at, std::int32_t bounce) {
  SurfacePairs<kBlock> on;
  std::array<float, kBlock> survival;
  for (std::size_t i = 0; i < at.count; ++i) {
    const Path& path = paths_[at.path[i]];
    const auto u = random_of(path).uniforms(bounce_step(bounce, path.number), kLobe);
    on.add(i, u[0], u[1]);
    survival[i] = u[2];
  }
  on.draw(at.sites);
  on.evaluate(at.sites);
  for (std::size_t i = 0; i < at.count; ++i) {
    const Path& path = paths_[at.path[i]];
    const float pdf = on.density[i];
    Rgb throughput = path.throughput * on.reflected[i] / pdf;
    Rgb shared = path.shared *
                 (at.is_shared(i) ? at.reflected_alike(i, on.direction[i]) : on.reflected[i]) / pdf;
    const float kept = std::max({throughput.x, throughput.y, throughput.z}) / kSurelyKept;
    if (!(pdf > 0) || !(survival[i] < kept)) continue;
    if (kept < 1) {
      throughput = throughput / kept;
      shared = shared / kept;
    }
    next_.push_back({.ray = {hits_[at.path[i]].ray_origin, on.direction[i]},
                     .throughput = throughput,
                     .shared = shared,
                     .width = path.width,
                     .spread = path.spread + kConeShare / std::sqrt(pdf),
                     .least_pdf = std::min(path.least_pdf, pdf),
                     .first = path.first,
                     .number = path.number,
                     .start = path.start});
  }
}

}  // namespace baton
