#pragma once

#include <cstddef>
#include <cstdint>

#include "common/base/bytes.h"
#include "common/base/check.h"

/// What every fuzz target defines: it decodes one input, and stops the process where what was
/// decoded does not survive another round. Called by libFuzzer (the preset `fuzz`) or replay.cpp.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace baton {

inline ByteView fuzz_input(const std::uint8_t* data, std::size_t size) {
  return std::as_bytes(std::span(data, size));
}

}  // namespace baton
