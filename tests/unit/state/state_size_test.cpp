#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "common/base/section_file.h"
#include "common/job/method.h"
#include "common/state/memory_plane.h"

namespace baton {
namespace {

struct Carrying {
  Method method;
  const StateFormat& format;
  std::size_t pixel_bytes;  ///< of 6 samples in 2 populations
};
// A pixel has 2 x (source, Lns, fresh Lns) and 6 x (direction, weight, site).
const Carrying kCarrying[] = {
    {Method::sequential, sample_format(), 2 * 9 + 6 * 9},
    {Method::restir, weighed_sample_format(), 2 * 9 + 6 * 9 + 2},
    {Method::pool, memory_format(), 2 * 9 + 6 * 9 + sizeof(PixelMemory)},
};

TEST(SampleState, SizeOfAPixelIsThatOfItsPlanes) {
  for (const auto& [method, format, pixel_bytes] : kCarrying) {
    SampleState state;
    state.resize(format, {0, 0, 5, 2}, 6, 2);
    const bool has_blocks = method == Method::pool;
    EXPECT_EQ(state.size_bytes(), 10 * pixel_bytes + (has_blocks ? 2 * sizeof(BlockMemory) : 0));
    EXPECT_EQ(format.most_stored_bytes(6, 2), pixel_bytes);
    // A file says which bins it has, too.
    EXPECT_EQ(format.most_stored_block_bytes(), has_blocks ? sizeof(BlockMemory) + 64 : 0);
  }
}

TEST(SampleState, SizesOfEstimatesAreThoseOfTheFormats) {
  for (const auto& [method, format, pixel_bytes] : kCarrying) {
    EXPECT_EQ(format.most_stored_block_bytes(),
              static_cast<std::size_t>(traits(method).most_block_bytes));
    EXPECT_EQ(format.most_stored_bytes(6, 2),
              sample_format().most_stored_bytes(6, 2) +
                  static_cast<std::size_t>(traits(method).most_bytes_beside_samples));
  }
}

/// The bytes of a small state whose META claims another rectangle: x1 at byte 32, y1 at 36.
Bytes claiming(std::int32_t width, std::int32_t height, bool with_memory) {
  SampleState state;
  if (with_memory) {
    state.resize(memory_format(), {0, 0, 1, 1}, 0);
  } else {
    state.resize(sample_format(), {0, 0, 1, 1}, 1);
  }
  const SectionTag magic{'B', 'S', 'T', '1'};
  SectionFile file = *decode_section_file(encode_state(state), magic, kStateVersion, "t.bst");
  for (Section& section : file.sections) {
    if (section.tag == SectionTag{'M', 'E', 'T', 'A'}) {
      std::memcpy(section.payload.data() + 32, &width, sizeof(width));
      std::memcpy(section.payload.data() + 36, &height, sizeof(height));
    }
    if (section.tag == SectionTag{'S', 'R', 'C', '_'})
      section.payload.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  }
  return encode_section_file(file);
}

// A file of a few kilobytes must not ask for hundreds of gigabytes.
TEST(SampleState, AFileThatAsksForTooMuchIsRefusedBeforeAnythingIsAllocated) {
  for (const bool with_memory : {false, true}) {
    const Bytes bytes = claiming(20000, with_memory ? 3000 : 32768, with_memory);
    EXPECT_LT(bytes.size(), 100000u);
    const auto decoded = decode_state(bytes, "t.bst");
    ASSERT_FALSE(decoded.ok());
    EXPECT_THAT(decoded.error().message,
                testing::HasSubstr(with_memory ? "t.bst: 60000000 pixels of 0 particles take"
                                               : "t.bst: 655360000 pixels of 1 particles take"));
    EXPECT_THAT(decoded.error().message, testing::HasSubstr("past the limit of 4294967296"));
  }
}

}  // namespace
}  // namespace baton
