#pragma once

#include <string>

namespace baton {

/// Version, sources and the libraries that decide bytes, e.g. "baton 0.7.0 (sources 3f2a91c04be7,
/// zstd 1.5.4)". Programs of one identity make the same bytes of the same job, on one instruction
/// set and with one ray tracer.
std::string build_identity();

}  // namespace baton
