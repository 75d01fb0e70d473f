#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/job/time.h"
#include "common/math/octahedral.h"
#include "common/math/pixel_rect.h"

namespace baton {

/// What the first pass tells the second about one tile of one frame: where shadow rays failed, and
/// the free samples of the pixels that may take part. Pixels go row by row inside `rect`. Surfaces
/// are not stored: they are traced again.
struct FirstPassSamples {
  /// Bits of `flags`: the pixel sees a surface; a ray of population 0, 1 failed.
  static constexpr std::uint8_t kSurface = 1;
  static constexpr std::uint8_t kFailed[2] = {2, 4};

  Digest picture;  ///< picture_digest of the job
  Step step{};
  std::int32_t tile = 0;
  PixelRect rect;
  std::int32_t num_slots = 0;  ///< N: samples of a pixel, all populations
  /// K, 1 or 2; population k has slots [k N / K, (k + 1) N / K).
  std::int32_t num_populations = 1;

  std::vector<std::uint8_t> flags;  ///< (pixels)
  std::vector<std::uint8_t> count;  ///< (pixels) stored samples, at most N
  /// (pixels, K), or empty where the second pass has no use for it.
  std::vector<float> lns;

  // (samples), pixel after pixel, slots ascending
  std::vector<std::uint8_t> slot;
  std::vector<std::uint8_t> site;
  std::vector<OctDirection> direction;
  /// u_j / K: all samples of a pixel together estimate its Lns.
  std::vector<float> energy;

  bool operator==(const FirstPassSamples&) const = default;
  std::size_t num_pixels() const { return static_cast<std::size_t>(rect.area()); }
  /// Drops the samples of pixels that no mask dilated by `radius` can have, whatever the tiles
  /// around say.
  void keep_possible(std::int32_t radius);
};

/// Deterministic, little-endian; grammar in common/state/FORMAT.md.
Bytes encode_first_pass_samples(const FirstPassSamples& samples);
/// `name` goes first in every error: wrong magic or version, checksum, sizes that do not agree,
/// values out of range.
Result<FirstPassSamples> decode_first_pass_samples(ByteView bytes, const std::string& name);

}  // namespace baton
