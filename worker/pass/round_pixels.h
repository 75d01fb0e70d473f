#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace baton {

/// The pixels of a tile that take part in a round of a frame. Those that do have numbers from 0 on,
/// their *slots*.
class RoundPixels {
 public:
  /// All of them, each with the weight of one round.
  static RoundPixels all(std::size_t num_pixels) { return RoundPixels(num_pixels); }
  /// None so far.
  RoundPixels() = default;

  /// Adds a pixel, in the order in which they are worked on. index: row by row in the tile. weight:
  /// rounds that it stands for, > 0.
  void add(std::size_t index, double weight) {
    index_.push_back(static_cast<std::uint32_t>(index));
    weight_.push_back(weight);
    ++size_;
  }

  std::size_t size() const { return size_; }
  bool are_all(std::size_t num_pixels) const { return index_.empty() && size_ == num_pixels; }
  /// Index of the pixel in a slot, row by row in the tile.
  std::size_t index(std::size_t slot) const { return index_.empty() ? slot : index_[slot]; }
  /// Rounds that it stands for.
  double weight(std::size_t slot) const { return weight_.empty() ? 1 : weight_[slot]; }

 private:
  explicit RoundPixels(std::size_t num_pixels) : size_(num_pixels) {}

  std::size_t size_ = 0;
  std::vector<std::uint32_t> index_;  ///< (size), or empty: all in turn
  std::vector<double> weight_;        ///< (size), or empty: 1
};

}  // namespace baton
