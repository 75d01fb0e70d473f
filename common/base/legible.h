#pragma once

#include <string>
#include <string_view>

namespace baton {

/// What others say, as it may stand in a table, a log or JSON: bytes that are no UTF-8 become
/// U+FFFD, characters that move the cursor or turn the direction of writing become what C would
/// write, "\n", "\x1b", "\u202e". What is legible stays as it is.

/// A name: one line.
std::string legible_line(std::string_view text);
/// Lines: line breaks and tabs stay.
std::string legible_text(std::string_view text);

/// Up to the first line break.
constexpr std::string_view first_line(std::string_view text) {
  return text.substr(0, text.find('\n'));
}

}  // namespace baton
