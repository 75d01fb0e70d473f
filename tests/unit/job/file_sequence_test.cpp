#include "common/job/file_sequence.h"

#include <gtest/gtest.h>

#include <vector>

namespace baton {
namespace {

std::vector<int> numbers(const FileSequence& sequence, const std::vector<int>& frames) {
  std::vector<int> result;
  for (const int frame : frames) result.push_back(number_at(sequence, FrameNumber(frame)));
  return result;
}

TEST(FileSequence, HasTheNumbersOfTheFrames) {
  EXPECT_EQ(numbers({.files = "a.#.exr"}, {0, 7, 9999999}), (std::vector{0, 7, 9999999}));
  EXPECT_EQ(numbers({.files = "a.#.exr", .offset = -1000}, {1001, 1002}), (std::vector{1, 2}));
  EXPECT_EQ(numbers({.files = "a.#.exr", .speed = 0.5}, {1, 2, 3, 4}), (std::vector{0, 1, 1, 2}));
  EXPECT_EQ(numbers({.files = "a.#.exr", .speed = -1, .offset = 10}, {1, 2}), (std::vector{9, 8}));
}

TEST(FileSequence, HoldsOrLoopsBeyondItsFiles) {
  FileSequence sequence{.files = "a.#.exr", .first = 3, .last = 5};
  EXPECT_EQ(numbers(sequence, {0, 3, 4, 5, 6, 100}), (std::vector{3, 3, 4, 5, 5, 5}));
  sequence.beyond = FilesBeyond::loop;
  EXPECT_EQ(numbers(sequence, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9}),
            (std::vector{3, 4, 5, 3, 4, 5, 3, 4, 5, 3}));
  sequence.speed = 1e6;
  sequence.last = 9999998;
  EXPECT_EQ(number_at(sequence, FrameNumber(9999999)), 3 + (9999999000000 - 3) % 9999996);
}

// .7 x 90 is 62.99... in doubles.
TEST(FileSequence, CountsDecimalSpeedsExactly) {
  FileSequence sequence{.files = "sky.####.exr", .first = -100000, .last = 100000};
  for (int hundredths = -250; hundredths <= 250; ++hundredths) {
    sequence.speed = hundredths / 100.0;
    for (int frame = 0; frame <= 400; ++frame) {
      const int exact = hundredths * frame;
      const int whole = exact / 100 - (exact % 100 < 0 ? 1 : 0);
      ASSERT_EQ(number_at(sequence, FrameNumber(frame)), whole) << sequence.speed << " x " << frame;
    }
  }
}

TEST(FileSequence, NamesFiles) {
  EXPECT_EQ(file_at({.files = "/plates/shot#2/a.####.exr", .offset = 3}, FrameNumber(9)),
            "/plates/shot#2/a.0012.exr");
  EXPECT_EQ(file_at({.files = "/plates/a.png"}, FrameNumber(9)), "/plates/a.png");
  EXPECT_EQ(frame_file_name("f.#.exr", 1234), "f.1234.exr");
}

}  // namespace
}  // namespace baton
