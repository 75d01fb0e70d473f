#include "common/state/pixel_memory.h"

#include <fmt/format.h>

#include <cstring>
#include <span>

#include "common/base/check.h"

namespace baton {
namespace {

/// A memory's bins come first; the two cells after them are its summary, the last are the noise.
constexpr std::size_t kMemoryBins = kMemoryCells - 4;
constexpr std::size_t kMemoryOutcomes = kMemoryBins + 1;
constexpr std::size_t kLightNoiseCell = kMemoryBins + 2, kLobeNoiseCell = kMemoryBins + 3;
constexpr std::size_t kSummaryCells = kMemorySummaryStride / sizeof(MemoryCell);
constexpr MemoryCell kSawBoth = 3;

/// A cell of noise of all memories; a file from before it was kept leaves it unknown.
Status decode_noise(const SectionFile& file, const SectionTag& tag, std::size_t cell,
                    const std::vector<std::size_t>& pixels, const std::string& name,
                    SampleState& state) {
  if (file.find(tag) == nullptr) return {};
  constexpr MemoryCell kLargest = 0x7F7F;  // upper half of the largest float
  BATON_ASSIGN(const ByteView payload,
               section_payload(file, tag, pixels.size() * sizeof(MemoryCell), name));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    MemoryCell& noise = state.memory_of(pixels[i])[cell];
    std::memcpy(&noise, payload.data() + i * sizeof(MemoryCell), sizeof(MemoryCell));
    if (noise <= kLargest) continue;
    const Error error =
        value_error(state, tag, pixels[i],
                    fmt::format("noise {:#06x}, expected 0 to {:#06x}", noise, kLargest));
    return Error{error.kind, fmt::format("{}: section {}", name, error.message)};
  }
  return {};
}

}  // namespace

MemoryPayloads encode_memory(const SampleState& state, const std::vector<std::size_t>& pixels) {
  BATON_CHECK(!state.memory.empty());
  ByteWriter summaries, grids, light_noise, lobe_noise;
  for (const std::size_t pixel : pixels) {
    const auto cells = std::span(state.memory).subspan(pixel * kMemoryCells, kMemoryCells);
    summaries.put_raw(std::as_bytes(cells.subspan(kMemoryBins, kSummaryCells)));
    light_noise.put_raw(std::as_bytes(cells.subspan(kLightNoiseCell, 1)));
    lobe_noise.put_raw(std::as_bytes(cells.subspan(kLobeNoiseCell, 1)));
    if (cells[kMemoryOutcomes] == kSawBoth) grids.put_raw(std::as_bytes(cells.first(kMemoryBins)));
  }
  return {summaries.take(), grids.take(), light_noise.take(), lobe_noise.take()};
}

Status decode_memory(const SectionFile& file, const std::vector<std::size_t>& pixels,
                     const std::string& name, SampleState& state) {
  if (file.find(kMemorySummary) == nullptr && file.find(kMemoryGrid) == nullptr) return {};
  constexpr std::size_t kGridBytes = kMemoryBins * sizeof(MemoryCell);
  BATON_ASSIGN(const ByteView summaries,
               section_payload(file, kMemorySummary, pixels.size() * kMemorySummaryStride, name));
  state.add_memory();

  // Summaries first: they say how many grids there are.
  std::vector<std::size_t> with_grid;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::span<MemoryCell> cells = state.memory_of(pixels[i]);
    std::memcpy(cells.data() + kMemoryBins, summaries.data() + i * kMemorySummaryStride,
                kMemorySummaryStride);
    if (cells[kMemoryOutcomes] > kSawBoth) {
      const Error error =
          value_error(state, kMemorySummary, pixels[i],
                      fmt::format("outcomes {}, expected 0 to 3", cells[kMemoryOutcomes]));
      return Error{error.kind, fmt::format("{}: section {}", name, error.message)};
    }
    if (cells[kMemoryOutcomes] == kSawBoth) with_grid.push_back(pixels[i]);
  }
  BATON_ASSIGN(const ByteView grids,
               section_payload(file, kMemoryGrid, with_grid.size() * kGridBytes, name));
  for (std::size_t i = 0; i < with_grid.size(); ++i) {
    std::memcpy(state.memory_of(with_grid[i]).data(), grids.data() + i * kGridBytes, kGridBytes);
  }
  BATON_TRY(decode_noise(file, kMemoryLightNoise, kLightNoiseCell, pixels, name, state));
  return decode_noise(file, kMemoryLobeNoise, kLobeNoiseCell, pixels, name, state);
}

Error value_error(const SampleState& state, const SectionTag& tag, std::size_t pixel,
                  const std::string& what) {
  const auto width = static_cast<std::size_t>(state.rect.width());
  return {ErrorKind::bad_input,
          fmt::format("{}: pixel ({}, {}): {}", tag_text(tag), state.rect.x0 + pixel % width,
                      state.rect.y0 + pixel / width, what)};
}

}  // namespace baton
