#pragma once

#include <array>
#include <cstdint>

#include "common/base/limits.h"

namespace baton {

/// Philox4x32-10 [Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"]: 128 random
/// bits from a 128-bit counter and a 64-bit key. Randomness is addressed, not consumed.
/// philox-inl.h is the same in SIMD.
struct Philox4x32 {
  static constexpr std::uint32_t kMultiplier0 = 0xD2511F53u;
  static constexpr std::uint32_t kMultiplier1 = 0xCD9E8D57u;
  static constexpr std::uint32_t kWeyl0 = 0x9E3779B9u;
  static constexpr std::uint32_t kWeyl1 = 0xBB67AE85u;
  static constexpr int kRounds = 10;

  using Counter = std::array<std::uint32_t, 4>;

  static constexpr Counter block(Counter c, std::uint64_t key) {
    auto k0 = static_cast<std::uint32_t>(key);
    auto k1 = static_cast<std::uint32_t>(key >> 32);
    for (int round = 0; round < kRounds; ++round) {
      const std::uint64_t p0 = std::uint64_t{kMultiplier0} * c[0];
      const std::uint64_t p1 = std::uint64_t{kMultiplier1} * c[2];
      c = {static_cast<std::uint32_t>(p1 >> 32) ^ c[1] ^ k0, static_cast<std::uint32_t>(p1),
           static_cast<std::uint32_t>(p0 >> 32) ^ c[3] ^ k1, static_cast<std::uint32_t>(p0)};
      k0 += kWeyl0;
      k1 += kWeyl1;
    }
    return c;
  }
};

/// Which part of the program asks: the third word of every address. Values are for ever.
enum class PassId : std::uint32_t {
  site_position = 1,  ///< where a pixel's sites lie
  /// The frame's presampled environment directions.
  presampled_light = 2,
  candidates = 3,  ///< SIR candidates
  choose = 4,      ///< SIR choice
  resample = 5,    ///< resampling of carried particles
  move = 6,        ///< Metropolis-Hastings moves
  reference = 7,   ///< brute force
  refresh = 8,     ///< a pixel's turn to start afresh
  partition = 9,   ///< where the squares of the second pass lie
  /// Who is offered a sample in the second pass.
  exchange = 10,
  /// The site that is followed back, and which site inherits a sample.
  reproject = 11,
  neighbor = 12,  ///< which neighbours a pixel asks
  bounce = 13,    ///< light between surfaces
};

/// uint32 -> float uniform in [0, 1): the top 24 bits.
constexpr float uniform_float(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24f;
}

/// The address of a pixel's randomness: (job seed, frame, round, pixel, pass, step, index).
/// pixel: that of pixel_key, so no tiling enters. Equal addresses give equal numbers, on any
/// thread or host.
struct RngKey {
  std::uint64_t job_seed = 0;
  std::uint32_t frame = 0;
  std::uint32_t pixel = 0;
  std::uint32_t round = 0;

  /// Key of Philox: another one for each round.
  constexpr std::uint64_t philox_key() const { return job_seed + 0x9E3779B97F4A7C15ull * round; }
};
/// A number for each pixel: y * image_width + x from the first row on, from the left edge to the
/// right one. Pixels outside of these, which overscan has, count in a larger image, behind all
/// others: width + 2 margins to a row. Limits of sides and overscan keep both parts below 2^31.
constexpr std::uint32_t pixel_number(std::int32_t image_width, std::int32_t x, std::int32_t y) {
  if (y >= 0 && x >= 0 && x < image_width) return static_cast<std::uint32_t>(y * image_width + x);
  constexpr std::int32_t kMargin = limits::kMaxOverscan;
  return 0x80000000u +
         static_cast<std::uint32_t>((y + kMargin) * (image_width + 2 * kMargin) + x + kMargin);
}
/// The address of pixel (x, y) of frame number `frame` in images of `image_width` pixels. round: of
/// the frame; negative: one that is not seen.
constexpr RngKey pixel_key(std::uint64_t job_seed, std::int32_t frame, std::int32_t image_width,
                           std::int32_t x, std::int32_t y, std::int32_t round = 0) {
  return {job_seed, static_cast<std::uint32_t>(frame), pixel_number(image_width, x, y),
          static_cast<std::uint32_t>(round)};
}

class Rng {
 public:
  constexpr Rng(const RngKey& key, PassId pass) : key_(key), pass_(pass) {}

  /// 128 bits at (step, index); step < 2^24.
  constexpr Philox4x32::Counter bits(std::uint32_t step, std::uint32_t index) const {
    return Philox4x32::block({key_.pixel, key_.frame, pass_word(step), index}, key_.philox_key());
  }
  /// Four uniforms in [0, 1).
  constexpr std::array<float, 4> uniforms(std::uint32_t step, std::uint32_t index) const {
    const Philox4x32::Counter b = bits(step, index);
    return {uniform_float(b[0]), uniform_float(b[1]), uniform_float(b[2]), uniform_float(b[3])};
  }
  constexpr std::uint32_t pass_word(std::uint32_t step) const {
    return (static_cast<std::uint32_t>(pass_) << 24) | (step & 0xFFFFFFu);
  }
  constexpr const RngKey& key() const { return key_; }

 private:
  RngKey key_;
  PassId pass_;
};

}  // namespace baton
