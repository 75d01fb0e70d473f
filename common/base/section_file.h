#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"
#include "common/base/section_packing.h"

namespace baton {

/// The container shared by sample states (.bst) and tile films (.btf): a header, a table of tagged
/// sections, zstd payloads, a checksum on everything. common/state/FORMAT.md is the grammar; this
/// header repeats only the constants.

/// Four ASCII letters. Tags are never reused.
using SectionTag = std::array<char, 4>;

struct Section {
  SectionTag tag{};
  /// A reader that does not know a required tag must refuse the file.
  bool required = true;
  /// Bytes of one element; where it is > 1, bytes are stored plane by plane, which packs better.
  std::uint8_t stride = 1;
  Bytes payload;  ///< uncompressed
};

/// A section to be written, whose payload lies somewhere else.
struct SectionView {
  SectionTag tag{};
  bool required = true;
  std::uint8_t stride = 1;
  ByteView payload;
  Packing packing = Packing::zstd;  ///< none: for what does not shrink
};

struct SectionFile {
  SectionTag magic{};
  std::uint16_t version = 1;
  std::vector<Section> sections;  ///< in file order

  /// The section with the tag, or nullptr.
  const Section* find(const SectionTag& tag) const;
};

/// One row of the table, without the payload.
struct SectionInfo {
  SectionTag tag{};
  bool required = true;
  std::uint8_t stride = 1;
  std::uint64_t stored_bytes = 0;
  std::uint64_t raw_bytes = 0;
};

/// The tag for people; a byte that is not printable ASCII becomes '?'.
std::string tag_text(const SectionTag& tag);

/// Deterministic: equal contents give equal bytes (with one version of zstd). Tags must differ, and
/// a stride must divide the size of its payload.
Bytes encode_sections(const SectionTag& magic, std::uint16_t version,
                      std::span<const SectionView> sections);
/// The same of sections that own their payloads.
Bytes encode_section_file(const SectionFile& file);

/// `name` goes first in every error. `max_version` is the newest version that the caller reads.
/// Checks magic, version, sizes against limits, every checksum. Any single changed byte is an
/// error.
Result<SectionFile> decode_section_file(ByteView bytes, const SectionTag& magic,
                                        std::uint16_t max_version, const std::string& name);

/// The table of a file that passes the same checks, in file order; nothing is unpacked.
Result<std::vector<SectionInfo>> list_sections(ByteView bytes, const SectionTag& magic,
                                               std::uint16_t max_version, const std::string& name);

/// ErrorKind::version when `file` has a required section that is not in `known`; optional strangers
/// are fine.
Status check_known_sections(const SectionFile& file, std::span<const SectionTag> known,
                            const std::string& name);

/// The payload of a section that must be there with exactly `expected_bytes` bytes.
Result<ByteView> section_payload(const SectionFile& file, const SectionTag& tag,
                                 std::uint64_t expected_bytes, const std::string& name);

}  // namespace baton
