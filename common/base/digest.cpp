#include "common/base/digest.h"

#include <fmt/format.h>

#include <charconv>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace baton {

std::string Digest::hex() const { return fmt::format("{:016x}{:016x}", high, low); }

std::optional<Digest> Digest::from_hex(std::string_view text) {
  if (text.size() != 32) return std::nullopt;
  Digest digest;
  for (auto [half, offset] : {std::pair{&digest.high, 0}, std::pair{&digest.low, 16}}) {
    const char* first = text.data() + offset;
    const auto [end, error] = std::from_chars(first, first + 16, *half, 16);
    if (error != std::errc() || end != first + 16) return std::nullopt;
  }
  return digest;
}

Digest digest_of(ByteView bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return {hash.high64, hash.low64};
}

std::uint32_t checksum32(ByteView bytes) {
  return static_cast<std::uint32_t>(XXH3_64bits(bytes.data(), bytes.size()));
}

}  // namespace baton
