#include "common/scene/texture/jpeg_form.h"

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace baton {
namespace {

// Second bytes of markers [ITU-T T.81, table B.1].
constexpr int kStart = 0xD8, kEnd = 0xD9, kScan = 0xDA, kFirstRestart = 0xD0, kTemporary = 0x01;
constexpr int kFirstFrame = 0xC0, kLastFrame = 0xCF, kHuffman = 0xC4, kReserved = 0xC8,
              kArithmetic = 0xCC, kAdobe = 0xEE;

struct JpegForm {
  int components = 0;
  bool has_adobe = false, has_end = false;
};

bool has_no_length(int code) {
  return code == kTemporary || (code >= kFirstRestart && code <= kStart);
}
bool is_frame(int code) {
  return code >= kFirstFrame && code <= kLastFrame && code != kHuffman && code != kReserved &&
         code != kArithmetic;
}

/// Walks over the segments; between them, and in a scan, up to the next marker.
JpegForm form_of(ByteView bytes) {
  const auto byte = [&](std::size_t i) { return std::to_integer<int>(bytes[i]); };
  JpegForm form;
  std::size_t at = 2;
  while (at + 1 < bytes.size()) {
    const int code = byte(at + 1);
    // 0 follows a byte of data, another 0xFF fills.
    if (byte(at) != 0xFF || code == 0 || code == 0xFF) {
      ++at;
      continue;
    }
    at += 2;
    if (code == kEnd) {
      form.has_end = true;
      return form;
    }
    if (has_no_length(code)) continue;
    if (at + 2 > bytes.size()) return form;
    const auto length = static_cast<std::size_t>(byte(at) << 8 | byte(at + 1));
    if (at + length > bytes.size()) return form;
    if (is_frame(code) && length > 7) form.components = byte(at + 7);
    constexpr char kName[] = "Adobe";
    if (code == kAdobe && length >= 7 && std::memcmp(bytes.data() + at + 2, kName, 5) == 0)
      form.has_adobe = true;
    at += length;
  }
  return form;
}

}  // namespace

bool is_jpeg(ByteView bytes) {
  return bytes.size() > 2 && bytes[0] == std::byte{0xFF} && bytes[1] == std::byte{kStart};
}

std::vector<std::string> jpeg_notes(ByteView bytes) {
  const JpegForm form = form_of(bytes);
  std::vector<std::string> notes;
  if (!form.has_end)
    notes.emplace_back("ends early, without its mark: a part of the picture may be missing");
  if (form.components == 4 && !form.has_adobe)
    notes.emplace_back(
        "is CMYK without Adobe's mark: it is read as if it had one, as amounts of light");
  return notes;
}

}  // namespace baton
