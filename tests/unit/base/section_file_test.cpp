#include "common/base/section_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "common/base/digest.h"

namespace baton {
namespace {

using testing::HasSubstr;

constexpr SectionTag kMagic{'T', 'S', 'T', '1'};
constexpr SectionTag kPlain{'P', 'L', 'N', '_'};
constexpr SectionTag kFloats{'F', 'L', 'T', '_'};
constexpr std::size_t kEntryAt = 16;
constexpr std::size_t kEntryBytes = 28;

Bytes bytes_of(std::string_view text) {
  const ByteView view = as_bytes_view(text);
  return {view.begin(), view.end()};
}

/// One short section that zstd cannot shrink and one of 4-byte elements that it can.
SectionFile small_file() {
  ByteWriter floats;
  for (int i = 0; i < 100; ++i) floats.put(1.0f + static_cast<float>(i) / 1024);
  return {kMagic, 1, {{kPlain, false, 1, bytes_of("raw!")}, {kFloats, true, 4, floats.take()}}};
}

Result<SectionFile> decode(ByteView bytes) {
  return decode_section_file(bytes, kMagic, 1, "a.tst");
}

/// Overwrites `value` at `offset`, then mends the checksum of header and table.
template <class T>
Bytes forged(Bytes bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(value));
  std::uint32_t header_bytes = 0;
  std::memcpy(&header_bytes, bytes.data() + 8, sizeof(header_bytes));
  const std::uint32_t checksum = checksum32(ByteView(bytes).first(header_bytes - 4));
  std::memcpy(bytes.data() + header_bytes - 4, &checksum, sizeof(checksum));
  return bytes;
}

TEST(SectionFile, GivesBackWhatWentIn) {
  const SectionFile file = small_file();
  const Result<SectionFile> decoded = decode(encode_section_file(file));
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->sections.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(decoded->sections[i].tag, file.sections[i].tag);
    EXPECT_EQ(decoded->sections[i].required, file.sections[i].required);
    EXPECT_EQ(decoded->sections[i].stride, file.sections[i].stride);
    EXPECT_EQ(decoded->sections[i].payload, file.sections[i].payload);
  }
  EXPECT_EQ(decoded->find(kFloats), &decoded->sections[1]);
  EXPECT_EQ(decoded->find({'N', 'O', 'N', 'E'}), nullptr);
}

TEST(SectionFile, IsDeterministic) {
  EXPECT_EQ(encode_section_file(small_file()), encode_section_file(small_file()));
}

TEST(SectionFile, EmptyFilesAndEmptySectionsAreFine) {
  const SectionFile none{kMagic, 1, {}};
  const Result<SectionFile> decoded_none = decode(encode_section_file(none));
  ASSERT_TRUE(decoded_none.ok()) << decoded_none.error().message;
  EXPECT_TRUE(decoded_none->sections.empty());

  const SectionFile hollow{kMagic, 1, {{kPlain, true, 4, {}}}};
  const Result<SectionFile> decoded_hollow = decode(encode_section_file(hollow));
  ASSERT_TRUE(decoded_hollow.ok()) << decoded_hollow.error().message;
  EXPECT_TRUE(decoded_hollow->sections[0].payload.empty());
}

TEST(SectionFile, ListsTheTableAndStoresRawWhatDoesNotShrink) {
  const Bytes bytes = encode_section_file(small_file());
  const auto sections = list_sections(bytes, kMagic, 1, "a.tst");
  ASSERT_TRUE(sections.ok()) << sections.error().message;
  ASSERT_EQ(sections->size(), 2u);
  EXPECT_EQ((*sections)[0].stored_bytes, 4u);
  EXPECT_EQ((*sections)[0].raw_bytes, 4u);
  EXPECT_EQ((*sections)[1].raw_bytes, 400u);
  EXPECT_LT((*sections)[1].stored_bytes, 300u);
  EXPECT_EQ(tag_text((*sections)[1].tag), "FLT_");
  EXPECT_EQ(tag_text({'A', '\n', '\0', '\xFF'}), "A???");
}

TEST(SectionFile, AnyChangedByteIsAnError) {
  const Bytes good = encode_section_file(small_file());
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      Bytes bad = good;
      bad[i] ^= static_cast<std::byte>(flip);
      EXPECT_FALSE(decode(bad).ok()) << "byte " << i << " xor " << flip;
    }
  }
}

TEST(SectionFile, AnyTruncationAndAnyTailIsAnError) {
  Bytes bytes = encode_section_file(small_file());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode(ByteView(bytes).first(size)).ok()) << size << " bytes";
  }
  bytes.push_back(std::byte{0});
  const auto decoded = decode(bytes);
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().message, "a.tst: has 1 bytes after its last section, expected none");
}

TEST(SectionFile, AWrongChecksumNamesFileSectionAndBothSums) {
  Bytes bytes = encode_section_file(small_file());
  bytes.back() ^= std::byte{1};
  const auto decoded = decode(bytes);
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().kind, ErrorKind::corrupt);
  EXPECT_THAT(decoded.error().message,
              testing::MatchesRegex("a.tst: section FLT_ checksum [0-9a-f]+, expected [0-9a-f]+"));
}

