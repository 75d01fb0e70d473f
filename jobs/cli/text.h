#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/base/size_text.h"

namespace baton {

/// "7s", "3m05s", "2h03m"; seconds >= 0.
std::string duration_text(double seconds);

/// "2026-11-28 13:20:46Z"; time: milliseconds since 1970, UTC; 0: "-".
std::string utc_text(std::int64_t time_ms);
/// "2026-11-28T13:20:46.123Z", as ISO 8601 has it.
std::string utc_iso(std::int64_t time_ms);

/// The time, in milliseconds since 1970, that "30s", "15m", "2h" or "3d" before `now` means, or a
/// date with or without a time of day, UTC: "2026-11-28", "2026-11-28T13:20:46". Error, usage:
/// neither.
Result<std::int64_t> parse_since(const std::string& text, std::int64_t now);

/// "exposure +1.5 stops".
std::string exposure_text(float stops);

/// Two digits of it: "0.92 %", "11 %"; all before the point: "140 %".
std::string share_text(double share);

/// "25.0%"; whole 0 gives "0.0%".
std::string percent_text(std::uint64_t part, std::uint64_t whole);

}  // namespace baton
