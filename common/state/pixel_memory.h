#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace baton {

/// The share of free rays in 1/4095 (high 12 bits) and the rays seen, up to 15 (low 4 bits).
using VisibilityCell = std::uint16_t;

/// How visible the light was in each bin of the octahedral lattice of directions
/// (common/math/octahedral.h), row by row: the upper four bits of each half of a code. The cells
/// are allocated by the first make().
class VisibilityBins {
 public:
  static constexpr std::size_t kSide = 16, kCount = kSide * kSide;

  VisibilityBins() = default;
  VisibilityBins(const VisibilityBins& other)
      : cells_(other.cells_ ? std::make_unique<Cells>(*other.cells_) : nullptr) {}
  VisibilityBins(VisibilityBins&&) noexcept = default;
  VisibilityBins& operator=(const VisibilityBins& other) {
    if (this != &other) *this = VisibilityBins(other);
    return *this;
  }
  VisibilityBins& operator=(VisibilityBins&&) noexcept = default;
  ~VisibilityBins() = default;
  bool operator==(const VisibilityBins& other) const {
    return empty() || other.empty() ? empty() == other.empty() : *cells_ == *other.cells_;
  }

  bool empty() const { return cells_ == nullptr; }
  /// kCount cells and one of padding: kernels load two at once. Null: empty.
  const VisibilityCell* data() const { return cells_ ? cells_->data() : nullptr; }
  /// The cells, allocated with 0 by the first call.
  VisibilityCell* make() {
    if (!cells_) cells_ = std::make_unique<Cells>();
    return cells_->data();
  }
  /// All 0, if there are any.
  void clear() {
    if (cells_) cells_->fill(0);
  }
  /// What the cells take.
  std::size_t size_bytes() const { return cells_ ? sizeof(Cells) : 0; }

 private:
  using Cells = std::array<VisibilityCell, kCount + 1>;
  std::unique_ptr<Cells> cells_;
};

/// What a pixel of `pool` remembers of the frames before: how visible the light was, and how noisy.
/// An estimate: who uses it must be unbiased whatever its contents are, and may only use what
/// the frames before left. All 0: nothing is known.
struct PixelMemory {
  static constexpr std::uint16_t kSawFree = 1, kSawBlocked = 2, kSawBoth = 3;
  /// In a file before packing, at most: a bit for each bin, all of them, and what is below.
  static constexpr std::size_t kMaxStoredBytes =
      VisibilityBins::kCount / 8 + (VisibilityBins::kCount + 4) * sizeof(VisibilityCell);

  VisibilityBins bins;  ///< not empty exactly where both outcomes were seen: most pixels need none
  VisibilityCell all_rays = 0;
  std::uint16_t outcomes = 0;  ///< that were ever seen: kSawFree, kSawBlocked
  /// The variance of its unshadowed light by candidates of either kind, the upper half of a float
  /// (worker/sampling/light_noise.h).
  std::uint16_t light_noise = 0, lobe_noise = 0;

  bool operator==(const PixelMemory&) const = default;
};
static_assert(sizeof(PixelMemory) == 16);

}  // namespace baton
