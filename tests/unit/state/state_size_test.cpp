#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <vector>

#include "common/base/section_file.h"
#include "common/state/sample_state.h"

namespace baton {
namespace {

template <class T>
std::size_t bytes_of(const std::vector<T>& array) {
  return array.size() * sizeof(T);
}

TEST(SampleState, SizeOfAPixelIsThatOfItsArrays) {
  for (const bool memory : {false, true}) {
    SampleState state;
    state.resize({0, 0, 5, 2}, 6, 2);
    if (memory) state.add_memory();
    if (!memory) state.add_confidence();
    const std::size_t bytes =
        bytes_of(state.lns) + bytes_of(state.lns_fresh) + bytes_of(state.source) +
        bytes_of(state.direction) + bytes_of(state.weight) + bytes_of(state.site) +
        state.memory.size() * sizeof(PixelMemory) + bytes_of(state.confidence);
    EXPECT_EQ(state.size_bytes(), bytes);
    // A file says which bins it has, too.
    const std::size_t in_a_file = memory ? 8 : 0;
    EXPECT_EQ(10 * SampleState::bytes_per_pixel(6, 2, memory, !memory), bytes + 10 * in_a_file);
  }
}

/// The bytes of a small state whose META claims another rectangle: x1 at byte 32, y1 at 36.
Bytes claiming(std::int32_t width, std::int32_t height, bool with_memory) {
  SampleState state;
  state.resize({0, 0, 1, 1}, with_memory ? 0 : 1);
  if (with_memory) state.add_memory();
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
    const Bytes bytes = claiming(20000, with_memory ? 2000 : 32768, with_memory);
    EXPECT_LT(bytes.size(), 100000u);
    const auto decoded = decode_state(bytes, "t.bst");
    ASSERT_FALSE(decoded.ok());
    EXPECT_THAT(decoded.error().message,
                testing::HasSubstr(with_memory ? "t.bst: 40000000 pixels of 0 particles take"
                                               : "t.bst: 655360000 pixels of 1 particles take"));
    EXPECT_THAT(decoded.error().message, testing::HasSubstr("past the limit of 4294967296"));
  }
}

}  // namespace
}  // namespace baton
