#include "common/base/size_text.h"

#include <fmt/format.h>

#include <array>

namespace baton {
namespace {

/// `value` over the largest power of `base` that leaves it at least 1, with that power's unit.
template <std::size_t N>
std::string scaled(std::uint64_t value, double base, const std::array<const char*, N>& units) {
  auto rest = static_cast<double>(value);
  std::size_t unit = 0;
  while (rest >= base && unit + 1 < N) {
    rest /= base;
    ++unit;
  }
  return unit == 0 ? fmt::format("{}{}", value, units[0])
                   : fmt::format("{:.1f}{}", rest, units[unit]);
}

}  // namespace

std::string bytes_text(std::uint64_t bytes) {
  return scaled<5>(bytes, 1024, {" B", " KiB", " MiB", " GiB", " TiB"});
}

std::string count_text(std::uint64_t count) {
  return scaled<5>(count, 1000, {"", " k", " M", " G", " T"});
}

}  // namespace baton
