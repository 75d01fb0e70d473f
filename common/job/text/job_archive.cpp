#include "common/job/text/job_archive.h"

#include <fmt/format.h>

#include <charconv>

namespace baton {
double decimal(float value) {
  std::array<char, 32> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
  double result = value;
  std::from_chars(text.data(), written.ptr, result);
  return result;
}

void JobArchive::fault(std::string_view key, const std::string& expected, const std::string& got) {
  fault(key, fmt::format("expected {}, got {}", expected, got));
}

bool JobArchive::number(Key key, float& value, NumberRange range) {
  double wide = decimal(value);
  if (!number(key, wide, range)) return false;
  const auto narrow = static_cast<float>(wide);

  // A tiny number may have been rounded onto an open end of its range.
  if (!range.contains(decimal(narrow))) {
    fault(key.name, "a number that does not round to the end of its range",
          fmt::format("{}", wide));
    return false;
  }
  value = narrow;
  return true;
}

bool JobArchive::number(Key key, std::optional<float>& value, NumberRange range) {
  float inner = value.value_or(std::numeric_limits<float>::quiet_NaN());
  if (!number(key, inner, range)) return false;
  value = inner;
  return true;
}

bool JobArchive::vector(Key key, Vec3& value, NumberRange range, bool lone) {
  std::array<double, 3> wide{decimal(value.x), decimal(value.y), decimal(value.z)};
  if (!numbers(key, wide, range, lone)) return false;
  value = {static_cast<float>(wide[0]), static_cast<float>(wide[1]), static_cast<float>(wide[2])};
  return true;
}

}  // namespace baton
