#include "worker/pass/reproject.h"

#include <algorithm>
#include <cmath>

#include "common/job/motion.h"
#include "common/state/state_format.h"

namespace baton {
namespace {

/// A hit of the object in front, drawn uniformly: an edge moves with what is in front of it. Null
/// without hits.
const SurfaceHit* draw_hit(std::span<const SurfaceHit> hits, const Rng& rng) {
  const SurfaceHit* nearest = nullptr;
  for (const SurfaceHit& hit : hits) {
    if (hit.hit && (nearest == nullptr || hit.depth < nearest->depth)) nearest = &hit;
  }
  if (nearest == nullptr) return nullptr;
  const auto in_front = [&](const SurfaceHit& hit) {
    return hit.hit && hit.instance == nearest->instance;
  };
  const auto count = static_cast<std::uint32_t>(std::count_if(hits.begin(), hits.end(), in_front));
  std::uint32_t k = rng.bits(0, 0)[0] % count;
  return &*std::find_if(hits.begin(), hits.end(),
                        [&](const SurfaceHit& hit) { return in_front(hit) && k-- == 0; });
}

/// Whether all sites see the same surfaces. What catchers show between objects does not count.
bool see_the_same(std::span<const SurfaceHit> a, std::span<const SurfaceHit> b) {
  return std::ranges::equal(a, b, [](const SurfaceHit& one, const SurfaceHit& other) {
    return one.hit || other.hit ? one == other : true;
  });
}

}  // namespace

Reprojection::Reprojection(const RenderContext& context, const FrameGeometry& now,
                           const FrameGeometry& before, std::span<const StatePtr> states)
    : context_(context),
      now_(now),
      before_(before),
      old_pixels_(context, before, states),
      cos_normal_tolerance_(std::cos(context.job.motion.normal_tolerance_deg * kPi / 180)),
      still_camera_(now.pose.camera == before.pose.camera) {
  if (asks_neighbors(context.job.sampling)) neighborhood_.emplace(context, now, old_pixels_);
}

/// The pixel of the frame before in which the surface was; nullopt: outside the image or beyond
/// reach.
std::optional<Reprojection::Position> Reprojection::find_source(std::span<const SurfaceHit> hits,
                                                                const Position& pixel,
                                                                const Rng& rng) const {
  const SurfaceHit* const hit = draw_hit(hits, rng);
  if (hit == nullptr) return std::nullopt;
  if (still_camera_ && !now_.pose.instances[hit->instance].moves()) return pixel;
  const Vec3 point = carry_point(*now_.scene, now_.pose, before_.pose,
                                 {hit->instance, hit->place, hit->point.position});
  auto projected = before_.pose.camera.project(point);
  if (!projected) return std::nullopt;
  // Sites of wide filters lie around the pixel: it moves as its hit does.
  if (context_.job.image.filter != PixelFilter::box) {
    const auto now = now_.pose.camera.project(hit->point.position);
    if (!now) return std::nullopt;
    const std::array<float, 4> u = rng.uniforms(0, 1);
    (*projected)[0] += static_cast<float>(pixel.x) + u[0] - (*now)[0];
    (*projected)[1] += static_cast<float>(pixel.y) + u[1] - (*now)[1];
  }
  const std::int32_t max_px = context_.job.motion.max_px;
  const auto reach = static_cast<float>(max_px) + 1;
  const float dx = (*projected)[0] - static_cast<float>(pixel.x);
  const float dy = (*projected)[1] - static_cast<float>(pixel.y);
  if (!(std::fabs(dx) <= reach && std::fabs(dy) <= reach)) return std::nullopt;
  const Position source{static_cast<std::int32_t>(std::floor((*projected)[0])),
                        static_cast<std::int32_t>(std::floor((*projected)[1]))};
  const bool in_reach =
      std::abs(source.x - pixel.x) <= max_px && std::abs(source.y - pixel.y) <= max_px;
  const bool inside = context_.job.image.rendered().contains(source.x, source.y);
  if (!in_reach || !inside) return std::nullopt;
  return source;
}

void Reprojection::look_up(const TileSurfaces& surfaces, std::span<const std::uint32_t> slots,
                           const FrameSpec& frame) {
  const JobSpec& job = context_.job;
  slots_.assign(slots.size(), {});
  old_pixels_.clear();
  if (neighborhood_) neighborhood_->clear(slots.size());
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const auto [x, y] = surfaces.rect.place(surfaces.pixels.index(slots[i]));
    const Position pixel{x, y};
    Slot& slot = slots_[i];
    slot.hits = surfaces.pixel(slots[i]).first(static_cast<std::size_t>(job.image.sites));
    slot.key = pixel_key(job.seed, frame.number.value(), job.image.width, pixel.x, pixel.y,
                         frame.first_round);
    const std::optional<Position> source =
        find_source(slot.hits, pixel, Rng(slot.key, PassId::reproject));
    if (!source) continue;
    slot.same_pixel = source->x == pixel.x && source->y == pixel.y;
    slot.old = old_pixels_.ask(source->x, source->y);
    if (neighborhood_) neighborhood_->look_up(i, slot.hits, slot.key, source->x, source->y);
  }
  old_pixels_.trace();
  for (Slot& slot : slots_) judge(slot);
}

