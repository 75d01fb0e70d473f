#include "common/job/text/frame_range.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "common/base/limits.h"

namespace baton {
namespace {

Error wrong(std::string_view expected, std::string_view got) {
  return {ErrorKind::bad_input,
          fmt::format("expected {}, got \"{}\"", expected, got.substr(0, 60))};
}

/// Takes a frame number off the front of `text`.
std::optional<int> take_number(std::string_view& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || value < 0 || value > limits::kMaxFrameNumber) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take_char(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

/// Appends "7", "1-48" or "1-100x2".
Status append_range(std::string_view range, std::vector<FrameNumber>& frames) {
  std::string_view rest = range;
  const auto syntax = [&] {
    return wrong(fmt::format("frames like 1-48, 1-100x2 or 1,5,9-12 with numbers in [0, {}]",
                             limits::kMaxFrameNumber),
                 range);
  };

  // Read first, last and distance.
  const std::optional<int> first = take_number(rest);
  std::optional<int> last = first;
  std::optional<int> step = 1;
  if (take_char(rest, '-')) {
    last = take_number(rest);
    if (take_char(rest, 'x')) step = take_number(rest);
  }
  if (!first || !last || !step || *step == 0 || !rest.empty()) return syntax();

  // Append them, in order and within the limit.
  if (*last < *first) return wrong("a last frame not before the first", range);
  if (!frames.empty() && *first <= frames.back().value()) {
    return wrong("ascending frames without duplicates",
                 fmt::format("{} after {}", *first, frames.back()));
  }
  if ((*last - *first) / *step + 1 > limits::kMaxFrames - static_cast<int>(frames.size())) {
    return wrong(fmt::format("at most {} frames", limits::kMaxFrames), range);
  }
  for (int frame = *first; frame <= *last; frame += *step) frames.emplace_back(frame);
  return {};
}

}  // namespace

Result<std::vector<FrameNumber>> parse_frames(std::string_view text) {
  std::vector<FrameNumber> frames;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    BATON_TRY(append_range(text.substr(start, comma - start), frames));
    start = comma + 1;
  }
  return frames;
}

std::string format_frames(const std::vector<FrameNumber>& frames) {
  std::string text;
  for (std::size_t i = 0; i < frames.size();) {
    // The longest stretch of equal distances that starts here; with gaps it takes four frames to be
    // worth a range.
    std::size_t last = i;
    const int step = i + 1 < frames.size() ? frames[i + 1] - frames[i] : 1;
    while (last + 1 < frames.size() && frames[last + 1] - frames[last] == step) ++last;
    if (step != 1 && last < i + 3) last = i;

    if (!text.empty()) text += ',';
    text += std::to_string(frames[i].value());
    if (last > i) text += fmt::format("-{}", frames[last]);
    if (last > i && step != 1) text += fmt::format("x{}", step);
    i = last + 1;
  }
  return text;
}

}  // namespace baton
