#pragma once

#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

namespace baton {
namespace detail {

/// Stands for a value of any type, where only the number of members is asked.
struct AnyValue {
  template <class T>
  operator T() const;  // NOLINT: implicit on purpose, never defined
};

template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...> /*count*/) {
  return requires { T{(static_cast<void>(I), AnyValue{})...}; };
}
template <class T, std::size_t N = 0>
constexpr std::size_t count_members() {
  if constexpr (takes<T>(std::make_index_sequence<N + 1>())) return count_members<T, N + 1>();
  return N;
}

}  // namespace detail

/// How many members an aggregate has. None of them may be a reference or a std::optional.
template <class T>
inline constexpr std::size_t kNumMembers = detail::count_members<std::remove_const_t<T>>();

/// The members of an aggregate in the order of their declaration, as a tuple of references.
template <class T>
auto members_of(T& value) {
  constexpr std::size_t kCount = kNumMembers<T>;
  static_assert(kCount <= 18, "add a row below");
#define BATON_MEMBERS(count, ...)    \
  if constexpr (kCount == (count)) { \
    auto& [__VA_ARGS__] = value;     \
    return std::tie(__VA_ARGS__);    \
  }
  if constexpr (kCount == 0) return std::tuple<>();
  BATON_MEMBERS(1, a)
  BATON_MEMBERS(2, a, b)
  BATON_MEMBERS(3, a, b, c)
  BATON_MEMBERS(4, a, b, c, d)
  BATON_MEMBERS(5, a, b, c, d, e)
  BATON_MEMBERS(6, a, b, c, d, e, f)
  BATON_MEMBERS(7, a, b, c, d, e, f, g)
  BATON_MEMBERS(8, a, b, c, d, e, f, g, h)
  BATON_MEMBERS(9, a, b, c, d, e, f, g, h, i)
  BATON_MEMBERS(10, a, b, c, d, e, f, g, h, i, j)
  BATON_MEMBERS(11, a, b, c, d, e, f, g, h, i, j, k)
  BATON_MEMBERS(12, a, b, c, d, e, f, g, h, i, j, k, l)
  BATON_MEMBERS(13, a, b, c, d, e, f, g, h, i, j, k, l, m)
  BATON_MEMBERS(14, a, b, c, d, e, f, g, h, i, j, k, l, m, n)
  BATON_MEMBERS(15, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o)
  BATON_MEMBERS(16, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p)
  BATON_MEMBERS(17, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q)
  BATON_MEMBERS(18, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r)
#undef BATON_MEMBERS
}

}  // namespace baton
