#include "common/base/suggest.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <vector>

namespace baton {
namespace {

constexpr std::size_t kMaxCompared = 64;
constexpr std::size_t kMaxListed = 20;
/// Shorter words begin too many others.
constexpr std::size_t kLeastPrefix = 3;

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Insertions, deletions and replacements that turn a into b [Levenshtein 1966].
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i - 1]) != lower(b[j - 1]) ? 1 : 0);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string closest_word(std::string_view word, std::span<const std::string> candidates) {
  std::string closest;
  if (word.size() > kMaxCompared) return closest;
  std::size_t smallest = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    if (candidate.size() > kMaxCompared) continue;
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < smallest && distance < word.size()) {
      smallest = distance;
      closest = candidate;
    }
  }
  if (!closest.empty() || word.size() < kLeastPrefix) return closest;
  const auto begins = [&](const std::string& candidate) {
    return candidate.size() > word.size() &&
           edit_distance(word, candidate.substr(0, word.size())) == 0;
  };
  const auto found = std::ranges::find_if(candidates, begins);
  if (std::ranges::count_if(candidates, begins) == 1) closest = *found;
  return closest;
}

std::string suggestion(std::string_view word, std::span<const std::string> candidates) {
  if (candidates.empty()) return "";
  if (const std::string closest = closest_word(word, candidates); !closest.empty()) {
    return fmt::format("; did you mean \"{}\"?", closest);
  }
  const auto listed = candidates.first(std::min(candidates.size(), kMaxListed));
  return fmt::format("; there is {}{}", fmt::join(listed, ", "),
                     candidates.size() > kMaxListed ? ", ..." : "");
}

}  // namespace baton
