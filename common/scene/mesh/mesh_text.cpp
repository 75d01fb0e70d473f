#include "common/scene/mesh/mesh_text.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <limits>
#include <system_error>

namespace baton {

Result<std::string_view> without_mark(std::string_view text, const std::string& name) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return Error{ErrorKind::bad_input,
                 name + ": not a mesh: its text is UTF-16, expected ASCII or UTF-8"};
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

LineEnd find_line_end(std::string_view text) {
  const auto* const end =
      std::find_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; });
  const auto length = static_cast<std::size_t>(end - text.begin());
  const std::size_t width = text.substr(length).starts_with("\r\n") ? 2 : 1;
  return {length, std::min(length + width, text.size())};
}

std::optional<double> real_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const char* const last = word.data() + word.size();
  const auto [end, error] = std::from_chars(word.data(), last, value);
  if (end == last && error == std::errc()) return value;
  if (end == last && error == std::errc::result_out_of_range)
    return std::strtod(std::string(word).c_str(), nullptr);
  // What Windows prints of what is infinite or no number.
  if (word.starts_with('-')) word.remove_prefix(1);
  if (word.starts_with("1.#")) return std::numeric_limits<double>::quiet_NaN();
  return std::nullopt;
}

}  // namespace baton
