#include "common/job/file_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace baton {

std::string frame_file_name(const std::string& pattern, int number) {
  const std::size_t first = pattern.find('#');
  if (first == std::string::npos) return pattern;
  const std::size_t last = pattern.find_first_not_of('#', first);
  const std::size_t count = (last == std::string::npos ? pattern.size() : last) - first;
  std::string name = pattern;
  return name.replace(first, count, fmt::format("{:0{}}", number, count));
}

int number_at(const FileSequence& sequence, FrameNumber frame) {
  // A product that rounding has left just below a whole number counts as that: .7 x 90 is 63.
  const double product = sequence.speed * frame.value();
  const double rounding = 2 * std::numeric_limits<double>::epsilon() * std::fabs(product);
  const auto wanted = static_cast<std::int64_t>(std::floor(product + rounding)) + sequence.offset;
  if (sequence.beyond == FilesBeyond::hold)
    return static_cast<int>(std::clamp<std::int64_t>(wanted, sequence.first, sequence.last));
  const std::int64_t count = std::int64_t{sequence.last} - sequence.first + 1;
  const std::int64_t place = (wanted - sequence.first) % count;
  return static_cast<int>(sequence.first + (place < 0 ? place + count : place));
}

std::string file_at(const FileSequence& sequence, FrameNumber frame) {
  const std::filesystem::path path = sequence.files;
  return (path.parent_path() /
          frame_file_name(path.filename().string(), number_at(sequence, frame)))
      .string();
}

}  // namespace baton
