#include "common/image/pixel_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>

namespace baton {
namespace {

/// 3 x 5 dots, row by row from the top, the highest bit left.
using Letter = std::uint16_t;

constexpr std::array<Letter, 10> kDigits{
    0b111'101'101'101'111, 0b010'110'010'010'111, 0b111'001'111'100'111, 0b111'001'111'001'111,
    0b101'101'111'001'001, 0b111'100'111'001'111, 0b111'100'111'101'111, 0b111'001'010'010'010,
    0b111'101'111'101'111, 0b111'101'111'001'111};
constexpr std::array<Letter, 26> kLetters{
    0b010'101'111'101'101, 0b110'101'110'101'110, 0b011'100'100'100'011, 0b110'101'101'101'110,
    0b111'100'110'100'111, 0b111'100'110'100'100, 0b011'100'101'101'011, 0b101'101'111'101'101,
    0b111'010'010'010'111, 0b001'001'001'101'010, 0b101'101'110'101'101, 0b100'100'100'100'111,
    0b101'111'111'101'101, 0b110'101'101'101'101, 0b010'101'101'101'010, 0b110'101'110'100'100,
    0b010'101'101'111'011, 0b110'101'110'101'101, 0b011'100'010'001'110, 0b111'010'010'010'010,
    0b101'101'101'101'111, 0b101'101'101'101'010, 0b101'101'111'111'101, 0b101'101'010'101'101,
    0b101'101'010'010'010, 0b111'001'010'100'111};
constexpr int kRows = 7;

Letter letter_of(char c) {
  const auto u = static_cast<unsigned char>(c);
  if (std::isdigit(u)) return kDigits[static_cast<std::size_t>(u - '0')];
  if (std::isalpha(u)) return kLetters[static_cast<std::size_t>(std::toupper(u) - 'A')];
  switch (c) {
    case ' ':
      return 0;
    case '-':
      return 0b000'000'111'000'000;
    case '_':
      return 0b000'000'000'000'111;
    case '.':
      return 0b000'000'000'000'010;
    case ':':
      return 0b000'010'000'010'000;
    default:
      return 0b110'001'010'000'010;
  }
}

}  // namespace

int text_width(std::string_view text) {
  return (1 + 4 * static_cast<int>(text.size())) * kDotPixels;
}

int text_height() { return kRows * kDotPixels; }

void draw_text(std::string_view text, int left, int bottom, RgbImage& image) {
  for (int y = 0; y < text_height(); ++y) {
    for (int x = 0; x < text_width(text); ++x) {
      const int column = x / kDotPixels - 1, row = y / kDotPixels - 1;
      const bool in_letter = column >= 0 && column % 4 < 3 && row >= 0 && row < 5;
      const bool dot = in_letter && (letter_of(text[static_cast<std::size_t>(column / 4)]) >>
                                         (14 - 3 * row - column % 4) &
                                     1) != 0;
      const int at_x = left + x, at_y = bottom - text_height() + y;
      if (at_x < 0 || at_x >= image.width || at_y < 0 || at_y >= image.height) continue;
      std::fill_n(image.rgb.begin() + (std::ptrdiff_t{at_y} * image.width + at_x) * 3, 3,
                  dot ? 1.0f : 0.0f);
    }
  }
}

}  // namespace baton
