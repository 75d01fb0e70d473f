#include "common/base/section_file.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <type_traits>

#include "common/base/digest.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr std::uint8_t kFlagRequired = 1;
constexpr std::uint8_t kFlagStoredRaw = 2;
constexpr std::size_t kHeaderBytes = 16;
constexpr std::size_t kEntryBytes = 28;
constexpr std::size_t kChecksumBytes = sizeof(std::uint32_t);
constexpr int kZstdLevel = 1;
/// No zstd frame unpacks to more than this many times its size: 4 bytes make a block of at most 128
/// KiB [RFC 8878].
constexpr std::uint64_t kMaxExpansion = (128 << 10) / 4;

/// One checked row of the table with the bytes it points to.
struct TableEntry {
  SectionTag tag{};
  std::uint8_t flags = 0;
  std::uint8_t stride = 1;
  std::uint64_t stored_bytes = 0;
  std::uint64_t raw_bytes = 0;
  std::uint32_t checksum = 0;
  ByteView stored;
};

struct Table {
  std::uint16_t version = 0;
  std::vector<TableEntry> entries;
};

constexpr std::size_t table_end(std::size_t num_sections) {
  return kHeaderBytes + num_sections * kEntryBytes + kChecksumBytes;
}

Error file_error(ErrorKind kind, const std::string& name, const std::string& what) {
  return {kind, name + ": " + what};
}

Error section_error(ErrorKind kind, const std::string& name, const SectionTag& tag,
                    const std::string& what) {
  return {kind, fmt::format("{}: section {} {}", name, tag_text(tag), what)};
}

