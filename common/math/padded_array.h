#pragma once

#include <cstddef>
#include <span>

#include "common/base/check.h"

namespace baton {

/// What kernels may read and write past the last element of an array: they work on whole vectors of
/// eight lanes, two at a time.
inline constexpr std::size_t kVectorPadding = 16;

/// N elements that kernels read and write in whole vectors. A vector that begins at any of them
/// lies in the array; who reads one has written all of it, also what lies past the elements in use.
/// Begins on a cache line, with elements that nobody has written.
template <class T, std::size_t N>
class PaddedArray {
 public:
  static constexpr std::size_t kSize = N;

  T& operator[](std::size_t i) {
    BATON_DCHECK(i < N);
    return elements_[i];
  }
  const T& operator[](std::size_t i) const {
    BATON_DCHECK(i < N);
    return elements_[i];
  }
  /// Where elements i, i + 1, ... of a vector begin.
  T* from(std::size_t i) {
    BATON_DCHECK(i < N);
    return elements_ + i;
  }
  const T* from(std::size_t i) const {
    BATON_DCHECK(i < N);
    return elements_ + i;
  }
  std::span<T> first(std::size_t count) {
    BATON_DCHECK(count <= N);
    return {elements_, count};
  }
  std::span<const T> first(std::size_t count) const {
    BATON_DCHECK(count <= N);
    return {elements_, count};
  }
  /// Fills what a vector may read past the first `count` elements.
  void pad(std::size_t count, const T& value) {
    BATON_DCHECK(count <= N);
    for (std::size_t i = count; i < count + kVectorPadding; ++i) elements_[i] = value;
  }

 private:
  alignas(64) T elements_[N + kVectorPadding];
};

}  // namespace baton
