#include "jobs/cli/text.h"

#include <fmt/format.h>

#include <cmath>

namespace baton {

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
