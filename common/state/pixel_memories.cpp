#include "common/state/pixel_memories.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/base/check.h"
#include "common/state/bin_kernels.h"

namespace baton {
namespace {

void fill_bins(const PixelMemories::Packed& from, VisibilityBins& bins) {
  bins.clear();
  VisibilityCell* const all = bins.make();
  const VisibilityCell* next = from.cells.data();
  for (std::size_t word = 0; word < from.mask->size(); ++word) {
    for (std::uint64_t left = (*from.mask)[word]; left != 0; left &= left - 1)
      all[64 * word + static_cast<std::size_t>(std::countr_zero(left))] = *next++;
  }
}

}  // namespace

std::size_t PixelMemories::num_bins(const BinMask& mask) {
  std::size_t count = 0;
  for (const std::uint64_t word : mask) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

void PixelMemories::assign(std::size_t num_pixels) {
  clear();
  open_.resize(num_pixels);
}

PixelMemories PixelMemories::to_packed() const {
  if (is_packed_) return *this;
  // The array of cells is made in one piece, as large as it must be.
  thread_local std::vector<VisibilityCell> cells;
  std::size_t num_cells = 0;
  PixelMemories packed;
  packed.is_packed_ = true;
  const auto with_bins = [](const PixelMemory& memory) { return !memory.bins.empty(); };
  packed.reserve(open_.size(), static_cast<std::size_t>(std::ranges::count_if(open_, with_bins)),
                 0);
  for (const PixelMemory& memory : open_) {
    Entry entry{memory.all_rays, memory.outcomes, memory.light_noise, memory.lobe_noise, 0};
    if (with_bins(memory)) {
      if (cells.size() < num_cells + VisibilityBins::kCount)
        cells.resize(2 * num_cells + VisibilityBins::kCount);
      BinSet& set = packed.sets_.emplace_back(BinMask{}, num_cells);
      num_cells += compress_bins(memory.bins.data(), set.mask, cells.data() + num_cells);
      entry.set = static_cast<std::uint32_t>(packed.sets_.size());
    }
    packed.entries_.push_back(entry);
  }
  packed.cells_.assign(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(num_cells));
  return packed;
}

void PixelMemories::open() {
  if (!is_packed_) return;
  std::vector<PixelMemory> opened(entries_.size());
  for (std::size_t pixel = 0; pixel < opened.size(); ++pixel) copy_to(pixel, opened[pixel]);
  clear();
  open_ = std::move(opened);
}

void PixelMemories::copy_to(std::size_t pixel, PixelMemory& to) const {
  if (!is_packed_) {
    to = open_[pixel];
    return;
  }
  const Packed from = packed(pixel);
  to.all_rays = from.all_rays;
  to.outcomes = from.outcomes;
  to.light_noise = from.light_noise;
  to.lobe_noise = from.lobe_noise;
  if (from.mask != nullptr) {
    fill_bins(from, to.bins);
  } else {
    to.bins = {};
  }
}

PixelMemories::Packed PixelMemories::packed(std::size_t pixel) const {
  BATON_CHECK(is_packed_ && pixel < entries_.size());
  const Entry& entry = entries_[pixel];
  Packed result{entry.all_rays, entry.outcomes, entry.light_noise, entry.lobe_noise, nullptr, {}};
  if (entry.set == 0) return result;
  const BinSet& set = sets_[entry.set - 1];
  const std::size_t end = entry.set < sets_.size() ? sets_[entry.set].first_cell : cells_.size();
  result.mask = &set.mask;
  result.cells = std::span(cells_).subspan(set.first_cell, end - set.first_cell);
  return result;
}

void PixelMemories::add(const Packed& pixel) {
  BATON_CHECK(is_packed_ || open_.empty());
  is_packed_ = true;
  Entry entry{pixel.all_rays, pixel.outcomes, pixel.light_noise, pixel.lobe_noise, 0};
  if (pixel.mask != nullptr) {
    BATON_CHECK(num_bins(*pixel.mask) == pixel.cells.size());
    sets_.push_back({*pixel.mask, cells_.size()});
    cells_.insert(cells_.end(), pixel.cells.begin(), pixel.cells.end());
    entry.set = static_cast<std::uint32_t>(sets_.size());
  }
  entries_.push_back(entry);
}

void PixelMemories::reserve(std::size_t num_pixels, std::size_t num_with_bins,
                            std::size_t num_cells) {
  entries_.reserve(num_pixels);
  sets_.reserve(num_with_bins);
  cells_.reserve(num_cells);
}

std::size_t PixelMemories::size_bytes() const {
  std::size_t bytes = entries_.size() * sizeof(Entry) + sets_.size() * sizeof(BinSet) +
                      cells_.size() * sizeof(VisibilityCell);
  for (const PixelMemory& memory : open_) bytes += sizeof(memory) + memory.bins.size_bytes();
  return bytes;
}

bool PixelMemories::operator==(const PixelMemories& other) const {
  if (!is_packed_ && !other.is_packed_) return open_ == other.open_;
  const PixelMemories a = to_packed(), b = other.to_packed();
  return a.entries_ == b.entries_ && a.sets_ == b.sets_ && a.cells_ == b.cells_;
}

}  // namespace baton
