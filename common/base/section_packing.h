#pragma once

#include <cstdint>
#include <memory>

#include "common/base/bytes.h"
#include "common/base/result.h"

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace baton {

/// What the writer tries with a payload; readers find the answer in the file.
enum class Packing : std::uint8_t { zstd, none };

/// No payload unpacks to more than this many times its stored size: 4 bytes of zstd make a block of
/// at most 128 KiB [RFC 8878].
inline constexpr std::uint64_t kMaxExpansion = (128 << 10) / 4;

/// Memory whose old contents do not matter, and which is not cleared first.
class Scratch {
 public:
  std::byte* at_least(std::size_t size);

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t capacity_ = 0;
};

/// Packs the sections of one file, one after the other.
class SectionPacker {
 public:
  SectionPacker();
  ~SectionPacker();
  SectionPacker(const SectionPacker&) = delete;
  SectionPacker& operator=(const SectionPacker&) = delete;

  /// Appends the stored form of `payload`, elements of `stride` bytes, to `file`. Returns whether
  /// it is stored raw: because it was asked for, or because zstd does not shrink it.
  bool append(ByteView payload, std::size_t stride, Packing packing, Bytes& file);

 private:
  ZSTD_CCtx_s* const context_;
  Scratch planes_, packed_;
};

/// Unpacks the sections of one file, one after the other.
class SectionUnpacker {
 public:
  SectionUnpacker();
  ~SectionUnpacker();
  SectionUnpacker(const SectionUnpacker&) = delete;
  SectionUnpacker& operator=(const SectionUnpacker&) = delete;

  /// Inverse of append for a payload of `raw_bytes`, which must be the size of `stored` if that is
  /// raw. ErrorKind::corrupt says what is wrong with the bytes, without naming them.
  Result<Bytes> unpack(ByteView stored, bool stored_raw, std::size_t stride, std::size_t raw_bytes);

 private:
  ZSTD_DCtx_s* const context_;
  Scratch planes_;
};

}  // namespace baton
