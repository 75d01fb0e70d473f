#include "common/base/legible.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

TEST(Legible, WhatIsLegibleStays) {
  for (const char* const text :
       {"", "node7-1234", "w\u00e9\u00fc \u540d", "a\\n\"b'", "\U0001f600"})
    EXPECT_EQ(legible_line(text), text);
  EXPECT_EQ(legible_text("one\n\ttwo"), "one\n\ttwo");
}

TEST(Legible, BytesThatAreNoUtf8AreReplaced) {
  EXPECT_EQ(legible_line("bad\xff\xfeutf"), "bad\ufffd\ufffdutf");
  EXPECT_EQ(legible_line("cut\xe5\x90"), "cut\ufffd\ufffd") << "a character that is cut off";
  EXPECT_EQ(legible_line("\xc0\x8a"), "\ufffd\ufffd") << "a line break, too long";
  EXPECT_EQ(legible_line("\xe0\x82\x80"), "\ufffd\ufffd\ufffd") << "too long";
  EXPECT_EQ(legible_line("\xed\xa0\x80"), "\ufffd\ufffd\ufffd") << "a surrogate";
  EXPECT_EQ(legible_line("\xf4\x90\x80\x80"), "\ufffd\ufffd\ufffd\ufffd") << "past U+10FFFF";
  EXPECT_EQ(legible_line("\x80x"), "\ufffdx");
}

TEST(Legible, ControlsAreEscaped) {
  EXPECT_EQ(legible_line("a\nb\r\t"), "a\\nb\\r\\t");
  EXPECT_EQ(legible_line("\x1b[31mred\x7f"), "\\x1b[31mred\\x7f");
  EXPECT_EQ(legible_line("\u0085\u2028\u202e"), "\\x85\\u2028\\u202e");
  EXPECT_EQ(legible_line("\u061c\u200e\u200f"), "\\u061c\\u200e\\u200f");
  EXPECT_EQ(legible_line(std::string_view("\0x", 2)), "\\x00x");
  EXPECT_EQ(legible_text("\x1b[2J\n"), "\\x1b[2J\n");
  const std::string once = legible_line("a\n\x1b\xff");
  EXPECT_EQ(legible_line(once), once);
}

}  // namespace
}  // namespace baton
