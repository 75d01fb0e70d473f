#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/members.h"
#include "common/base/ordinal.h"

namespace baton {

/// The byte form of plain structs: members in the order of their declaration, little-endian, no
/// padding. A bool is one byte 0 or 1; an enum its underlying integer; an Ordinal its int32; a
/// string u32 length and bytes; a vector u32 count and elements; an array its elements. Every enum
/// that is archived has a `last_of(Enum)` beside it, found by argument-dependent lookup: larger
/// values are refused.

/// Appends values to a ByteWriter.
class ArchiveWriter {
 public:
  template <class T>
  void operator()(const T& value) {
    write(value);
  }
  Bytes take() { return writer_.take(); }

 private:
  template <class T>
  requires std::is_arithmetic_v<T>
  void write(const T& value) { writer_.put(value); }
  template <class T>
  requires std::is_enum_v<T>
  void write(const T& value) { writer_.put(static_cast<std::underlying_type_t<T>>(value)); }
  template <class Tag>
  void write(Ordinal<Tag> position) {
    writer_.put(position.value());
  }
  void write(const std::string& text) { writer_.put_string(text); }
  template <class T>
  void write(const std::vector<T>& values) {
    writer_.put(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) write(value);
  }
  template <class T, std::size_t N>
  void write(const std::array<T, N>& values) {
    for (const T& value : values) write(value);
  }
  template <class T>
  requires std::is_aggregate_v<T>
  void write(const T& value) {
    std::apply([&](const auto&... members) { (write(members), ...); }, members_of(value));
  }

  ByteWriter writer_;
};

/// Reads what ArchiveWriter wrote. Check complete() once, at the end; after a fault the values are
/// arbitrary.
class ArchiveReader {
 public:
  explicit ArchiveReader(ByteView bytes) : reader_(bytes) {}

  template <class T>
  void operator()(T& value) {
    read(value);
  }
  /// True when every value was there and in range, and nothing is left over.
  bool complete() const { return in_range_ && reader_.ok() && reader_.at_end(); }

 private:
  void read(bool& value) {
    const auto byte = reader_.get<std::uint8_t>();
    in_range_ = in_range_ && byte <= 1;
    value = byte == 1;
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void read(T& value) { value = reader_.get<T>(); }
  template <class T>
  requires std::is_enum_v<T>
  void read(T& value) {
    value = static_cast<T>(reader_.get<std::underlying_type_t<T>>());
    if (value > last_of(value)) {
      in_range_ = false;
      value = last_of(value);
    }
  }
  template <class Tag>
  void read(Ordinal<Tag>& position) {
    position = Ordinal<Tag>(reader_.get<std::int32_t>());
  }
  void read(std::string& text) { text = reader_.get_string(); }
  template <class T>
  void read(std::vector<T>& values) {
    // Grow with what is really there: the count alone must not reserve memory.
    const auto count = reader_.get<std::uint32_t>();
    values.clear();
    for (std::uint32_t i = 0; i < count && reader_.ok(); ++i) read(values.emplace_back());
  }
  template <class T, std::size_t N>
  void read(std::array<T, N>& values) {
    for (T& value : values) read(value);
  }
  template <class T>
  requires std::is_aggregate_v<T>
  void read(T& value) {
    std::apply([&](auto&... members) { (read(members), ...); }, members_of(value));
  }

  ByteReader reader_;
  bool in_range_ = true;
};

/// The bytes of one value.
template <class T>
Bytes to_bytes(const T& value) {
  ArchiveWriter writer;
  writer(value);
  return writer.take();
}

}  // namespace baton
