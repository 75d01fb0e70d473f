#pragma once

#include <bit>
#include <cstdint>

/// The stages of MurmurHash3 for 32 bits [Appleby 2011].
namespace baton::murmur3 {

/// A word, mixed for itself.
constexpr std::uint32_t scrambled(std::uint32_t word) {
  return std::rotl(word * 0xCC9E2D51u, 15) * 0x1B873593u;
}
/// The hash after a word more.
constexpr std::uint32_t added(std::uint32_t hash, std::uint32_t word) {
  return std::rotl(hash ^ scrambled(word), 13) * 5 + 0xE6546B64u;
}
/// Every bit of the result depends on all bits that went in.
constexpr std::uint32_t finished(std::uint32_t hash) {
  hash = (hash ^ hash >> 16) * 0x85EBCA6Bu;
  hash = (hash ^ hash >> 13) * 0xC2B2AE35u;
  return hash ^ hash >> 16;
}

}  // namespace baton::murmur3
