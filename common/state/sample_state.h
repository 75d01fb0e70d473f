#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/base/section_file.h"
#include "common/job/time.h"
#include "common/math/octahedral.h"
#include "common/math/pixel_rect.h"
#include "common/state/pixel_memory.h"

namespace baton {

/// Where a pixel's samples of this frame come from. Stored; values are for ever.
enum class PixelSource : std::uint8_t {
  background = 0,  ///< no surface in the pixel
  fresh = 1,       ///< started with SIR
  carried = 2,     ///< carried on from the previous frame
  restarted = 3,   ///< carried, but all weights died: SIR again
  refreshed = 4,   ///< carried, Lns computed again by a rule
  /// A shadow catcher's pixel, whose memory no object may inherit.
  catcher = 5,
};

/// The baton: what one tile hands to its next frame. Structure of arrays; pixels row by row inside
/// `rect`. The surfaces are not stored: primary hits are a pure function of (job, frame, pixel,
/// site) and are traced again. A background pixel carries nothing: every array is 0 there, and the
/// file leaves it out.
struct SampleState {
  Digest picture;  ///< picture_digest of the job
  Step step{};     ///< the samples are of this step
  std::int32_t tile = 0;
  PixelRect rect;
  /// N: particles of all populations; 0 where only a memory is carried.
  std::int32_t num_particles = 0;
  /// K: parts that never exchange anything; part k has particles [k N / K, (k + 1) N / K).
  std::int32_t num_populations = 1;

  /// (pixels, K) estimate of the unshadowed radiance, mean over RGB.
  std::vector<float> lns;
  /// (pixels, K) Lns at the last SIR or refresh.
  std::vector<float> lns_fresh;
  std::vector<PixelSource> source;      ///< (pixels, K)
  std::vector<OctDirection> direction;  ///< (pixels, N)
  /// (pixels, N) normalised, sum 1 in each population, or all 0 when no particle is lit.
  std::vector<float> weight;
  std::vector<std::uint8_t> site;  ///< (pixels, N)

  /// (pixels), or empty: nothing is remembered.
  std::vector<PixelMemory> memory;
  /// (pixels) how many fresh sets a pixel's samples count as when they are weighed against fresh
  /// ones, 0: they are no history; or empty: the method has no confidence.
  std::vector<std::uint16_t> confidence;

  bool operator==(const SampleState&) const = default;
  std::size_t num_pixels() const { return static_cast<std::size_t>(rect.area()); }
  /// Sizes every array, all zero. new_num_populations divides new_num_particles.
  void resize(const PixelRect& new_rect, std::int32_t new_num_particles,
              std::int32_t new_num_populations = 1);
  /// Size of a pixel in a file before packing, at most, and about its size in memory; as the flags
  /// say with a memory or a confidence.
  static constexpr std::size_t bytes_per_pixel(std::size_t particles, std::size_t populations,
                                               bool with_memory, bool with_confidence) {
    return populations * (sizeof(lns[0]) + sizeof(lns_fresh[0]) + sizeof(source[0])) +
           particles * (sizeof(direction[0]) + sizeof(weight[0]) + sizeof(site[0])) +
           (with_memory ? PixelMemory::kMaxStoredBytes : 0) +
           (with_confidence ? sizeof(confidence[0]) : 0);
  }
  /// What all arrays take in memory.
  std::size_t size_bytes() const;
  /// Lets each pixel's samples count for nothing yet.
  void add_confidence() { confidence.assign(num_pixels(), 0); }
  /// Gives each pixel an empty memory.
  void add_memory() { memory.assign(num_pixels(), {}); }
  /// The memory of a pixel, or null.
  PixelMemory* memory_of(std::size_t pixel) { return memory.empty() ? nullptr : &memory[pixel]; }
};

/// Newest file version that this program reads, and the one that it writes.
inline constexpr std::uint16_t kStateVersion = 1;

/// Deterministic, little-endian; grammar in common/state/FORMAT.md.
Bytes encode_state(const SampleState& state);
/// `name` (usually the file) goes first in every error: wrong magic or version, checksum, sizes
/// that do not agree, weights or Lns that are negative or not finite, weights whose sum is neither
/// 1 nor 0, sites past 15.
Result<SampleState> decode_state(ByteView bytes, const std::string& name);

/// The sections of a state file in file order, after every check that needs no unpacking.
Result<std::vector<SectionInfo>> state_sections(ByteView bytes, const std::string& name);

}  // namespace baton
