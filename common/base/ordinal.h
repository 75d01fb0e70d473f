#pragma once

#include <fmt/format.h>

#include <compare>
#include <cstddef>
#include <cstdint>

namespace baton {

/// A position that counts one kind of thing: an int32 that mixes with no other kind. Tag: any type,
/// only its name counts. Two positions have a distance, a position and a distance give a position;
/// all else is said with value(). Archived as its int32 (common/base/archive.h).
template <class Tag>
class Ordinal {
 public:
  constexpr Ordinal() = default;
  explicit constexpr Ordinal(std::int32_t value) : value_(value) {}

  constexpr std::int32_t value() const { return value_; }
  /// Place in an array that has an element for each position; the position is not negative.
  constexpr std::size_t index() const { return static_cast<std::size_t>(value_); }

  constexpr auto operator<=>(const Ordinal&) const = default;
  constexpr Ordinal& operator++() {
    ++value_;
    return *this;
  }
  constexpr Ordinal& operator--() {
    --value_;
    return *this;
  }
  friend constexpr Ordinal operator+(Ordinal a, std::int32_t distance) {
    return Ordinal(a.value_ + distance);
  }
  friend constexpr Ordinal operator-(Ordinal a, std::int32_t distance) {
    return Ordinal(a.value_ - distance);
  }
  friend constexpr std::int32_t operator-(Ordinal a, Ordinal b) { return a.value_ - b.value_; }

 private:
  std::int32_t value_ = 0;
};

}  // namespace baton

/// Printed as its number.
template <class Tag>
struct fmt::formatter<baton::Ordinal<Tag>> : fmt::formatter<std::int32_t> {
  template <class Context>
  auto format(baton::Ordinal<Tag> position, Context& context) const {
    return fmt::formatter<std::int32_t>::format(position.value(), context);
  }
};
