#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace baton {

/// The keys around a frame, which is `share` of the way between `from` and `to`, with the one
/// before and the one after. Where there is none, the last key stands in.
struct KeySpan {
  std::size_t before = 0, from = 0, to = 0, after = 0;  ///< indices of keys
  double share = 0;                                     ///< [0, 1)
};

/// keys: at least one, ascending by `frame`.
template <class K>
KeySpan find_span(const std::vector<K>& keys, double frame) {
  const auto next = std::upper_bound(keys.begin(), keys.end(), frame,
                                     [](double f, const K& key) { return f < key.frame; });
  const std::size_t last = keys.size() - 1;
  if (next == keys.begin()) return {};
  const auto from = static_cast<std::size_t>(next - keys.begin()) - 1;
  if (from == last) return {last, last, last, last, 0};
  const double share = (frame - keys[from].frame) / (keys[from + 1].frame - keys[from].frame);
  return {from == 0 ? 0 : from - 1, from, from + 1, std::min(from + 2, last), share};
}

}  // namespace baton
