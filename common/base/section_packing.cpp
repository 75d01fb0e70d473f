#include "common/base/section_packing.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <type_traits>

namespace baton {
namespace {

/// The fast levels find repetitions only and leave what is not repeated as it is: some per cent
/// larger than level 1, which also shortens frequent bytes, and several times faster both ways.
constexpr int kZstdLevel = -8;

/// Copies the bytes of `count` elements of `stride` bytes: element by element on one side, byte 0
/// of all, then byte 1 of all, ... on the other. Stride: its constant where it is known, so that
/// the loops become vector code.
template <class Stride>
void split(const std::byte* __restrict elements, std::size_t count, Stride stride,
           std::byte* __restrict planes) {
  for (std::size_t plane = 0; plane < stride; ++plane) {
    std::byte* out = planes + plane * count;
    for (std::size_t i = 0; i < count; ++i) out[i] = elements[i * stride + plane];
  }
}
template <class Stride>
void join(const std::byte* __restrict planes, std::size_t count, Stride stride,
          std::byte* __restrict elements) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t plane = 0; plane < stride; ++plane)
      elements[i * stride + plane] = planes[plane * count + i];
  }
}

/// Calls `work` with the stride, as a constant if it is that of a common type.
template <class Work>
void with_stride(std::size_t stride, const Work& work) {
  switch (stride) {
    case 2:
      return work(std::integral_constant<std::size_t, 2>());
    case 4:
      return work(std::integral_constant<std::size_t, 4>());
    default:
      return work(stride);
  }
}

}  // namespace

std::byte* Scratch::at_least(std::size_t size) {
  if (size > capacity_) {
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(size);
    capacity_ = size;
  }
  return bytes_.get();
}

SectionPacker::SectionPacker() : context_(ZSTD_createCCtx()) {}
SectionPacker::~SectionPacker() { ZSTD_freeCCtx(context_); }

bool SectionPacker::append(ByteView payload, std::size_t stride, Packing packing, Bytes& file) {
  BATON_CHECK(stride > 0 && payload.size() % stride == 0);
  ByteView plain = payload;
  if (stride > 1) {
    std::byte* const out = planes_.at_least(plain.size());
    with_stride(stride, [&](auto s) { split(payload.data(), payload.size() / s, s, out); });
    plain = {out, payload.size()};
  }

  // Keep the plain planes when zstd does not shrink them.
  if (packing == Packing::zstd) {
    const std::size_t bound = ZSTD_compressBound(plain.size());
    std::byte* const out = packed_.at_least(bound);
    const std::size_t size =
        ZSTD_compressCCtx(context_, out, bound, plain.data(), plain.size(), kZstdLevel);
    BATON_CHECK(!ZSTD_isError(size));
    if (size < plain.size()) {
      file.insert(file.end(), out, out + size);
      return false;
    }
  }
  file.insert(file.end(), plain.begin(), plain.end());
  return true;
}

SectionUnpacker::SectionUnpacker() : context_(ZSTD_createDCtx()) {}
SectionUnpacker::~SectionUnpacker() { ZSTD_freeDCtx(context_); }

Result<Bytes> SectionUnpacker::unpack(ByteView stored, bool stored_raw, std::size_t stride,
                                      std::size_t raw_bytes) {
  BATON_CHECK(!stored_raw || stored.size() == raw_bytes);
  if (stored_raw && stride == 1) return Bytes(stored.begin(), stored.end());
  Bytes payload(raw_bytes);

  // Without planes the payload is its own scratch.
  const std::byte* planes = stored.data();
  if (!stored_raw) {
    std::byte* const plain = stride > 1 ? planes_.at_least(raw_bytes) : payload.data();
    const std::size_t size =
        ZSTD_decompressDCtx(context_, plain, raw_bytes, stored.data(), stored.size());
    if (ZSTD_isError(size)) {
      return Error{ErrorKind::corrupt, fmt::format("does not unpack: {}", ZSTD_getErrorName(size))};
    }
    if (size != raw_bytes) {
      return Error{ErrorKind::corrupt,
                   fmt::format("unpacks to {} bytes, expected {}", size, raw_bytes)};
    }
    planes = plain;
  }
  if (stride > 1)
    with_stride(stride, [&](auto s) { join(planes, raw_bytes / s, s, payload.data()); });
  return payload;
}

}  // namespace baton
