#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/section_file.h"
#include "common/state/sample_state.h"

namespace baton {

/// The sections of a state file with what pixels remember (FORMAT.md).
inline constexpr SectionTag kMemorySummary{'V', 'I', 'S', 'S'};
inline constexpr SectionTag kMemoryMasks{'V', 'I', 'S', 'M'};
inline constexpr SectionTag kMemoryCells{'V', 'I', 'S', 'C'};
inline constexpr SectionTag kMemoryLightNoise{'N', 'O', 'I', 'S'};
inline constexpr SectionTag kMemoryLobeNoise{'N', 'O', 'I', 'L'};
/// Sizes of their elements in bytes.
inline constexpr std::size_t kMemoryCellStride = sizeof(VisibilityCell);
inline constexpr std::size_t kMemorySummaryStride = 2 * kMemoryCellStride;

struct MemoryPayloads {
  Bytes summaries, masks, cells, light_noise, lobe_noise;
};

/// Summary and noise of each of `pixels` (0-based, ascending), and the bins of those whose rays
/// have disagreed.
MemoryPayloads encode_memory(std::span<const PixelMemory> memories,
                             const std::vector<std::size_t>& pixels);

/// Inverse of encode_memory. A file without memories leaves the state without them. Errors name
/// file, section and pixel.
Status decode_memory(const SectionFile& file, const std::vector<std::size_t>& pixels,
                     const std::string& name, SampleState& state);

/// "TAG_: pixel (x, y): what", of kind bad_input.
Error value_error(const SampleState& state, const SectionTag& tag, std::size_t pixel,
                  const std::string& what);

}  // namespace baton
