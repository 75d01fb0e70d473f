#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/poison.h"
#include "worker/surface/scene_kernels.h"

namespace baton {

template <std::size_t kSize>
struct DirectionColumns {
  std::array<float, kSize> x, y, z;

  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
};
template <std::size_t kSize>
struct ColorColumns {
  std::array<float, kSize> r, g, b;

  Rgb operator[](std::size_t i) const { return {r[i], g[i], b[i]}; }
};
/// (surface, direction) pairs, and what surfaces make of light from there.
template <std::size_t kSize>
struct SurfacePairs {
  std::array<std::int32_t, kSize> site;
  DirectionColumns<kSize> direction;
  ColorColumns<kSize> reflected;  ///< BRDF times cosine
  std::array<float, kSize> density;
  std::array<float, kSize> u0, u1;  ///< that directions are drawn with
  std::size_t count;

  SurfacePairs() {
    poison(*this);
    count = 0;
  }
  void add(std::size_t at, const Vec3& way) {
    site[count] = static_cast<std::int32_t>(at);
    direction.x[count] = way.x;
    direction.y[count] = way.y;
    direction.z[count++] = way.z;
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

}  // namespace baton
