#pragma once

#include <algorithm>
#include <cstring>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "tests/fuzz/fuzz_target.h"

namespace baton {

/// A section file (common/state/FORMAT.md) that was changed somewhere, with its sizes and checksums
/// made good again: otherwise no change would get past them.
inline Bytes mend_sections(ByteView damaged) {
  constexpr std::size_t kHeader = 16, kEntry = 28, kChecksum = 4;
  Bytes file(damaged.begin(), damaged.end());
  if (file.size() < kHeader + kChecksum) return file;
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(file.data() + at, &value, sizeof(value));
  };
  const auto get = [&](std::size_t at, auto value) {
    std::memcpy(&value, file.data() + at, sizeof(value));
    return value;
  };

  const auto count = static_cast<std::uint16_t>(
      std::min<std::size_t>(get(6, std::uint16_t{}), (file.size() - kHeader - kChecksum) / kEntry));
  const std::size_t table_end = kHeader + count * kEntry + kChecksum;
  put(6, count);
  put(8, static_cast<std::uint32_t>(table_end));
  put(12, std::uint32_t{0});

  // Each section takes what its row says, the last one takes the rest.
  std::size_t start = table_end;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t row = kHeader + i * kEntry;
    const std::size_t left = file.size() - start;
    const std::size_t stored =
        i + 1 < count ? std::min<std::size_t>(get(row + 8, std::uint64_t{}), left) : left;
    put(row + 6, std::uint16_t{0});
    put(row + 8, static_cast<std::uint64_t>(stored));
    if ((get(row + 4, std::uint8_t{}) & 2) != 0) put(row + 16, static_cast<std::uint64_t>(stored));
    put(row + 24, checksum32(ByteView(file).subspan(start, stored)));
    start += stored;
  }
  put(table_end - kChecksum, checksum32(ByteView(file).first(table_end - kChecksum)));
  return file;
}

/// Looks at an input as it is, and as a section file that is whole.
template <class LookAt>
int fuzz_section_file(const std::uint8_t* data, std::size_t size, LookAt look_at) {
  look_at(fuzz_input(data, size));
  look_at(ByteView(mend_sections(fuzz_input(data, size))));
  return 0;
}

}  // namespace baton
