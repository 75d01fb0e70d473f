#pragma once

#include <span>

#include "common/state/block_memory.h"
#include "common/state/sample_planes.h"

namespace baton {

/// What blocks of pixels remember of their rays, and pixels of theirs and of the noise of their
/// light, beside Lns and, if any, samples. In a file a block has the bins that have seen a ray.
/// Where there are catchers of shadows, their pixels have a memory of their own in each block:
/// objects must look the same without them.
class MemoryFormat final : public SampleFormat {
 public:
  explicit MemoryFormat(bool has_catchers) : has_catchers_(has_catchers) {}
  std::int32_t fewest_particles() const override { return 0; }
  std::vector<std::size_t> pixel_bytes(std::int32_t num_particles,
                                       std::int32_t num_populations) const override;
  std::vector<std::size_t> block_bytes() const override {
    return std::vector<std::size_t>(num_planes(), sizeof(BlockMemory));
  }
  std::size_t most_stored_block_bytes() const override;
  std::vector<SectionTag> tags() const override;
  void encode(const SampleState& state, StateWriter& out) const override;
  /// Errors, beside those of SampleFormat: more free rays in a bin than rays, a marked bin without
  /// any, noise that is negative or not finite, counts past the most.
  Status decode(const StateReader& from, SampleState& state) const override;
  /// The mean of the sources, of which rays of then count half: they were seen from elsewhere, or
  /// past what has moved since.
  void inherit_block(std::span<const BlockSource> sources, SampleState& state,
                     std::size_t block) const override;

 private:
  std::size_t num_planes() const { return has_catchers_ ? 2 : 1; }

  bool has_catchers_;
};
const MemoryFormat& memory_format(bool has_catchers = false);

/// (pixels) of a state of memory_format().
inline std::span<PixelMemory> pixel_memory_plane(SampleState& state) {
  return state.planes[SampleFormat::kNumPlanes].values<PixelMemory>();
}
inline std::span<const PixelMemory> pixel_memory_plane(const SampleState& state) {
  return state.planes[SampleFormat::kNumPlanes].values<PixelMemory>();
}

/// (blocks) of a state of memory_format(). plane: StateFormat::block_plane_of().
inline std::span<BlockMemory> block_memory_plane(SampleState& state, std::size_t plane = 0) {
  return state.block_planes[plane].values<BlockMemory>();
}
inline std::span<const BlockMemory> block_memory_plane(const SampleState& state,
                                                       std::size_t plane = 0) {
  return state.block_planes[plane].values<BlockMemory>();
}

}  // namespace baton