/// What the pixel has of the one that it may come from.
void Reprojection::judge(Slot& slot) const {
  if (!slot.old) return;
  const std::span<const SurfaceHit> old_hits = old_pixels_.hits(*slot.old);
  // Where nothing has changed, everything stays as it is.
  if (slot.same_pixel && see_the_same(old_hits, slot.hits)) {
    slot.history = PixelHistory::same;
  } else if (const std::optional<Inheritance> found = inherit(slot.hits, old_hits)) {
    slot.history = PixelHistory::moved;
    slot.inheritance = *found;
  }
}

void Reprojection::inherit_blocks(const TileSurfaces& surfaces,
                                  std::span<const std::uint32_t> slots, SampleState& state) const {
  const PixelBlocks blocks(state.rect);
  std::vector<StateFormat::BlockSource> sources;
  for (std::size_t i = 0; i < slots.size();) {
    const std::size_t block = blocks.of(surfaces.pixels.index(slots[i]));
    sources.clear();
    for (; i < slots.size() && blocks.of(surfaces.pixels.index(slots[i])) == block; ++i) {
      if (slots_[i].history == PixelHistory::none) continue;
      const OldPixels::Place& old = *slots_[i].old;
      const std::size_t from = PixelBlocks(old.state->rect).of(old.index);
      const std::size_t plane = StateFormat::block_plane_of(surfaces.sees_catcher(slots[i]));
      const auto known = std::ranges::find_if(sources, [&](const StateFormat::BlockSource& source) {
        return source.state == old.state && source.block == from && source.plane == plane;
      });
      if (known != sources.end()) {
        ++known->num_pixels;
      } else {
        sources.push_back({old.state, from, plane, 1});
      }
    }
    state.format->inherit_block(sources, state, block);
  }
}

/// Whether a surface of now is one of then: the same object, the point of now on the tangent plane
/// of then, and normals alike.
bool Reprojection::agrees(const SurfaceHit& now, const SurfaceHit& old) const {
  if (!old.hit || old.instance != now.instance) return false;
  const Vec3 point = now_.point_in(before_.pose, now);
  const Vec3 normal = now_.normal_in(before_.pose, now);
  return std::fabs(dot(old.point.ng, point - old.point.position)) <=
             context_.job.motion.depth_tolerance * old.depth &&
         dot(old.point.ns, normal) >= cos_normal_tolerance_;
}