/// Copies the bytes of `count` elements of `stride` bytes: element by element on one side, byte 0
/// of all, then byte 1 of all, ... on the other. Stride: its constant where it is known, so that
/// the loops become vector code.
template <class Stride>
void split(const std::byte* elements, std::size_t count, Stride stride, std::byte* planes) {
  for (std::size_t plane = 0; plane < stride; ++plane) {
    std::byte* out = planes + plane * count;
    for (std::size_t i = 0; i < count; ++i) out[i] = elements[i * stride + plane];
  }
}
template <class Stride>
void join(const std::byte* planes, std::size_t count, Stride stride, std::byte* elements) {
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

/// Byte 0 of all elements, then byte 1 of all elements, ...
Bytes split_planes(ByteView bytes, std::size_t stride) {
  Bytes planes(bytes.size());
  with_stride(stride, [&](auto s) { split(bytes.data(), bytes.size() / s, s, planes.data()); });
  return planes;
}

/// Inverse of split_planes.
Bytes join_planes(ByteView planes, std::size_t stride) {
  Bytes bytes(planes.size());
  with_stride(stride, [&](auto s) { join(planes.data(), planes.size() / s, s, bytes.data()); });
  return bytes;
}

/// The stored form of a payload and its flags.
std::pair<Bytes, std::uint8_t> pack_section(const Section& section) {
  BATON_CHECK(section.stride > 0 && section.payload.size() % section.stride == 0);
  std::uint8_t flags = section.required ? kFlagRequired : 0;
  Bytes planes =
      section.stride > 1 ? split_planes(section.payload, section.stride) : section.payload;

  // Keep the plain planes when zstd does not shrink them.
  Bytes packed(ZSTD_compressBound(planes.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), kZstdLevel);
  BATON_CHECK(!ZSTD_isError(size));
  if (size >= planes.size())
    return {std::move(planes), static_cast<std::uint8_t>(flags | kFlagStoredRaw)};
  packed.resize(size);
  return {std::move(packed), flags};
}

Result<Section> unpack_section(const TableEntry& entry, const std::string& name) {
  Section section{entry.tag, (entry.flags & kFlagRequired) != 0, entry.stride, {}};
  if ((entry.flags & kFlagStoredRaw) != 0) {
    section.payload.assign(entry.stored.begin(), entry.stored.end());
  } else {
    section.payload.resize(entry.raw_bytes);
    const std::size_t size = ZSTD_decompress(section.payload.data(), section.payload.size(),
                                             entry.stored.data(), entry.stored.size());
    if (ZSTD_isError(size)) {
      return section_error(ErrorKind::corrupt, name, entry.tag,
                           fmt::format("does not unpack: {}", ZSTD_getErrorName(size)));
    }
    if (size != entry.raw_bytes) {
      return section_error(ErrorKind::corrupt, name, entry.tag,
                           fmt::format("unpacks to {} bytes, expected {}", size, entry.raw_bytes));
    }
  }
  if (entry.stride > 1) section.payload = join_planes(section.payload, entry.stride);
  return section;
}

/// Magic, version, section count and the checksum of header and table. Returns (version, section
/// count).
Result<std::pair<std::uint16_t, std::uint16_t>> read_header(ByteView bytes, const SectionTag& magic,
                                                            std::uint16_t max_version,
                                                            const std::string& name) {
  ByteReader reader(bytes);
  const ByteView found_magic = reader.get_raw(magic.size());
  const bool same_magic = std::ranges::equal(found_magic, std::as_bytes(std::span(magic)));
  if (!same_magic) {
    return file_error(
        ErrorKind::bad_input, name,
        fmt::format("does not start with {}, so it is not this kind of file", tag_text(magic)));
  }

  // The version comes first: a newer layout may differ in everything behind it.
  const auto version = reader.get<std::uint16_t>();
  const auto num_sections = reader.get<std::uint16_t>();
  const auto header_bytes = reader.get<std::uint32_t>();
  const auto reserved = reader.get<std::uint32_t>();
  if (!reader.ok()) {
    return file_error(
        ErrorKind::corrupt, name,
        fmt::format("ends in the header: {} bytes, expected {}", bytes.size(), kHeaderBytes));
  }
  if (version == 0 || version > max_version) {
    return file_error(ErrorKind::version, name,
                      fmt::format("version {}, this program reads 1 to {}", version, max_version));
  }
  if (num_sections > limits::kMaxSections || header_bytes != table_end(num_sections) ||
      reserved != 0) {
    return file_error(
        ErrorKind::corrupt, name,
        fmt::format("header of {} sections and {} bytes, expected {} bytes and at most {} sections",
                    num_sections, header_bytes, table_end(num_sections), limits::kMaxSections));
  }
  if (bytes.size() < header_bytes) {
    return file_error(ErrorKind::corrupt, name,
                      fmt::format("ends in the table: {} bytes, expected at least {}", bytes.size(),
                                  header_bytes));
  }

  // Nothing of the table is believed before its checksum.
  ByteReader tail(bytes.subspan(header_bytes - kChecksumBytes));
  const auto expected = tail.get<std::uint32_t>();
  const std::uint32_t found = checksum32(bytes.first(header_bytes - kChecksumBytes));
  if (found != expected) {
    return file_error(ErrorKind::corrupt, name,
                      fmt::format("header checksum {:08x}, expected {:08x}", found, expected));
  }
  return std::pair{version, num_sections};
}

/// Checks one row on its own: flags, stride, sizes.
Status check_entry(const TableEntry& entry, const std::string& name) {
  const auto fail = [&](const std::string& what) {
    return section_error(ErrorKind::corrupt, name, entry.tag, what);
  };
  if ((entry.flags & ~(kFlagRequired | kFlagStoredRaw)) != 0) {
    return section_error(
        ErrorKind::version, name, entry.tag,
        fmt::format("has flags {:#04x}, this program knows 0x01 and 0x02", entry.flags));
  }
  if (entry.stride == 0 || entry.raw_bytes % entry.stride != 0) {
    return fail(fmt::format("has {} bytes in elements of {}", entry.raw_bytes, entry.stride));
  }
  const bool raw = (entry.flags & kFlagStoredRaw) != 0;
  if (raw && entry.raw_bytes != entry.stored_bytes) {
    return fail(fmt::format("is stored as it is in {} bytes, expected {}", entry.stored_bytes,
                            entry.raw_bytes));
  }
  if (!raw && entry.raw_bytes / kMaxExpansion > entry.stored_bytes) {
    return fail(
        fmt::format("cannot unpack from {} to {} bytes", entry.stored_bytes, entry.raw_bytes));
  }
  return {};
}

/// The whole table with every check that needs no unpacking.
Result<Table> read_table(ByteView bytes, const SectionTag& magic, std::uint16_t max_version,
                         const std::string& name) {
  BATON_ASSIGN(const auto header, read_header(bytes, magic, max_version, name));
  const auto [version, num_sections] = header;
  Table table{version, {}};
  ByteReader rows(bytes.subspan(kHeaderBytes, num_sections * kEntryBytes));
  ByteReader payloads(bytes.subspan(table_end(num_sections)));
  std::uint64_t total_raw_bytes = 0;
  for (int i = 0; i < num_sections; ++i) {
    // Read the row.
    TableEntry entry;
    for (char& letter : entry.tag) letter = rows.get<char>();
    entry.flags = rows.get<std::uint8_t>();
    entry.stride = rows.get<std::uint8_t>();
    const auto reserved = rows.get<std::uint16_t>();
    entry.stored_bytes = rows.get<std::uint64_t>();
    entry.raw_bytes = rows.get<std::uint64_t>();
    entry.checksum = rows.get<std::uint32_t>();
    const auto fail = [&](const std::string& what) {
      return section_error(ErrorKind::corrupt, name, entry.tag, what);
    };

    // Check it alone, then against its neighbours and the limits.
    if (reserved != 0) return fail("has a reserved field that is not 0");
    BATON_TRY(check_entry(entry, name));
    const auto same_tag = [&](const TableEntry& other) { return other.tag == entry.tag; };
    if (std::ranges::any_of(table.entries, same_tag)) return fail("is there twice");
    if (entry.raw_bytes > limits::kMaxBlobBytes - total_raw_bytes) {
      return fail(fmt::format("unpacks past the limit of {} bytes a file", limits::kMaxBlobBytes));
    }
    total_raw_bytes += entry.raw_bytes;

    // Check its bytes.
    if (entry.stored_bytes > payloads.remaining()) {
      return fail(
          fmt::format("has {} bytes, expected {}", payloads.remaining(), entry.stored_bytes));
    }
    entry.stored = payloads.get_raw(entry.stored_bytes);
    const std::uint32_t found = checksum32(entry.stored);
    if (found != entry.checksum)
      return fail(fmt::format("checksum {:08x}, expected {:08x}", found, entry.checksum));
    table.entries.push_back(entry);
  }
  if (!payloads.at_end()) {
    return file_error(
        ErrorKind::corrupt, name,
        fmt::format("has {} bytes after its last section, expected none", payloads.remaining()));
  }
  return table;
}

}  // namespace

