#include "jobs/cli/text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <ctime>
#include <string_view>
#include <utility>

namespace baton {

std::string duration_text(double seconds) {
  const auto whole = static_cast<std::int64_t>(seconds + 0.5);
  if (whole < 60) return fmt::format("{}s", whole);
  if (whole < 3600) return fmt::format("{}m{:02}s", whole / 60, whole % 60);
  return fmt::format("{}h{:02}m", whole / 3600, whole % 3600 / 60);
}

std::string utc_text(std::int64_t time_ms) {
  if (time_ms == 0) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S}Z",
                     fmt::gmtime(static_cast<std::time_t>(time_ms / 1000)));
}

std::string utc_iso(std::int64_t time_ms) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z",
                     fmt::gmtime(static_cast<std::time_t>(time_ms / 1000)), time_ms % 1000);
}

Result<std::int64_t> parse_since(const std::string& text, std::int64_t now) {
  std::int64_t count = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), count);
  const std::string unit = fault == std::errc() ? std::string(end) : std::string();
  constexpr std::array<std::pair<std::string_view, std::int64_t>, 4> kUnits{
      {{"s", 1}, {"m", 60}, {"h", 3600}, {"d", 86400}}};
  constexpr std::int64_t kMost = 1000000;
  for (const auto& [name, seconds] : kUnits) {
    if (unit == name && count >= 0 && count <= kMost) return now - 1000 * seconds * count;
  }
  for (const char* const form : {"%Y-%m-%dT%H:%M:%SZ", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%d"}) {
    std::tm time{};
    const char* const rest = ::strptime(text.c_str(), form, &time);
    if (rest == nullptr || *rest != '\0') continue;
    // There is no 30th of February: it would become another day.
    const std::tm said = time;
    const std::time_t seconds = ::timegm(&time);
    if (time.tm_mday == said.tm_mday && time.tm_mon == said.tm_mon && time.tm_min == said.tm_min)
      return std::int64_t{1000} * seconds;
  }
  return Error{ErrorKind::usage,
               fmt::format("--since {}: expected 30s, 15m, 2h or 3d, or a time in UTC as "
                           "2026-11-28T13:20:46",
                           text)};
}

std::string exposure_text(float stops) {
  const float rounded = std::round(10 * stops) / 10;
  return fmt::format("exposure {:+.3g} stops", rounded + 0.0f);  // no -0
}

std::string share_text(double share) {
  const double percent = 100 * share;
  return percent < 99.5 ? fmt::format("{:.2g} %", percent) : fmt::format("{:.0f} %", percent);
}

std::string percent_text(std::uint64_t part, std::uint64_t whole) {
  return fmt::format(
      "{:.1f}%", whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
}

}  // namespace baton
