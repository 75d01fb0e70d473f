#pragma once

#include <span>
#include <string>
#include <string_view>

namespace baton {

/// The candidate that `word` most likely meant: by edit distance without regard to case, or else
/// the only one that begins with it; "" when none is near (more than a third of the word differs,
/// and more than two letters).
std::string closest_word(std::string_view word, std::span<const std::string> candidates);

/// `; did you mean "width"?`, or `; there is a, b, c` when no candidate is near, or "" without
/// candidates.
std::string suggestion(std::string_view word, std::span<const std::string> candidates);

}  // namespace baton
