#include "common/state/memory_sections.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>

#include "common/base/check.h"

namespace baton {
namespace {

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

Result<Column> column(const SectionFile& file, const SectionTag& tag, std::size_t size_bytes,
                      const std::string& name) {
  BATON_ASSIGN(const ByteView payload, section_payload(file, tag, size_bytes, name));
  return Column{payload.data()};
}

Error wrong_value(const SampleState& state, const SectionTag& tag, std::size_t pixel,
                  const std::string& what, const std::string& name) {
  const Error error = value_error(state, tag, pixel, what);
  return Error{error.kind, fmt::format("{}: section {}", name, error.message)};
}

/// The noises of one kind are upper halves of floats that are finite and not negative.
Status check_noises(const Column& noises, const SectionTag& tag,
                    const std::vector<std::size_t>& pixels, const std::string& name,
                    const SampleState& state) {
  constexpr std::uint16_t kLargest = 0x7F7F;  // upper half of the largest float
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto value = noises.at<std::uint16_t>(i);
    if (value <= kLargest) continue;
    return wrong_value(state, tag, pixels[i],
                       fmt::format("noise {:#06x}, expected 0 to {:#06x}", value, kLargest), name);
  }
  return {};
}

}  // namespace

MemoryPayloads encode_memory(std::span<const PixelMemory> memories,
                             const std::vector<std::size_t>& pixels) {
  ByteWriter summaries, masks, cells, light_noise, lobe_noise;
  for (const std::size_t pixel : pixels) {
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
  return {summaries.take(), masks.take(), cells.take(), light_noise.take(), lobe_noise.take()};
}

Status decode_memory(const SectionFile& file, const std::vector<std::size_t>& pixels,
                     const std::string& name, SampleState& state) {
  if (file.find(kMemorySummary) == nullptr && file.find(kMemoryMasks) == nullptr) return {};

  // Summaries first: they say who has bins, and the masks how many.
  BATON_ASSIGN(const Column summaries,
               column(file, kMemorySummary, pixels.size() * kMemorySummaryStride, name));
  std::size_t num_masks = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const auto outcomes = summaries.at<std::uint16_t>(2 * i + 1);
    if (outcomes > PixelMemory::kSawBoth) {
      return wrong_value(state, kMemorySummary, pixels[i],
                         fmt::format("outcomes {}, expected 0 to 3", outcomes), name);
    }
    num_masks += outcomes == PixelMemory::kSawBoth ? 1 : 0;
  }
  BATON_ASSIGN(const Column masks, column(file, kMemoryMasks, num_masks * sizeof(BinMask), name));
  std::size_t num_cells = 0;
  for (std::size_t i = 0; i < num_masks; ++i)
    num_cells += static_cast<std::size_t>(std::popcount(masks.at<BinMask>(i)));
  BATON_ASSIGN(const Column cells, column(file, kMemoryCells, num_cells * kMemoryCellStride, name));
  const std::size_t noise_bytes = pixels.size() * kMemoryCellStride;
  BATON_ASSIGN(const Column light, column(file, kMemoryLightNoise, noise_bytes, name));
  BATON_TRY(check_noises(light, kMemoryLightNoise, pixels, name, state));
  BATON_ASSIGN(const Column lobes, column(file, kMemoryLobeNoise, noise_bytes, name));
  BATON_TRY(check_noises(lobes, kMemoryLobeNoise, pixels, name, state));

  std::size_t next_mask = 0, next_cell = 0;
  state.add_memory();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    PixelMemory& memory = state.memory[pixels[i]];
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

Error value_error(const SampleState& state, const SectionTag& tag, std::size_t pixel,
                  const std::string& what) {
  const auto width = static_cast<std::size_t>(state.rect.width());
  return {ErrorKind::bad_input,
          fmt::format("{}: pixel ({}, {}): {}", tag_text(tag), state.rect.x0 + pixel % width,
                      state.rect.y0 + pixel / width, what)};
}

}  // namespace baton
