#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base/poison.h"
#include "common/math/octahedral.h"
#include "worker/accel/accel.h"
#include "worker/sampling/pixel_rays.h"
#include "worker/surface/site_block.h"

namespace baton {

/// The shadow rays of many pixels, one pixel after the other and ascending by sample, and beside
/// each what it brings if it is free.
struct RayBatch {
  ShadowRays rays;
  /// (capacity) of which the first rays.size() count.
  std::vector<std::uint32_t> sample;  ///< number of the sample in its pixel
  std::vector<float> r, g, b;         ///< u_j (f cos L)_rgb / p~
  std::vector<float> visibility;      ///< share of the pixel's Lns
  /// Handed back to the method: PixelRays::tag.
  std::vector<std::uint16_t> tag;

  void clear() {
    rays.clear();
    poison(sample);
    poison(tag);
    for (auto* column : {&r, &g, &b, &visibility}) poison(*column);
  }
  std::size_t size() const { return rays.size(); }
  /// Makes room for `more` rays and what a vector may write past them.
  void reserve(std::size_t more);
};

/// A properly weighted set of one pixel, (N) each, and what its reflected light counts for.
struct CastSamples {
  std::span<const OctDirection> direction;
  std::span<const std::uint8_t> site;
  std::span<const float> weight;  ///< sum 1, or all 0
  const float *r, *g, *b;         ///< (f cos L)_rgb
  float unit_contribution;        ///< u_j is this times weight_j
  float image_scale;              ///< factor of the set's light in the image
  /// Factor of the set's weights in the pixel's visibility.
  float visibility_scale;
  std::uint32_t first_sample;  ///< number of sample 0 in the pixel
};

/// What the rays of one pixel found.
struct FreeLight {
  Rgb color;    ///< sum of what the free ones bring
  Rgb blocked;  ///< sum of what the blocked ones would bring
  float visibility = 0;
  std::uint64_t is_free = 0;  ///< bit by bit
};
/// Sums rays [first, end) of a traced batch, at most 64, in an order that only their number
/// decides.
FreeLight sum_free(const RayBatch& batch, std::size_t first, std::size_t end);

/// Where the shadow rays of a pixel's sites start.
struct SiteOrigins {
  alignas(64) SiteBlock::Array x, y, z;  ///< sites with a surface; others are not set
  std::int32_t num_sites = 1;

  void set(std::size_t site, const Vec3& origin) {
    x[site] = origin.x;
    y[site] = origin.y;
    z[site] = origin.z;
  }
};

/// Adds the rays of one pixel.
void cast_rays(const PixelRays& rays, const SiteOrigins& origins, RayBatch& batch);

/// Adds a ray for every sample that brings light. target: (N) out, p~ of each sample's own site,
/// the mean of its (f cos L)_rgb.
void cast_samples(const CastSamples& samples, const SiteOrigins& origins, RayBatch& batch,
                  std::span<float> target);

/// What is known of a pixel whatever its rays find; they add to it.
struct KnownLight {
  Rgb color;
  float visibility = 0;
  /// Variance of `color` at the pixel's sites, where MethodTraits::tells_variance.
  Rgb variance{};
  /// The pixel if all rays were free, of methods that say it better than their rays do
  /// (PixelInput::wants_unshadowed).
  std::optional<Rgb> unshadowed{};
  bool blocked = false;  ///< some of the light is known not to arrive
};

/// Where a method writes a pixel: its constant, and the rays whose values are added.
class RayWriter {
 public:
  RayWriter(const SiteOrigins& origins, RayBatch& batch) : origins_(origins), batch_(batch) {}

  KnownLight known;

  /// See cast_samples().
  void add(const CastSamples& samples, std::span<float> target) {
    cast_samples(samples, origins_, batch_, target);
  }
  /// Rays and constant.
  void add(const PixelRays& rays) {
    cast_rays(rays, origins_, batch_);
    known = {.color = rays.constant.color, .visibility = rays.constant.visibility};
  }

 private:
  const SiteOrigins& origins_;
  RayBatch& batch_;
};

/// The traced rays of one pixel; at most 64.
struct FoundRays {
  std::span<const std::uint32_t> sample;  ///< as RayBatch::sample
  std::span<const std::uint16_t> tag;
  std::uint64_t is_free = 0;  ///< bit by bit

  bool free(std::size_t i) const { return (is_free >> i & 1) != 0; }
};

}  // namespace baton
