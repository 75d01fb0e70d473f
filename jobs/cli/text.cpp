#include "jobs/cli/text.h"

#include <fmt/format.h>

#include <cmath>

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

std::string duration_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  if (whole < 60) return fmt::format("{}s", whole);
  if (whole < 3600) return fmt::format("{}m{:02}s", whole / 60, whole % 60);
  return fmt::format("{}h{:02}m", whole / 3600, whole % 3600 / 60);
}

std::string exposure_text(float stops) {
  const float rounded = std::round(10 * stops) / 10;
  return fmt::format("exposure {:+.3g} stops", rounded + 0.0f);  // no -0
}

std::string percent_text(std::uint64_t part, std::uint64_t whole) {
  return fmt::format(
      "{:.1f}%", whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

}  // namespace baton