TEST(SectionFile, AnotherMagicIsAnotherKindOfFile) {
  const Bytes bytes = encode_section_file(small_file());
  const auto decoded = decode_section_file(bytes, {'B', 'S', 'T', '1'}, 1, "a.tst");
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(decoded.error().message, HasSubstr("a.tst: does not start with BST1"));
}

TEST(SectionFile, ANewerVersionIsRefusedByName) {
  SectionFile file = small_file();
  file.version = 3;
  const auto decoded = decode(encode_section_file(file));
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().kind, ErrorKind::version);
  EXPECT_EQ(decoded.error().message, "a.tst: version 3, this program reads 1 to 1");
  EXPECT_TRUE(decode_section_file(encode_section_file(file), kMagic, 3, "a.tst").ok());
}

TEST(SectionFile, UnknownFlagsAreRefused) {
  const Bytes bytes = encode_section_file(small_file());
  const auto decoded = decode(forged<std::uint8_t>(bytes, kEntryAt + 4, 0x04));
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().kind, ErrorKind::version);
  EXPECT_THAT(decoded.error().message, HasSubstr("section PLN_ has flags 0x04"));
}

TEST(SectionFile, ForgedTablesAreRefusedBeforeAnythingIsAllocated) {
  const Bytes bytes = encode_section_file(small_file());
  const std::size_t second = kEntryAt + kEntryBytes;
  struct Case {
    Bytes bytes;
    const char* message;
  };
  const Case cases[] = {
      {forged<std::uint64_t>(bytes, second + 16, 1ull << 40), "cannot unpack from"},
      {forged<std::uint64_t>(bytes, second + 16, ~0ull - 3), "cannot unpack from"},
      {forged<std::uint64_t>(bytes, second + 16, 404), "unpacks to 400 bytes, expected 404"},
      {forged<std::uint64_t>(bytes, second + 16, 396), "does not unpack"},
      {forged<std::uint64_t>(bytes, second + 16, 401), "401 bytes in elements of 4"},
      {forged<std::uint64_t>(bytes, second + 8, 1ull << 50), "expected 1125899906842624"},
      {forged<std::uint64_t>(bytes, kEntryAt + 16, 5), "is stored as it is in 4 bytes, expected 5"},
      {forged<std::uint8_t>(bytes, second + 5, 0), "in elements of 0"},
      {forged<std::uint16_t>(bytes, second + 6, 1), "reserved field"},
      {forged<SectionTag>(bytes, second, kPlain), "section PLN_ is there twice"},
      {forged<std::uint32_t>(bytes, 12, 1), "header of 2 sections"},
  };
  for (const Case& c : cases) {
    const auto decoded = decode(c.bytes);
    ASSERT_FALSE(decoded.ok()) << c.message;
    EXPECT_THAT(decoded.error().message, HasSubstr(c.message));
  }
}

TEST(SectionFile, ASmallFileOfManyZerosUnpacksButNotPastTheLimit) {
  // 64 MiB of zeros stay far above the smallest size that zstd could reach.
  const SectionFile zeros{kMagic, 1, {{kPlain, true, 4, Bytes(64 << 20)}}};
  const Bytes bytes = encode_section_file(zeros);
  EXPECT_LT(bytes.size(), 16384u);
  EXPECT_TRUE(decode(bytes).ok());

  // A frame that could be that small is still refused past 4 GiB.
  const Bytes large = forged<std::uint64_t>(bytes, kEntryAt + 8, 1ull << 20);
  const auto decoded = decode(forged<std::uint64_t>(large, kEntryAt + 16, (4ull << 30) + 4));
  ASSERT_FALSE(decoded.ok());
  EXPECT_THAT(decoded.error().message, HasSubstr("past the limit of 4294967296 bytes"));
}

TEST(SectionFile, UnknownSectionsMatterOnlyWhenRequired) {
  SectionFile file = small_file();
  const SectionTag known[] = {kFloats};
  EXPECT_TRUE(check_known_sections(file, known, "a.tst").ok());
  file.sections[0].required = true;
  const Status status = check_known_sections(file, known, "a.tst");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::version);
  EXPECT_THAT(status.error().message, HasSubstr("a.tst: section PLN_ is required but unknown"));
}

TEST(SectionFile, APayloadMustBeThereWithItsSize) {
  const SectionFile file = small_file();
  EXPECT_TRUE(section_payload(file, kFloats, 400, "a.tst").ok());
  EXPECT_EQ(section_payload(file, kFloats, 404, "a.tst").error().message,
            "a.tst: section FLT_ has 400 bytes, expected 404");
  EXPECT_EQ(section_payload(file, {'N', 'O', 'N', 'E'}, 0, "a.tst").error().message,
            "a.tst: section NONE is missing");
}

}  // namespace
}  // namespace baton
