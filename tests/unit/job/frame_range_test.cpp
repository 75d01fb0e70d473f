#include "common/job/text/frame_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace baton {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<FrameNumber> frames(std::string_view text) {
  const Result<std::vector<FrameNumber>> result = parse_frames(text);
  EXPECT_TRUE(result.ok()) << text;
  return result.ok() ? *result : std::vector<FrameNumber>{};
}

std::vector<int> numbers(std::string_view text) {
  std::vector<int> result;
  for (const FrameNumber frame : frames(text)) result.push_back(frame.value());
  return result;
}

std::string message(std::string_view text) {
  const Result<std::vector<FrameNumber>> result = parse_frames(text);
  return result.ok() ? "ok" : result.error().message;
}

TEST(Frames, ReadsNumbersRangesStepsAndLists) {
  EXPECT_THAT(numbers("7"), ElementsAre(7));
  EXPECT_THAT(numbers("0-3"), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(numbers("1-8x3"), ElementsAre(1, 4, 7));
  EXPECT_THAT(numbers("1,5,9-12"), ElementsAre(1, 5, 9, 10, 11, 12));
}

TEST(Frames, WritesAShortTextThatReadsBack) {
  for (const char* text : {"7", "0-3", "1-10x3", "1,4,7", "1,5,9-12", "1-2", "1,3", "9999999"}) {
    EXPECT_EQ(format_frames(frames(text)), text);
  }
}

TEST(Frames, NamesWhatIsWrong) {
  for (const char* text : {"", "a", "1-", "-1", "1-4x", "1-4x0", "1,,2", "1,", " 1", "1 -2", "1e3",
                           "10000000", "99999999999999999999", "1-4-8"}) {
    EXPECT_THAT(message(text), HasSubstr("expected frames like 1-48, 1-100x2 or 1,5,9-12")) << text;
  }
  EXPECT_EQ(message("5-2"), "expected a last frame not before the first, got \"5-2\"");
  EXPECT_EQ(message("1-4,4"), "expected ascending frames without duplicates, got \"4 after 4\"");
  EXPECT_EQ(message("0-9999999"), "expected at most 100000 frames, got \"0-9999999\"");
  EXPECT_EQ(message("0-99999,100000"), "expected at most 100000 frames, got \"100000\"");
}

}  // namespace
}  // namespace baton
