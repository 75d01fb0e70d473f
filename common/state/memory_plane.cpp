#include "common/state/memory_plane.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>

namespace baton {
namespace {

constexpr SectionTag kSummary{'V', 'I', 'S', 'S'};
constexpr SectionTag kMasks{'V', 'I', 'S', 'M'};
constexpr SectionTag kCells{'V', 'I', 'S', 'C'};
constexpr SectionTag kLightNoise{'N', 'O', 'I', 'S'};
constexpr SectionTag kLobeNoise{'N', 'O', 'I', 'L'};
/// Sizes of their elements in bytes.
constexpr std::size_t kCellStride = sizeof(VisibilityCell);
constexpr std::size_t kSummaryStride = 2 * kCellStride;

/// Which bins are not 0: bit i is bin i.
using BinMask = std::uint64_t;
static_assert(8 * sizeof(BinMask) == VisibilityBins::kCount);

/// The cells of a value for each pixel.
struct Column {
  const std::byte* data = nullptr;
  template <class T>
  T at(std::size_t i) const {
    T value;
    std::memcpy(&value, data + i * sizeof(T), sizeof(T));
    return value;
  }
};

Result<Column> column(const StateReader& from, const SectionTag& tag, std::size_t size_bytes) {
  BATON_ASSIGN(const ByteView payload, from.payload(tag, size_bytes));
  return Column{payload.data()};
}

/// The noises of one kind are upper halves of floats that are finite and not negative.
Result<Column> noises_of(const StateReader& from, const SectionTag& tag) {
  constexpr std::uint16_t kLargest = 0x7F7F;  // upper half of the largest float
  BATON_ASSIGN(const Column noises, column(from, tag, from.pixels().size() * kCellStride));
  for (std::size_t i = 0; i < from.pixels().size(); ++i) {
    const auto value = noises.at<std::uint16_t>(i);
    if (value <= kLargest) continue;
    return from.wrong_value(tag, from.pixels()[i],
                            fmt::format("noise {:#06x}, expected 0 to {:#06x}", value, kLargest));
  }
  return noises;
}

}  // namespace

std::vector<std::size_t> MemoryFormat::pixel_bytes(std::int32_t num_particles,
                                                   std::int32_t num_populations) const {
  std::vector<std::size_t> sizes = SampleFormat::pixel_bytes(num_particles, num_populations);
  sizes.push_back(sizeof(PixelMemory));
  return sizes;
}

std::size_t MemoryFormat::most_stored_bytes(std::int32_t num_particles,
                                            std::int32_t num_populations) const {
  return SampleFormat::most_stored_bytes(num_particles, num_populations) - sizeof(PixelMemory) +
         PixelMemory::kMaxStoredBytes;
}

std::vector<SectionTag> MemoryFormat::tags() const {
  std::vector<SectionTag> tags = SampleFormat::tags();
  tags.insert(tags.end(), {kSummary, kMasks, kCells, kLightNoise, kLobeNoise});
  return tags;
}

void MemoryFormat::encode(const SampleState& state, StateWriter& out) const {
  SampleFormat::encode(state, out);
  const std::span<const PixelMemory> memories = memory_plane(state);
  ByteWriter summaries, masks, cells, light_noise, lobe_noise;
  for (const std::size_t pixel : out.pixels()) {
    const PixelMemory& memory = memories[pixel];
    summaries.put(memory.all_rays);
    summaries.put(memory.outcomes);
    light_noise.put(memory.light_noise);
    lobe_noise.put(memory.lobe_noise);
    if (!memory.has_bins()) continue;
    BinMask mask = 0;
    VisibilityBins reached;
    std::size_t count = 0;
    for (std::size_t bin = 0; bin < VisibilityBins::kCount; ++bin) {  // no branch
      const VisibilityCell cell = memory.bins.cells[bin];
      reached.cells[count] = cell;
      count += cell != 0 ? 1 : 0;
      mask |= BinMask{cell != 0} << bin;
    }
    masks.put(mask);
    cells.put_raw(std::as_bytes(std::span(reached.cells).first(count)));
  }
  out.add(kSummary, kSummaryStride, summaries.take());
  out.add(kMasks, 1, masks.take());
  out.add(kCells, kCellStride, cells.take());
  out.keep_plain();
  out.add(kLightNoise, kCellStride, light_noise.take());
  out.add(kLobeNoise, kCellStride, lobe_noise.take());
}

Status MemoryFormat::decode(const StateReader& from, SampleState& state) const {
  BATON_TRY(SampleFormat::decode(from, state));
  const std::vector<std::size_t>& pixels = from.pixels();

  // Summaries first: they say who has bins, and the masks how many.
  BATON_ASSIGN(const Column summaries, column(from, kSummary, pixels.size() * kSummaryStride));
  std::size_t num_masks = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto outcomes = summaries.at<std::uint16_t>(2 * i + 1);
    if (outcomes > PixelMemory::kSawBoth) {
      return from.wrong_value(kSummary, pixels[i],
                              fmt::format("outcomes {}, expected 0 to 3", outcomes));
    }
    num_masks += outcomes == PixelMemory::kSawBoth ? 1 : 0;
  }
  BATON_ASSIGN(const Column masks, column(from, kMasks, num_masks * sizeof(BinMask)));
  std::size_t num_cells = 0;
  for (std::size_t i = 0; i < num_masks; ++i)
    num_cells += static_cast<std::size_t>(std::popcount(masks.at<BinMask>(i)));
  BATON_ASSIGN(const Column cells, column(from, kCells, num_cells * kCellStride));
  BATON_ASSIGN(const Column light, noises_of(from, kLightNoise));
  BATON_ASSIGN(const Column lobes, noises_of(from, kLobeNoise));

  std::size_t next_mask = 0, next_cell = 0;
  const std::span<PixelMemory> memories = memory_plane(state);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    PixelMemory& memory = memories[pixels[i]];
    memory.all_rays = summaries.at<VisibilityCell>(2 * i);
    memory.outcomes = summaries.at<std::uint16_t>(2 * i + 1);
    memory.light_noise = light.at<std::uint16_t>(i);
    memory.lobe_noise = lobes.at<std::uint16_t>(i);
    if (!memory.has_bins()) continue;
    for (BinMask left = masks.at<BinMask>(next_mask++); left != 0; left &= left - 1) {
      memory.bins.cells[static_cast<std::size_t>(std::countr_zero(left))] =
          cells.at<VisibilityCell>(next_cell++);
    }
  }
  return {};
}

const MemoryFormat& memory_format() {
  static const MemoryFormat format;
  return format;
}

}  // namespace baton
