#include "common/state/memory_sections.h"

#include <fmt/format.h>

#include <cstring>

#include "common/base/check.h"

namespace baton {
namespace {

/// A noise of all memories; a file from before it was kept leaves it unknown.
Status decode_noise(const SectionFile& file, const SectionTag& tag,
                    std::uint16_t PixelMemory::*noise, const std::vector<std::size_t>& pixels,
                    const std::string& name, SampleState& state) {
  if (file.find(tag) == nullptr) return {};
  constexpr std::uint16_t kLargest = 0x7F7F;  // upper half of the largest float
  BATON_ASSIGN(const ByteView payload,
               section_payload(file, tag, pixels.size() * kMemoryCellStride, name));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    std::uint16_t& value = state.memory[pixels[i]].*noise;
    std::memcpy(&value, payload.data() + i * kMemoryCellStride, kMemoryCellStride);
    if (value <= kLargest) continue;
    const Error error =
        value_error(state, tag, pixels[i],
                    fmt::format("noise {:#06x}, expected 0 to {:#06x}", value, kLargest));
    return Error{error.kind, fmt::format("{}: section {}", name, error.message)};
  }
  return {};
}

}  // namespace

MemoryPayloads encode_memory(const SampleState& state, const std::vector<std::size_t>& pixels) {
  BATON_CHECK(!state.memory.empty());
  ByteWriter summaries, grids, light_noise, lobe_noise;
  for (const std::size_t pixel : pixels) {
    const PixelMemory& memory = state.memory[pixel];
    summaries.put(memory.all_rays);
    summaries.put(memory.outcomes);
    light_noise.put(memory.light_noise);
    lobe_noise.put(memory.lobe_noise);
    if (memory.outcomes == PixelMemory::kSawBoth) {
      grids.put_raw(std::as_bytes(std::span(memory.bins)));
    }
  }
  return {summaries.take(), grids.take(), light_noise.take(), lobe_noise.take()};
}

Status decode_memory(const SectionFile& file, const std::vector<std::size_t>& pixels,
                     const std::string& name, SampleState& state) {
  if (file.find(kMemorySummary) == nullptr && file.find(kMemoryGrid) == nullptr) return {};
  BATON_ASSIGN(const ByteView summaries,
               section_payload(file, kMemorySummary, pixels.size() * kMemorySummaryStride, name));
  state.add_memory();

  // Summaries first: they say how many grids there are.
  std::vector<std::size_t> with_grid;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    PixelMemory& memory = state.memory[pixels[i]];
    const std::byte* summary = summaries.data() + i * kMemorySummaryStride;
    std::memcpy(&memory.all_rays, summary, kMemoryCellStride);
    std::memcpy(&memory.outcomes, summary + kMemoryCellStride, kMemoryCellStride);
    if (memory.outcomes > PixelMemory::kSawBoth) {
      const Error error = value_error(state, kMemorySummary, pixels[i],
                                      fmt::format("outcomes {}, expected 0 to 3", memory.outcomes));
      return Error{error.kind, fmt::format("{}: section {}", name, error.message)};
    }
    if (memory.outcomes == PixelMemory::kSawBoth) with_grid.push_back(pixels[i]);
  }
  constexpr std::size_t kGridBytes = sizeof(PixelMemory::bins);
  BATON_ASSIGN(const ByteView grids,
               section_payload(file, kMemoryGrid, with_grid.size() * kGridBytes, name));
  for (std::size_t i = 0; i < with_grid.size(); ++i) {
    std::memcpy(state.memory[with_grid[i]].bins.data(), grids.data() + i * kGridBytes, kGridBytes);
  }
  BATON_TRY(decode_noise(file, kMemoryLightNoise, &PixelMemory::light_noise, pixels, name, state));
  return decode_noise(file, kMemoryLobeNoise, &PixelMemory::lobe_noise, pixels, name, state);
}

Error value_error(const SampleState& state, const SectionTag& tag, std::size_t pixel,
                  const std::string& what) {
  const auto width = static_cast<std::size_t>(state.rect.width());
  return {ErrorKind::bad_input,
          fmt::format("{}: pixel ({}, {}): {}", tag_text(tag), state.rect.x0 + pixel % width,
                      state.rect.y0 + pixel / width, what)};
}

}  // namespace baton
