#pragma once

#include <span>

#include "common/state/pixel_memory.h"
#include "common/state/sample_planes.h"

namespace baton {

/// What pixels remember of their rays and light, beside Lns and, if any, samples. In a file a pixel
/// has its summary and noise, and the bins if its rays have disagreed.
class MemoryFormat final : public SampleFormat {
 public:
  std::int32_t fewest_particles() const override { return 0; }
  std::vector<std::size_t> pixel_bytes(std::int32_t num_particles,
                                       std::int32_t num_populations) const override;
  std::size_t most_stored_bytes(std::int32_t num_particles,
                                std::int32_t num_populations) const override;
  std::vector<SectionTag> tags() const override;
  void encode(const SampleState& state, StateWriter& out) const override;
  Status decode(const StateReader& from, SampleState& state) const override;
};
const MemoryFormat& memory_format();

/// (pixels) of a state of memory_format().
inline std::span<PixelMemory> memory_plane(SampleState& state) {
  return state.planes[SampleFormat::kNumPlanes].values<PixelMemory>();
}
inline std::span<const PixelMemory> memory_plane(const SampleState& state) {
  return state.planes[SampleFormat::kNumPlanes].values<PixelMemory>();
}

}  // namespace baton
