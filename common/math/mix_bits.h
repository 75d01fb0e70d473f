#pragma once

#include <cstdint>

namespace baton {

/// Adds a word to a hash: the steps and the end of MurmurHash3 for 32 bits [Appleby 2011]. Every
/// bit of the result depends on all bits that went in.
constexpr std::uint32_t mix_bits(std::uint32_t hash, std::uint32_t word) {
  word *= 0xCC9E2D51u;
  word = word << 15 | word >> 17;
  hash ^= word * 0x1B873593u;
  hash = (hash << 13 | hash >> 19) * 5 + 0xE6546B64u;
  hash = (hash ^ hash >> 16) * 0x85EBCA6Bu;
  hash = (hash ^ hash >> 13) * 0xC2B2AE35u;
  return hash ^ hash >> 16;
}

}  // namespace baton
