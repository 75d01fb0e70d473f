#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace baton {

static_assert(std::endian::native == std::endian::little,
              "stored and sent integers are little-endian");

/// Raw bytes of a blob, a message body or a file.
using Bytes = std::vector<std::byte>;
using ByteView = std::span<const std::byte>;

inline ByteView as_bytes_view(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// Appends little-endian values to a byte vector. Strings are u32 length then bytes.
class ByteWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { put_raw(std::as_bytes(std::span(&value, 1))); }
  void put_raw(ByteView bytes) {
    if (bytes.empty()) return;
    const std::size_t old_size = bytes_.size();
    bytes_.resize(old_size + bytes.size());
    std::memcpy(bytes_.data() + old_size, bytes.data(), bytes.size());
  }
  void put_string(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    put_raw(as_bytes_view(text));
  }
  std::size_t size() const { return bytes_.size(); }
  const Bytes& bytes() const { return bytes_; }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
};

/// Reads what ByteWriter wrote. Past the end every read gives zero and ok() is false: check once,
/// at the end.
class ByteReader {
 public:
  explicit ByteReader(ByteView bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> T get() {
    T value{};
    if (const ByteView raw = get_raw(sizeof(T)); !raw.empty())
      std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }
  /// `count` bytes, or an empty view when fewer are left.
  ByteView get_raw(std::size_t count) {
    if (!ok_ || count > bytes_.size() - position_) {
      ok_ = false;
      return {};
    }
    const ByteView raw = bytes_.subspan(position_, count);
    position_ += count;
    return raw;
  }
  std::string get_string() {
    const ByteView raw = get_raw(get<std::uint32_t>());
    return {reinterpret_cast<const char*>(raw.data()), raw.size()};
  }
  bool ok() const { return ok_; }
  bool at_end() const { return position_ == bytes_.size(); }
  std::size_t position() const { return position_; }
  std::size_t remaining() const { return bytes_.size() - position_; }

 private:
  ByteView bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace baton
