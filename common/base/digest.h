#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/bytes.h"

namespace baton {

/// 128-bit content digest (XXH3-128). Names blobs and jobs; guards against damage, not against an
/// adversary.
struct Digest {
  std::uint64_t high = 0;
  std::uint64_t low = 0;

  auto operator<=>(const Digest&) const = default;
  bool empty() const { return high == 0 && low == 0; }
  /// 32 lower-case hexadecimal digits.
  std::string hex() const;
  /// The first 8 digits, for people.
  std::string short_hex() const { return hex().substr(0, 8); }
  /// Inverse of hex(); nullopt when `text` is not 32 hexadecimal digits.
  static std::optional<Digest> from_hex(std::string_view text);
};

/// Digest of the bytes.
Digest digest_of(ByteView bytes);
inline Digest digest_of(std::string_view text) { return digest_of(as_bytes_view(text)); }

/// 32-bit checksum of a file section (low half of XXH3-64).
std::uint32_t checksum32(ByteView bytes);

}  // namespace baton
