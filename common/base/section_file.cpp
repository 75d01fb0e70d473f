#include "common/base/section_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/digest.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr std::uint8_t kFlagRequired = 1;
constexpr std::uint8_t kFlagStoredRaw = 2;
constexpr std::size_t kHeaderBytes = 16;
constexpr std::size_t kEntryBytes = 28;
constexpr std::size_t kChecksumBytes = sizeof(std::uint32_t);

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

Result<Section> unpack_section(SectionUnpacker& unpacker, const TableEntry& entry,
                               const std::string& name) {
  Result<Bytes> payload = unpacker.unpack(entry.stored, (entry.flags & kFlagStoredRaw) != 0,
                                          entry.stride, entry.raw_bytes);
  if (!payload)
    return section_error(payload.error().kind, name, entry.tag, payload.error().message);
  return Section{entry.tag, (entry.flags & kFlagRequired) != 0, entry.stride,
                 std::move(payload.value())};
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

Bytes encode_sections(const SectionTag& magic, std::uint16_t version,
                      std::span<const SectionView> sections) {
  BATON_CHECK(version > 0 && sections.size() <= limits::kMaxSections);

  // Start the header and the table.
  ByteWriter head;
  head.put_raw(std::as_bytes(std::span(magic)));
  head.put(version);
  head.put(static_cast<std::uint16_t>(sections.size()));
  head.put(static_cast<std::uint32_t>(table_end(sections.size())));
  head.put(std::uint32_t{0});

  // Pack the payloads behind them, and note each in the table.
  std::size_t most = table_end(sections.size());
  for (const SectionView& section : sections) most += section.payload.size();
  Bytes bytes;
  bytes.reserve(most);
  bytes.resize(table_end(sections.size()));
  static thread_local SectionPacker packer;  // its memory is worth keeping
  for (const SectionView& section : sections) {
    BATON_CHECK(&*std::ranges::find(sections, section.tag, &SectionView::tag) == &section);
    const std::size_t start = bytes.size();
    const bool raw = packer.append(section.payload, section.stride, section.packing, bytes);
    const int flags = (section.required ? kFlagRequired : 0) | (raw ? kFlagStoredRaw : 0);
    head.put_raw(std::as_bytes(std::span(section.tag)));
    head.put(static_cast<std::uint8_t>(flags));
    head.put(section.stride);
    head.put(std::uint16_t{0});
    head.put(static_cast<std::uint64_t>(bytes.size() - start));
    head.put(static_cast<std::uint64_t>(section.payload.size()));
    head.put(checksum32(ByteView(bytes).subspan(start)));
  }

  // Seal both and put them in front.
  head.put(checksum32(head.bytes()));
  std::ranges::copy(head.bytes(), bytes.begin());
  return bytes;
}

Bytes encode_section_file(const SectionFile& file) {
  std::vector<SectionView> views;
  for (const Section& s : file.sections)
    views.push_back(
        {.tag = s.tag, .required = s.required, .stride = s.stride, .payload = s.payload});
  return encode_sections(file.magic, file.version, views);
}

Result<SectionFile> decode_section_file(ByteView bytes, const SectionTag& magic,
                                        std::uint16_t max_version, const std::string& name) {
  BATON_ASSIGN(const Table table, read_table(bytes, magic, max_version, name));
  SectionFile file{magic, table.version, {}};
  static thread_local SectionUnpacker unpacker;
  for (const TableEntry& entry : table.entries) {
    BATON_ASSIGN(Section section, unpack_section(unpacker, entry, name));
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
