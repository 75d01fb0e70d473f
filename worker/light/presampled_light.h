#pragma once

#include <cstdint>
#include <vector>

#include "common/base/team.h"
#include "common/math/octahedral.h"
#include "common/math/philox.h"
#include "worker/surface/environment_view.h"

namespace baton {

/// Directions drawn from a frame's environment before its pixels are rendered; pixels pick
/// candidates and proposals from it. A stretch of an Owen-scrambled Sobol' sequence through the
/// map's sampling table. Each entry's direction has density `density`, so a pixel that chooses
/// entries independently of their contents stays unbiased; pixels that choose the same entries have
/// correlated errors.
///
/// Every aligned stretch of `run_blocks` blocks is a net of the sequence, laid out along a Hilbert
/// curve over the lattice of directions. Each place in a block stands for an eighth of the curve,
/// which the blocks of the stretch follow in order; neighbouring places stand for distant eighths,
/// as in the van der Corput sequence, so that half a block still covers the map. A systematic
/// choice (systematic-inl.h) goes through the places in the order of their eighths: it takes
/// directions that are spread over the light, and so its shadow rays are stratified. In each
/// stretch place 0 is another eighth, so that one who takes the same place of random blocks sees
/// the whole map.
struct PresampledLight {
  /// Number of entries: few enough to stay in a core's cache.
  static constexpr std::uint32_t kSize = 1u << 13;
  static constexpr std::uint32_t kBlock = 8;  ///< entries that lie together in memory

  /// Which eighth of the curve each place in the blocks of the first stretch stands for; its own
  /// inverse.
  static constexpr std::uint32_t kEighthOf[kBlock] = {0, 4, 2, 6, 1, 5, 3, 7};

  static constexpr std::uint32_t kNumBlocks = kSize / kBlock;
  /// Most blocks of a stretch, but where all are one: there are stretches for each eighth of the
  /// curve.
  static constexpr std::uint32_t kMaxRunBlocks = kNumBlocks / kBlock;

  /// Eight entries, field by field: the unit of SIMD loads.
  struct alignas(64) Block {
    OctDirection code[kBlock];              ///< on the lattice of carried directions
    float x[kBlock], y[kBlock], z[kBlock];  ///< the decoded directions
    float r[kBlock], g[kBlock], b[kBlock];  ///< radiance of this frame
    float density[kBlock];                  ///< 1/sr
    float inverse_density[kBlock];          ///< sr; 0 where the density is
  };
  /// Radiance of the same entries in the frame before.
  struct alignas(32) Before {
    float r[kBlock], g[kBlock], b[kBlock];
  };
  std::vector<Block> blocks;  ///< (kNumBlocks); empty for a black map
  /// (kNumBlocks), where the layout asks for it; else empty.
  std::vector<Before> before;
  std::uint32_t run_blocks = 1;  ///< a power of two
  /// Mean of the environment over the sphere, grey; by the entries.
  float mean_radiance = 0;

  bool empty() const { return blocks.empty(); }
  std::size_t size_bytes() const {
    return blocks.size() * sizeof(Block) + before.size() * sizeof(Before);
  }
};

/// The presampled light of a frame and round in one or several sets, of which a pixel reads one.
/// Pixels of a set err together; in an image with many sets their errors average out. The sets are
/// stretches of one Sobol' sequence: each is a net, and so are all together, which takes the error
/// of the mean over the sets down faster than independent ones would. Which set a pixel reads
/// depends on where it is in the image alone, and not on what the sets contain: no bias.
struct PresampledSets {
  /// Side of the squares of pixels that read one set: they do it one after the other, while it is
  /// in the cache.
  static constexpr std::int32_t kSquare = 32;

  std::vector<PresampledLight> sets;

  /// The set of pixel (x, y). The squares of a larger square with as many squares as there are sets
  /// read all of them, each larger square in another order.
  const PresampledLight& of(std::int32_t x, std::int32_t y) const;
  std::size_t size_bytes() const {
    std::size_t sum = 0;
    for (const PresampledLight& set : sets) sum += set.size_bytes();
    return sum;
  }
};

/// Number of sets, a power of two: one for so many pixels of the image, and most of all rounds of a
/// frame together, as all of them are kept.
inline constexpr std::int64_t kPixelsOfSet = 1 << 15;
inline constexpr std::int32_t kMostSetsOfFrame = 64;
std::int32_t num_presampled_sets(std::int64_t num_pixels, std::int32_t rounds);

/// How presampled light is laid out.
struct PresampledLightLayout {
  /// Entries that most pixels take: a stretch has so many, rounded up to a power of two.
  std::uint32_t num_taken = 64;
  /// All entries are one stretch: best where pixels differ in how many they take.
  bool one_run = false;
  /// For moves of carried samples, which are compared with the light of the frame before.
  bool with_before = false;
};

/// The presampled light of one frame and round, in num_sets sets, of which each is a part.
/// Arguments as below.
PresampledSets presample_sets(const Environment& now, const Environment& before,
                              std::uint64_t job_seed, std::uint32_t frame,
                              const PresampledLightLayout& layout, std::int32_t round,
                              std::int32_t num_sets, const DoParts& do_parts = do_in_turn);

/// One set of the presampled light of one frame. before: the environment of the frame before (the
/// same as `now` for the first frame). round: each has other directions. set: its number.
PresampledLight presample_light(const Environment& now, const Environment& before,
                                std::uint64_t job_seed, std::uint32_t frame,
                                const PresampledLightLayout& layout = {}, std::int32_t round = 0,
                                std::uint32_t set = 0);

}  // namespace baton
