#include "common/math/low_discrepancy.h"

#include <memory>

namespace baton {
namespace {

constexpr std::uint32_t reverse_bits(std::uint32_t v) {
  v = ((v >> 1) & 0x55555555u) | ((v & 0x55555555u) << 1);
  v = ((v >> 2) & 0x33333333u) | ((v & 0x33333333u) << 2);
  v = ((v >> 4) & 0x0F0F0F0Fu) | ((v & 0x0F0F0F0Fu) << 4);
  v = ((v >> 8) & 0x00FF00FFu) | ((v & 0x00FF00FFu) << 8);
  return (v >> 16) | (v << 16);
}

}  // namespace

std::array<std::uint32_t, 2> sobol_2d(std::uint32_t index) {
  // Second dimension: the direction numbers satisfy v_{k+1} = v_k ^ (v_k >> 1).
  std::uint32_t y = 0;
  for (std::uint32_t v = 1u << 31, i = index; i != 0; i >>= 1, v ^= v >> 1) {
    if ((i & 1u) != 0) y ^= v;
  }
  return {reverse_bits(index), y};
}

std::uint32_t owen_scramble(std::uint32_t fraction, std::uint32_t seed) {
  std::uint32_t x = reverse_bits(fraction);
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}

const SobolTable& sobol_table() {
  static const std::unique_ptr<const SobolTable> table = [] {
    auto made = std::make_unique<SobolTable>();
    for (std::uint32_t i = 0; i < kSobolTableSize; ++i) {
      const auto [x, y] = sobol_2d(i);
      made->x[i] = x;
      made->y[i] = y;
    }
    return made;
  }();
  return *table;
}

}  // namespace baton
