#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/base/section_file.h"
#include "common/job/time.h"
#include "common/math/pixel_blocks.h"
#include "common/math/pixel_rect.h"

namespace baton {

class StateFormat;

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
inline constexpr std::size_t kNumPixelSources = 6;

/// One kind of values that the pixels of a tile carry, or its blocks (common/math/pixel_blocks.h),
/// as many bytes for each, one after the other. What they mean its StateFormat says.
struct StatePlane {
  std::size_t each_bytes = 0;
  std::vector<std::byte> bytes;  ///< (pixels) or (blocks) of each_bytes

  /// All values; T: trivially copyable, aligned as `new` aligns at most.
  template <class T>
  std::span<T> values() {
    return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  template <class T>
  std::span<const T> values() const {
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  bool operator==(const StatePlane&) const = default;
};

/// The baton: what one tile hands to its next frame. A header, which everybody reads, and planes,
/// which only the method that made them reads (sample_planes.h and memory_plane.h have those of
/// our methods). Pixels row by row inside `rect`. The surfaces are not stored: primary hits are a
/// pure function of (job, frame, pixel, site) and are traced again. A background pixel carries
/// nothing of its own: every value is 0 there, and the file leaves it out.
struct SampleState {
  Digest picture;  ///< picture_digest of the job
  Step step{};     ///< the samples are of this step
  std::int32_t tile = 0;
  PixelRect rect;
  /// N: particles of all populations; 0 where none are carried.
  std::int32_t num_particles = 0;
  /// K: parts that never exchange anything; part k has particles [k N / K, (k + 1) N / K).
  std::int32_t num_populations = 1;
  std::vector<PixelSource> source;  ///< (pixels, K)

  const StateFormat* format = nullptr;
  /// Of the pixels, as StateFormat::pixel_bytes lists them.
  std::vector<StatePlane> planes;
  /// Of the blocks, as StateFormat::block_bytes lists them.
  std::vector<StatePlane> block_planes;

  bool operator==(const SampleState&) const = default;
  std::size_t num_pixels() const { return static_cast<std::size_t>(rect.area()); }
  /// Blocks that have pixels in `rect`.
  std::size_t num_blocks() const { return PixelBlocks(rect).count(); }
  /// Makes planes of that format, all zero, and forgets those that are there. new_num_populations
  /// divides new_num_particles.
  void resize(const StateFormat& new_format, const PixelRect& new_rect,
              std::int32_t new_num_particles, std::int32_t new_num_populations = 1);
  /// What source and planes take in memory.
  std::size_t size_bytes() const;

  /// Copies all that `count` pixels from `first_from` on carry, but for their sources. from: of the
  /// same format, N and K.
  void copy_pixels(const SampleState& from, std::size_t first_from, std::size_t first,
                   std::size_t count);
  /// Copies all that block `block_from` of `from` carries.
  void copy_block(const SampleState& from, std::size_t block_from, std::size_t block);
  /// Lets a pixel carry nothing, all zero.
  void forget_pixel(std::size_t pixel);
  /// Lets a block carry nothing, all zero.
  void forget_block(std::size_t block);
  void set_source(std::size_t pixel, PixelSource new_source);
  /// What the pixel's populations say together.
  PixelSource latest_source(std::size_t pixel) const;
};

/// Newest file version that this program reads, and the one that it writes.
inline constexpr std::uint16_t kStateVersion = 1;

/// Deterministic, little-endian; grammar in common/state/FORMAT.md.
Bytes encode_state(const SampleState& state);
/// `name` (usually the file) goes first in every error: wrong magic or version, checksum, sizes
/// that do not agree, values that the format refuses, sections that it does not know or lacks.
Result<SampleState> decode_state(ByteView bytes, const std::string& name,
                                 const StateFormat& format);
/// The same of a file of any of our methods.
Result<SampleState> decode_state(ByteView bytes, const std::string& name);

/// The sections of a state file in file order, after every check that needs no unpacking.
Result<std::vector<SectionInfo>> state_sections(ByteView bytes, const std::string& name);

}  // namespace baton
