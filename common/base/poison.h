#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace baton {

/// Work space is reused from pixel to pixel, so what reads more of it than was written finds some
/// other pixel's values, and mostly nobody notices. In checked builds (BATON_CHECKED in
/// cmake/baton.cmake) a test can have work space filled with a pattern before each use: whoever
/// renders with two patterns and gets two images has read what nobody wrote. Other builds have none
/// of this.
#ifdef BATON_CHECKED

inline constexpr bool kCanPoison = true;

namespace detail {
inline std::atomic<std::uint32_t> poison_pattern{0};
}
/// What work space is filled with; 0: it is left as it is.
inline void set_poison(std::uint32_t pattern) { detail::poison_pattern = pattern; }

template <class T>
void poison(std::span<T> work_space) {
  static_assert(std::is_trivially_copyable_v<T>);
  const std::uint32_t pattern = detail::poison_pattern.load(std::memory_order_relaxed);
  if (pattern == 0 || work_space.empty()) return;
  auto* const bytes = reinterpret_cast<unsigned char*>(work_space.data());
  const std::size_t words = work_space.size_bytes() / sizeof(pattern);
  for (std::size_t i = 0; i < words; ++i)
    std::memcpy(bytes + i * sizeof(pattern), &pattern, sizeof(pattern));
  std::memcpy(bytes + words * sizeof(pattern), &pattern, work_space.size_bytes() % sizeof(pattern));
}

#else

inline constexpr bool kCanPoison = false;
inline void set_poison(std::uint32_t /*pattern*/) {}

template <class T>
void poison(std::span<T> /*work_space*/) {}

#endif

template <class T>
void poison(T& work_space) {
  poison(std::span(&work_space, 1));
}
template <class T>
void poison(std::vector<T>& work_space) {
  poison(std::span(work_space));
}

}  // namespace baton
