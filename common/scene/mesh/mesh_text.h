#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace baton {

/// What text files of meshes have in common.

/// The text without the byte order mark that some editors write before it. Error: UTF-16.
Result<std::string_view> without_mark(std::string_view text, const std::string& name);

/// Where the first line of a text ends: at "\n", "\r\n" or "\r".
struct LineEnd {
  std::size_t length = 0;  ///< of the line
  std::size_t next = 0;    ///< where the next one begins
};
LineEnd find_line_end(std::string_view text);

/// Whether a comment begins at a '#' in text[at]: not in what Windows prints of what is infinite or
/// no number ("1.#IND").
inline bool is_comment(std::string_view text, std::size_t at) {
  return text[at] == '#' && !text.substr(0, at).ends_with("1.");
}

/// A number as any program writes it: with a sign or without, also beyond what a double holds
/// (infinite, or 0), also no number ("nan", "1.#IND"). nullopt: another word.
std::optional<double> real_number(std::string_view word);

}  // namespace baton
