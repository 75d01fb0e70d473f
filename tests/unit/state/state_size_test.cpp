#include <gtest/gtest.h>

#include <vector>

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
    const std::size_t bytes = bytes_of(state.lns) + bytes_of(state.lns_fresh) +
                              bytes_of(state.source) + bytes_of(state.direction) +
                              bytes_of(state.weight) + bytes_of(state.site) +
                              bytes_of(state.memory) + bytes_of(state.confidence);
    EXPECT_EQ(10 * SampleState::bytes_per_pixel(6, 2, memory, !memory), bytes);
  }
}

}  // namespace
}  // namespace baton
