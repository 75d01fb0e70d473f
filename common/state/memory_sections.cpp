#include "common/state/memory_sections.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>

#include "common/base/check.h"

namespace baton {
namespace {

/// Which bins are not 0, bit i of word j being bin 64 j + i, and those that are not.
using BinMask = std::array<std::uint64_t, VisibilityBins::kCount / 64>;

void put_bins(const VisibilityBins& bins, ByteWriter& masks, ByteWriter& cells) {
  BATON_CHECK(!bins.empty());
  BinMask mask{};
  std::array<VisibilityCell, VisibilityBins::kCount> set;
  std::size_t count = 0;
  constexpr std::size_t kAtOnce = sizeof(std::uint64_t) / sizeof(VisibilityCell);
  for (std::size_t first = 0; first < VisibilityBins::kCount; first += kAtOnce) {
    std::uint64_t some = 0;  // most are
    std::memcpy(&some, bins.data() + first, sizeof(some));
    if (some == 0) continue;
    for (std::size_t bin = first; bin < first + kAtOnce; ++bin) {
      const bool is_set = bins.data()[bin] != 0;
      set[count] = bins.data()[bin];
      count += is_set ? 1 : 0;
      mask[bin / 64] |= std::uint64_t{is_set} << bin % 64;
    }
  }
  masks.put_raw(std::as_bytes(std::span(mask)));
  cells.put_raw(std::as_bytes(std::span(set).first(count)));
}

/// The bins of `pixels`.
Status decode_bins(const SectionFile& file, const std::vector<std::size_t>& pixels,
                   const std::string& name, SampleState& state) {
  BATON_ASSIGN(const ByteView masks,
               section_payload(file, kMemoryMasks, pixels.size() * sizeof(BinMask), name));
  std::size_t num_cells = 0;
  const auto mask_of = [&](std::size_t i) {
    BinMask mask;
    std::memcpy(&mask, masks.data() + i * sizeof(mask), sizeof(mask));
    return mask;
  };
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (const std::uint64_t word : mask_of(i))
      num_cells += static_cast<std::size_t>(std::popcount(word));
  }
  BATON_ASSIGN(const ByteView cells,
               section_payload(file, kMemoryCells, num_cells * kMemoryCellStride, name));
  const std::byte* next = cells.data();
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    VisibilityCell* const bins = state.memory[pixels[i]].bins.make();
    const BinMask mask = mask_of(i);
    for (std::size_t j = 0; j < mask.size(); ++j) {
      for (std::uint64_t left = mask[j]; left != 0; left &= left - 1) {
        const auto bin = 64 * j + static_cast<std::size_t>(std::countr_zero(left));
        std::memcpy(bins + bin, next, kMemoryCellStride);
        next += kMemoryCellStride;
      }
    }
  }
  return {};
}

/// A noise of all memories.
Status decode_noise(const SectionFile& file, const SectionTag& tag,
                    std::uint16_t PixelMemory::*noise, const std::vector<std::size_t>& pixels,
                    const std::string& name, SampleState& state) {
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
  ByteWriter summaries, masks, cells, light_noise, lobe_noise;
  for (const std::size_t pixel : pixels) {
    const PixelMemory& memory = state.memory[pixel];
    summaries.put(memory.all_rays);
    summaries.put(memory.outcomes);
    light_noise.put(memory.light_noise);
    lobe_noise.put(memory.lobe_noise);
    if (memory.outcomes == PixelMemory::kSawBoth) {
      put_bins(memory.bins, masks, cells);
    }
  }
  return {summaries.take(), masks.take(), cells.take(), light_noise.take(), lobe_noise.take()};
}

Status decode_memory(const SectionFile& file, const std::vector<std::size_t>& pixels,
                     const std::string& name, SampleState& state) {
  if (file.find(kMemorySummary) == nullptr && file.find(kMemoryMasks) == nullptr) return {};
  BATON_ASSIGN(const ByteView summaries,
               section_payload(file, kMemorySummary, pixels.size() * kMemorySummaryStride, name));
  state.add_memory();

  // Summaries first: they say who has bins.
  std::vector<std::size_t> with_bins;
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
    if (memory.outcomes == PixelMemory::kSawBoth) with_bins.push_back(pixels[i]);
  }
  BATON_TRY(decode_bins(file, with_bins, name, state));
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
