#pragma once

#include <array>
#include <cstdint>

#include "common/math/padded_array.h"

namespace baton {

/// Point `index` of the two-dimensional Sobol' sequence as 32-bit fractions, a (0, 2)-sequence in
/// base 2: every aligned block of 2^k points is a (0, k, 2)-net. First dimension van der Corput,
/// second by Sobol's matrix x + 1.
std::array<std::uint32_t, 2> sobol_2d(std::uint32_t index);

/// Nested uniform (Owen) scramble of a 32-bit fraction by hashing [Laine & Karras 2011; Burley
/// 2020]: each point becomes uniform, nets stay nets.
std::uint32_t owen_scramble(std::uint32_t fraction, std::uint32_t seed);

/// The first kSobolTableSize points, made once: x then y. SIR candidates read it, each pixel with
/// its own random digital shift (exclusive or), which keeps every point uniform and every net a
/// net.
inline constexpr std::uint32_t kSobolTableSize = 8192;
struct SobolTable {
  PaddedArray<std::uint32_t, kSobolTableSize> x, y;
};
const SobolTable& sobol_table();

}  // namespace baton
