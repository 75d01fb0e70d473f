#include "common/state/memory_plane.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>

namespace baton {
namespace {

/// Of a plane of blocks: which bins there are, and their cells.
struct BlockTags {
  SectionTag masks, cells;
};
constexpr BlockTags kBlockTags[] = {{{'B', 'L', 'K', 'M'}, {'B', 'L', 'K', 'C'}},
                                    {{'C', 'A', 'T', 'M'}, {'C', 'A', 'T', 'C'}}};
constexpr SectionTag kLightNoise{'N', 'O', 'I', 'S'};
constexpr SectionTag kLobeNoise{'N', 'O', 'I', 'L'};
constexpr SectionTag kTallies{'T', 'L', 'L', 'Y'};
constexpr std::size_t kNoiseStride = sizeof(std::uint16_t);
constexpr std::size_t kTallyBytes = sizeof(PixelMemory::rays);

/// Which bins of 64 have seen a ray: bit i is bin i.
using BinMask = std::uint64_t;
constexpr std::size_t kBinsOfMask = 8 * sizeof(BinMask);
constexpr std::size_t kMasksOfBlock = BlockMemory::kCount / kBinsOfMask;

/// The values of a section, one after the other.
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
  BATON_ASSIGN(const Column noises, column(from, tag, from.pixels().size() * kNoiseStride));
  for (std::size_t i = 0; i < from.pixels().size(); ++i) {
    const auto value = noises.at<std::uint16_t>(i);
    if (value <= kLargest) continue;
    return from.wrong_value(tag, from.pixels()[i],
                            fmt::format("noise {:#06x}, expected 0 to {:#06x}", value, kLargest));
  }
  return noises;
}

/// The first pixel of a block of the tile, row by row.
std::size_t first_pixel(const PixelRect& rect, std::size_t block) {
  const PixelRect pixels = PixelBlocks(rect).pixels(block);
  return static_cast<std::size_t>((pixels.y0 - rect.y0) * rect.width() + pixels.x0 - rect.x0);
}

void encode_blocks(std::span<const BlockMemory> memories, const BlockTags& tags, StateWriter& out) {
  ByteWriter masks, cells;
  for (const BlockMemory& memory : memories) {
    for (std::size_t first = 0; first < BlockMemory::kCount; first += kBinsOfMask) {
      std::array<VisibilityCell, kBinsOfMask> seen;
      BinMask mask = 0;
      std::size_t count = 0;
      for (std::size_t i = 0; i < kBinsOfMask; ++i) {  // no branch
        const VisibilityCell cell = memory.cells[first + i];
        seen[count] = cell;
        count += cell.seen != 0 ? 1 : 0;
        mask |= BinMask{cell.seen != 0} << i;
      }
      masks.put(mask);
      cells.put_raw(std::as_bytes(std::span(seen).first(count)));
    }
  }
  out.add(tags.masks, 1, masks.take());
  out.add(tags.cells, sizeof(VisibilityCell), cells.take());
}

Status decode_blocks(const StateReader& from, const BlockTags& tags, const PixelRect& rect,
                     std::span<BlockMemory> memories) {
  const std::size_t num_masks = memories.size() * kMasksOfBlock;
  BATON_ASSIGN(const Column masks, column(from, tags.masks, num_masks * sizeof(BinMask)));
  std::size_t num_cells = 0;
  for (std::size_t i = 0; i < num_masks; ++i)
    num_cells += static_cast<std::size_t>(std::popcount(masks.at<BinMask>(i)));
  BATON_ASSIGN(const Column cells, column(from, tags.cells, num_cells * sizeof(VisibilityCell)));
  std::size_t next_cell = 0;
  for (std::size_t i = 0; i < num_masks; ++i) {
    const std::size_t block = i / kMasksOfBlock, first = i % kMasksOfBlock * kBinsOfMask;
    for (BinMask left = masks.at<BinMask>(i); left != 0; left &= left - 1) {
      const auto cell = cells.at<VisibilityCell>(next_cell++);
      if (cell.seen == 0 || cell.free > cell.seen) {
        return from.wrong_value(tags.cells, first_pixel(rect, block),
                                fmt::format("{} of {} rays are free, expected some, and no more "
                                            "free ones than there are",
                                            cell.free, cell.seen));
      }
      memories[block].cells[first + static_cast<std::size_t>(std::countr_zero(left))] = cell;
    }
  }
  return {};
}

}  // namespace

std::vector<std::size_t> MemoryFormat::pixel_bytes(std::int32_t num_particles,
                                                   std::int32_t num_populations) const {
  std::vector<std::size_t> sizes = SampleFormat::pixel_bytes(num_particles, num_populations);
  sizes.push_back(sizeof(PixelMemory));
  return sizes;
}

