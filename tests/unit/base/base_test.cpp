#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/exit_codes.h"
#include "common/base/result.h"

namespace baton {
namespace {

Result<int> half_of(int number) {
  if (number % 2 != 0) return Error{ErrorKind::bad_input, "odd"};
  return number / 2;
}

Result<int> quarter_of(int number) {
  BATON_ASSIGN(const int half, half_of(number));
  BATON_ASSIGN(const int quarter, half_of(half));
  return quarter;
}

Status check_even(int number) {
  BATON_TRY(half_of(number));
  return {};
}

TEST(Result, MacrosPassValuesAndErrorsOn) {
  EXPECT_EQ(*quarter_of(12), 3);
  EXPECT_EQ(quarter_of(6).error().message, "odd");
  EXPECT_TRUE(check_even(2).ok());
  EXPECT_EQ(check_even(3).error().kind, ErrorKind::bad_input);
}

TEST(Result, HoldsValuesThatOnlyMove) {
  Result<std::unique_ptr<int>> result(std::make_unique<int>(7));
  const std::unique_ptr<int> taken = *std::move(result);
  EXPECT_EQ(*taken, 7);
}

TEST(ResultDeathTest, ReadingTheOtherSideStopsTheProcess) {
  EXPECT_DEATH((void)half_of(3).value(), "broken invariant at .*result.h");
  EXPECT_DEATH((void)half_of(2).error(), "broken invariant");
}

TEST(ExitCodes, WrongInputOfAnyKindIs65) {
  EXPECT_EQ(static_cast<int>(exit_code_of(ErrorKind::bad_input)), 65);
  EXPECT_EQ(static_cast<int>(exit_code_of(ErrorKind::corrupt)), 65);
  EXPECT_EQ(static_cast<int>(exit_code_of(ErrorKind::version)), 65);
  EXPECT_EQ(static_cast<int>(exit_code_of(ErrorKind::usage)), 64);
  EXPECT_EQ(static_cast<int>(exit_code_of(ErrorKind::timeout)), 1);
  EXPECT_EQ(static_cast<int>(exit_code_of(ErrorKind::cancelled)), 3);
}

TEST(Bytes, ReaderGivesBackWhatWriterPut) {
  ByteWriter writer;
  writer.put(std::uint16_t{0x1234});
  writer.put(-5);
  writer.put(1.5);
  writer.put_string("tile");
  ByteReader reader(writer.bytes());
  EXPECT_EQ(reader.get<std::uint16_t>(), 0x1234);
  EXPECT_EQ(reader.get<int>(), -5);
  EXPECT_EQ(reader.get<double>(), 1.5);
  EXPECT_EQ(reader.get_string(), "tile");
  EXPECT_TRUE(reader.ok());
  EXPECT_TRUE(reader.at_end());
}

TEST(Bytes, AreLittleEndian) {
  ByteWriter writer;
  writer.put(std::uint32_t{0x01020304});
  EXPECT_EQ(writer.bytes(), (Bytes{std::byte{4}, std::byte{3}, std::byte{2}, std::byte{1}}));
}

TEST(Bytes, PastTheEndReadsZeroAndSaysSo) {
  ByteWriter writer;
  writer.put(std::uint8_t{9});
  ByteReader reader(writer.bytes());
  EXPECT_EQ(reader.get<std::uint32_t>(), 0u);
  EXPECT_FALSE(reader.ok());
  EXPECT_EQ(reader.get<std::uint8_t>(), 0) << "a reader that failed stays failed";
}

TEST(Bytes, AStringLongerThanTheRestIsEmpty) {
  ByteWriter writer;
  writer.put(std::numeric_limits<std::uint32_t>::max());
  writer.put_raw(as_bytes_view("abc"));
  ByteReader reader(writer.bytes());
  EXPECT_EQ(reader.get_string(), "");
  EXPECT_FALSE(reader.ok());
}

// XXH3-128 and XXH3-64 (2d06800538d394c2) of nothing, as xxHash's own sanity test has them.
TEST(Digest, MatchesThePublishedVectors) {
  EXPECT_EQ(digest_of("").hex(), "99aa06d3014798d86001c324468d497f");
  EXPECT_EQ(checksum32({}), 0x38d394c2u);
}

TEST(Digest, HexGoesBothWays) {
  const Digest digest{0x0123456789abcdefull, 0x00000000000000ffull};
  EXPECT_EQ(digest.hex(), "0123456789abcdef00000000000000ff");
  EXPECT_EQ(digest.short_hex(), "01234567");
  EXPECT_EQ(Digest::from_hex(digest.hex()), digest);
}

TEST(Digest, OnlyThirtyTwoHexadecimalDigitsAreADigest) {
  const std::string good(32, 'a');
  EXPECT_TRUE(Digest::from_hex(good));
  EXPECT_FALSE(Digest::from_hex(good + "a"));
  EXPECT_FALSE(Digest::from_hex(good.substr(1)));
  EXPECT_FALSE(Digest::from_hex("g" + good.substr(1)));
  EXPECT_FALSE(Digest::from_hex("-" + good.substr(1)));
  EXPECT_FALSE(Digest::from_hex(""));
}

}  // namespace
}  // namespace baton
