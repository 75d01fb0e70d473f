#pragma once

#include <cstdint>

namespace baton {

/// The time: milliseconds since 1970, UTC.
std::int64_t now_ms();

}  // namespace baton
