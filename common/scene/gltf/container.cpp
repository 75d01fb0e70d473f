#include "common/scene/gltf/container.h"

#include <fmt/format.h>

#include <cstdio>
#include <cstring>
#include <filesystem>

namespace baton::gltf {
namespace {

constexpr std::size_t kHeader = 12, kChunkHeader = 8;
constexpr std::uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

std::uint32_t word_at(ByteView bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof(word));  // little-endian, as the machine
  return word;
}

std::string_view as_text(ByteView bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::optional<Bytes> decode_base64(std::string_view text) {
  const auto value_of = [](char c) -> int {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    if (c == '+') return 62;
    return c == '/' ? 63 : -1;
  };
  while (text.ends_with('=')) text.remove_suffix(1);
  Bytes bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = value_of(c);
    if (value < 0) return std::nullopt;
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> count & 0xFF));
  }
  return bytes;
}

/// %20 and its like.
std::string decode_percent(std::string_view text) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::sscanf(std::string(text.substr(i + 1, 2)).c_str(), "%2x", &value) == 1) {
      decoded += static_cast<char>(value);
      i += 2;
    } else {
      decoded += text[i];
    }
  }
  return decoded;
}

}  // namespace

Result<Container> open_container(ByteView bytes, const std::string& name) {
  if (!as_text(bytes).starts_with("glTF")) return Container{as_text(bytes), {}};
  const auto bad = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, name + ": not a glTF file: " + what};
  };
  if (bytes.size() < kHeader + kChunkHeader) return bad("cut in its header");
  if (const std::uint32_t version = word_at(bytes, 4); version != 2)
    return bad(fmt::format("expected version 2 of GLB, got {}", version));
  const std::size_t length = word_at(bytes, 8);
  if (length > bytes.size())
    return bad(fmt::format("expected {} bytes, got {}", length, bytes.size()));

  Container container;
  std::size_t at = kHeader;
  while (at + kChunkHeader <= length) {
    const std::size_t size = word_at(bytes, at);
    const std::uint32_t kind = word_at(bytes, at + 4);
    at += kChunkHeader;
    if (size > length - at)
      return bad(fmt::format("expected {} bytes in a chunk, got {}", size, length - at));
    const ByteView chunk = bytes.subspan(at, size);
    if (at == kHeader + kChunkHeader && kind != kJsonChunk)
      return bad("expected its JSON in the first chunk");
    if (kind == kJsonChunk && container.json.empty()) container.json = as_text(chunk);
    if (kind == kBinaryChunk && !container.binary) container.binary = chunk;
    at += size;
  }
  return container;
}

Result<Resource> resolve_uri(const std::string& uri, const std::string& path) {
  if (!uri.starts_with("data:")) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    return Resource{{}, (folder / decode_percent(uri)).lexically_normal().string()};
  }
  const std::size_t comma = uri.find(',');
  const std::string_view start = std::string_view(uri).substr(0, comma);
  if (comma == uri.npos || !start.ends_with(";base64"))
    return Error{ErrorKind::bad_input, "expected data in base64"};
  std::optional<Bytes> bytes = decode_base64(std::string_view(uri).substr(comma + 1));
  if (!bytes) return Error{ErrorKind::bad_input, "expected data in base64, got another letter"};
  return Resource{std::move(bytes), {}};
}

}  // namespace baton::gltf
