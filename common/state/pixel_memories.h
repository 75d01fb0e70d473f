#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/state/pixel_memory.h"

namespace baton {

/// What the pixels of a tile remember. *Open*, each has its PixelMemory, and can be changed.
/// *Packed*, as in a file, nothing can be changed, and of its bins each pixel has only those that
/// rays have reached: less than half the size. States that wait for their next frame are packed.
class PixelMemories {
 public:
  /// Which bins are not 0, bit i of word j being bin 64 j + i.
  using BinMask = std::array<std::uint64_t, VisibilityBins::kCount / 64>;
  static std::size_t num_bins(const BinMask& mask);

  /// No pixels: nothing is remembered.
  bool empty() const { return size() == 0; }
  std::size_t size() const { return is_packed_ ? entries_.size() : open_.size(); }
  void clear() { *this = {}; }
  /// So many pixels, open, that remember nothing.
  void assign(std::size_t num_pixels);

  bool is_packed() const { return is_packed_; }
  PixelMemories to_packed() const;
  void pack() {
    if (!is_packed_) *this = to_packed();
  }
  void open();

  /// Of open ones.
  PixelMemory& operator[](std::size_t pixel) { return open_[pixel]; }
  const PixelMemory& operator[](std::size_t pixel) const { return open_[pixel]; }
  /// Of either form.
  void copy_to(std::size_t pixel, PixelMemory& to) const;

  /// What a packed pixel remembers. No cells and no mask: it has no bins.
  struct Packed {
    VisibilityCell all_rays = 0;
    std::uint16_t outcomes = 0, light_noise = 0, lobe_noise = 0;
    const BinMask* mask = nullptr;
    std::span<const VisibilityCell> cells;  ///< one for each bit of the mask
  };
  Packed packed(std::size_t pixel) const;
  /// Adds a packed pixel to packed ones, or to none. Its mask has as many bits as it has cells.
  void add(const Packed& pixel);
  /// Makes room for what is added.
  void reserve(std::size_t num_pixels, std::size_t num_with_bins, std::size_t num_cells);

  /// What all of it takes in memory.
  std::size_t size_bytes() const;
  /// Whether they remember the same, in whatever form.
  bool operator==(const PixelMemories& other) const;

 private:
  struct Entry {
    VisibilityCell all_rays = 0;
    std::uint16_t outcomes = 0, light_noise = 0, lobe_noise = 0;
    std::uint32_t set = 0;  ///< of sets_, from 1; 0: it has no bins
    bool operator==(const Entry&) const = default;
  };
  /// The bins of a pixel.
  struct BinSet {
    BinMask mask{};
    std::size_t first_cell = 0;
    bool operator==(const BinSet&) const = default;
  };

  std::vector<PixelMemory> open_;

  bool is_packed_ = false;
  std::vector<Entry> entries_;
  std::vector<BinSet> sets_;
  std::vector<VisibilityCell> cells_;
};

}  // namespace baton
