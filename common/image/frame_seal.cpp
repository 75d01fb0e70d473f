#include "common/image/frame_seal.h"

#include <algorithm>
#include <cstring>
#include <span>

#include "common/base/check.h"
#include "common/base/digest.h"

namespace baton {
namespace {

constexpr std::size_t kDigits = 32;

/// Where the digits of the seal are; empty: there is none. An attribute is its name, its type, both
/// with a zero behind, the number of its bytes, and these.
std::span<std::byte> seal_of(Bytes& exr) {
  std::string begin = std::string(kSealAttribute) + '\0' + "string" + '\0';
  begin += {static_cast<char>(kDigits), 0, 0, 0};
  const auto found = std::ranges::search(exr, std::as_bytes(std::span(begin)));
  if (static_cast<std::size_t>(exr.end() - found.end()) < kDigits || found.empty()) return {};
  return std::span(exr).subspan(static_cast<std::size_t>(found.end() - exr.begin()), kDigits);
}

/// With zeros in the place of the digits.
std::string seal_over(const std::string& name, ByteView exr) {
  Bytes text(exr.begin(), exr.end());
  const ByteView of_name = as_bytes_view(name);
  text.insert(text.end(), of_name.begin(), of_name.end());
  return digest_of(text).hex();
}

}  // namespace

std::string blank_seal() { return std::string(kDigits, '0'); }

void seal_frame(const std::string& name, Bytes& exr) {
  const std::span<std::byte> seal = seal_of(exr);
  BATON_CHECK(!seal.empty());
  const std::string digits = seal_over(name, exr);
  std::memcpy(seal.data(), digits.data(), kDigits);
}

bool is_sealed(const std::string& name, Bytes exr) {
  const std::span<std::byte> seal = seal_of(exr);
  if (seal.empty()) return false;
  const std::string said(reinterpret_cast<const char*>(seal.data()), kDigits);
  const std::string blank = blank_seal();
  std::memcpy(seal.data(), blank.data(), kDigits);
  return said == seal_over(name, exr);
}

}  // namespace baton