const Section* SectionFile::find(const SectionTag& tag) const {
  const auto it = std::ranges::find(sections, tag, &Section::tag);
  return it == sections.end() ? nullptr : &*it;
}

std::string tag_text(const SectionTag& tag) {
  std::string text(tag.begin(), tag.end());
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

Bytes encode_section_file(const SectionFile& file) {
  BATON_CHECK(file.version > 0 && file.sections.size() <= limits::kMaxSections);

  // Write the header.
  ByteWriter writer;
  writer.put_raw(std::as_bytes(std::span(file.magic)));
  writer.put(file.version);
  writer.put(static_cast<std::uint16_t>(file.sections.size()));
  writer.put(static_cast<std::uint32_t>(table_end(file.sections.size())));
  writer.put(std::uint32_t{0});

  // Write the table.
  ByteWriter payloads;
  for (const Section& section : file.sections) {
    BATON_CHECK(file.find(section.tag) == &section);
    const auto [stored, flags] = pack_section(section);
    writer.put_raw(std::as_bytes(std::span(section.tag)));
    writer.put(flags);
    writer.put(section.stride);
    writer.put(std::uint16_t{0});
    writer.put(static_cast<std::uint64_t>(stored.size()));
    writer.put(static_cast<std::uint64_t>(section.payload.size()));
    writer.put(checksum32(stored));
    payloads.put_raw(stored);
  }

  // Seal both and append the payloads.
  writer.put(checksum32(writer.bytes()));
  writer.put_raw(payloads.bytes());
  return writer.take();
}

Result<SectionFile> decode_section_file(ByteView bytes, const SectionTag& magic,
                                        std::uint16_t max_version, const std::string& name) {
  BATON_ASSIGN(const Table table, read_table(bytes, magic, max_version, name));
  SectionFile file{magic, table.version, {}};
  for (const TableEntry& entry : table.entries) {
    BATON_ASSIGN(Section section, unpack_section(entry, name));
    file.sections.push_back(std::move(section));
  }
  return file;
}

Result<std::vector<SectionInfo>> list_sections(ByteView bytes, const SectionTag& magic,
                                               std::uint16_t max_version, const std::string& name) {
  BATON_ASSIGN(const Table table, read_table(bytes, magic, max_version, name));
  std::vector<SectionInfo> infos;
  for (const TableEntry& entry : table.entries) {
    infos.push_back({entry.tag, (entry.flags & kFlagRequired) != 0, entry.stride,
                     entry.stored_bytes, entry.raw_bytes});
  }
  return infos;
}

Status check_known_sections(const SectionFile& file, std::span<const SectionTag> known,
                            const std::string& name) {
  for (const Section& section : file.sections) {
    if (section.required && std::ranges::find(known, section.tag) == known.end()) {
      return section_error(
          ErrorKind::version, name, section.tag,
          "is required but unknown to this program: a newer version made the file");
    }
  }
  return {};
}

Result<ByteView> section_payload(const SectionFile& file, const SectionTag& tag,
                                 std::uint64_t expected_bytes, const std::string& name) {
  const Section* section = file.find(tag);
  if (section == nullptr) return section_error(ErrorKind::corrupt, name, tag, "is missing");
  if (section->payload.size() != expected_bytes) {
    return section_error(
        ErrorKind::corrupt, name, tag,
        fmt::format("has {} bytes, expected {}", section->payload.size(), expected_bytes));
  }
  return ByteView(section->payload);
}

}  // namespace baton
