#include "common/job/job_id.h"

#include <fmt/format.h>

#include <charconv>
#include <random>

namespace baton {

std::string JobId::hex() const { return fmt::format("{:016x}", number); }

std::optional<JobId> JobId::from_hex(std::string_view text) {
  constexpr std::size_t kDigits = 16;
  JobId id;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), id.number, kDigits);
  const bool is_whole = error == std::errc() && end == text.data() + text.size();
  if (!is_whole || text.size() != kDigits) return std::nullopt;
  return id;
}

JobId JobId::draw() {
  std::random_device device;
  JobId id;
  while (id.empty()) id.number = std::uint64_t{device()} << 32 | device();
  return id;
}

}  // namespace baton