std::size_t MemoryFormat::most_stored_block_bytes() const {
  return num_planes() * (kMasksOfBlock * sizeof(BinMask) + sizeof(BlockMemory));
}

std::vector<SectionTag> MemoryFormat::tags() const {
  std::vector<SectionTag> tags = SampleFormat::tags();
  for (std::size_t plane = 0; plane < num_planes(); ++plane)
    tags.insert(tags.end(), {kBlockTags[plane].masks, kBlockTags[plane].cells});
  tags.insert(tags.end(), {kLightNoise, kLobeNoise, kTallies});
  return tags;
}

void MemoryFormat::encode(const SampleState& state, StateWriter& out) const {
  SampleFormat::encode(state, out);
  for (std::size_t plane = 0; plane < num_planes(); ++plane)
    encode_blocks(block_memory_plane(state, plane), kBlockTags[plane], out);
  ByteWriter light_noise, lobe_noise, tallies;
  const std::span<const PixelMemory> memories = pixel_memory_plane(state);
  for (const std::size_t pixel : out.pixels()) {
    const PixelMemory& memory = memories[pixel];
    light_noise.put(memory.light_noise);
    lobe_noise.put(memory.lobe_noise);
    for (const RayTally& rays : memory.rays) {
      tallies.put(rays.expected);
      tallies.put(rays.free);
    }
  }
  out.add(kLightNoise, kNoiseStride, light_noise.take());
  out.add(kLobeNoise, kNoiseStride, lobe_noise.take());
  out.add(kTallies, kNoiseStride, tallies.take());
}

Status MemoryFormat::decode(const StateReader& from, SampleState& state) const {
  BATON_TRY(SampleFormat::decode(from, state));
  for (std::size_t plane = 0; plane < num_planes(); ++plane) {
    BATON_TRY(decode_blocks(from, kBlockTags[plane], state.rect, block_memory_plane(state, plane)));
  }
  BATON_ASSIGN(const Column light, noises_of(from, kLightNoise));
  BATON_ASSIGN(const Column lobes, noises_of(from, kLobeNoise));
  BATON_ASSIGN(const Column counts, column(from, kTallies, from.pixels().size() * kTallyBytes));
  const std::span<PixelMemory> memories = pixel_memory_plane(state);
  for (std::size_t i = 0; i < from.pixels().size(); ++i) {
    PixelMemory& memory = memories[from.pixels()[i]];
    memory.light_noise = light.at<std::uint16_t>(i);
    memory.lobe_noise = lobes.at<std::uint16_t>(i);
    for (std::size_t kind = 0; kind < memory.rays.size(); ++kind) {
      RayTally& rays = memory.rays[kind];
      rays = {counts.at<std::uint16_t>(4 * i + 2 * kind),
              counts.at<std::uint16_t>(4 * i + 2 * kind + 1)};
      if (const std::uint16_t most = std::max(rays.expected, rays.free); most > RayTally::kMost) {
        return from.wrong_value(kTallies, from.pixels()[i],
                                fmt::format("{}, expected at most {}", most, RayTally::kMost));
      }
    }
  }
  return {};
}

void MemoryFormat::inherit_block(std::span<const BlockSource> sources, SampleState& state,
                                 std::size_t block) const {
  for (std::size_t plane = 0; plane < num_planes(); ++plane) {
    std::uint32_t of_all = 0;
    for (const BlockSource& source : sources) {
      if (source.plane == plane) of_all += static_cast<std::uint32_t>(source.num_pixels);
    }
    if (of_all == 0) continue;
    // Fixed point, rounded down: no bin gets more free rays than rays.
    std::array<std::uint32_t, BlockMemory::kCount> seen{}, free{};
    for (const BlockSource& source : sources) {
      if (source.plane != plane) continue;
      const BlockMemory& old = block_memory_plane(*source.state, plane)[source.block];
      const auto share = static_cast<std::uint32_t>(source.num_pixels) * (1u << 15) / of_all;
      for (std::size_t i = 0; i < BlockMemory::kCount; ++i) {
        seen[i] += share * old.cells[i].seen;
        free[i] += share * old.cells[i].free;
      }
    }
    BlockMemory& memory = block_memory_plane(state, plane)[block];
    for (std::size_t i = 0; i < BlockMemory::kCount; ++i) {
      memory.cells[i] = {static_cast<std::uint8_t>(seen[i] >> 16),
                         static_cast<std::uint8_t>(free[i] >> 16)};
    }
  }
}

const MemoryFormat& memory_format(bool has_catchers) {
  static const MemoryFormat plain(false), with_catchers(true);
  return has_catchers ? with_catchers : plain;
}

}  // namespace baton
