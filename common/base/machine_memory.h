#pragma once

#include <cstdint>

namespace baton {

/// The memory of this machine in bytes, or what the control groups of this process allow, if that
/// is less.
std::uint64_t machine_memory_bytes();

/// What this process has of it now; 0: the system does not say.
std::uint64_t resident_bytes();

/// What the programs of one farm use of it together unless told otherwise: half, so that a machine
/// that people sit at stays usable.
std::uint64_t default_memory_bytes();

}  // namespace baton