/// Each site inherits from its namesake where that agrees; the others from the agreeing site with
/// the fewest heirs. Nullopt: a site finds nothing to inherit, or a site of then has no heir.
std::optional<Reprojection::Inheritance> Reprojection::inherit(
    std::span<const SurfaceHit> now, std::span<const SurfaceHit> old) const {
  Inheritance result;
  std::uint32_t orphans = 0;
  for (std::size_t t = 0; t < now.size(); ++t) {
    if (!now[t].hit) continue;
    if (agrees(now[t], old[t])) {
      result.from[t] = static_cast<std::uint8_t>(t);
      ++result.count[t];
    } else {
      orphans |= 1u << t;
    }
  }
  for (std::size_t t = 0; orphans >> t != 0; ++t) {
    if ((orphans >> t & 1) == 0) continue;
    std::optional<std::size_t> best;
    for (std::size_t s = 0; s < old.size(); ++s) {
      if ((!best || result.count[s] < result.count[*best]) && agrees(now[t], old[s])) best = s;
    }
    if (!best) return std::nullopt;
    result.from[t] = static_cast<std::uint8_t>(*best);
    ++result.count[*best];
  }

  // Lose no samples: the few that are left of a pixel at an edge would make a speckle that stays.
  // The choice depends on surfaces alone, so that it cannot bias.
  for (std::size_t s = 0; s < old.size(); ++s) {
    if (old[s].hit && result.count[s] == 0) return std::nullopt;
  }
  return result;
}

/// The k-th of the sites that inherit from `old_site`; where that saw no surface (its samples weigh
/// nothing), the first site that sees one.
std::uint8_t Reprojection::find_heir(std::span<const SurfaceHit> hits,
                                     const Inheritance& inheritance, std::uint8_t old_site,
                                     std::uint32_t k) {
  const bool none = inheritance.count[old_site] == 0;
  for (std::size_t t = 0; t < hits.size(); ++t) {
    if (!hits[t].hit) continue;
    if (none || (inheritance.from[t] == old_site && k-- == 0)) return static_cast<std::uint8_t>(t);
  }
  return 0;
}

/// Copies all samples, each to a site that inherits it.
void Reprojection::copy_samples(const Slot& slot, std::size_t pixel, SampleState& state) const {
  state.copy_pixels(*slot.old->state, slot.old->index, pixel, 1);
  const Rng rng(slot.key, PassId::reproject);
  state.format->move_to_sites(state, pixel, [&](std::uint8_t site, std::size_t particle) {
    const std::uint32_t heirs = slot.inheritance.count[site];
    const std::uint32_t k =
        heirs > 1 ? rng.bits(1, static_cast<std::uint32_t>(particle))[0] % heirs : 0;
    return find_heir(slot.hits, slot.inheritance, site, k);
  });
}

PixelHistory Reprojection::take(std::size_t i, std::size_t pixel, CatcherAlbedo& catchers,
                                SampleState& state, OldSurfaces& old) const {
  const Slot& slot = slots_[i];
  if (slot.history == PixelHistory::none) return PixelHistory::none;
  if (slot.history == PixelHistory::same) {
    state.copy_pixels(*slot.old->state, slot.old->index, pixel, 1);
    return PixelHistory::same;
  }

  copy_samples(slot, pixel, state);
  const std::span<const SurfaceHit> old_hits = old_pixels_.hits(*slot.old);
  const std::span<const SurfaceShading> old_shadings = old_pixels_.shadings(*slot.old);
  old.sites.clear(static_cast<int>(slot.hits.size()));
  for (std::size_t t = 0; t < slot.hits.size(); ++t) {
    if (!slot.hits[t].hit) {
      old.sites.add_miss(static_cast<int>(t));
      continue;
    }
    const std::size_t from = slot.inheritance.from[t];
    catchers.add_to(old.sites, static_cast<int>(t), before_, old_hits[from],
                    old_shadings.empty() ? nullptr : &old_shadings[from]);
    old.log_share[t] = -std::log(static_cast<float>(slot.inheritance.count[from]));
  }
  return PixelHistory::moved;
}

std::span<const CarriedSet> Reprojection::neighbors(std::size_t i, CatcherAlbedo& catchers) {
  if (!neighborhood_) return {};
  return neighborhood_->sets(i, slots_[i].hits, catchers);
}

}  // namespace baton
