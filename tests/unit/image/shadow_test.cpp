#include "common/image/shadow.h"

#include <gtest/gtest.h>

namespace baton {
namespace {

/// Pixels of one film: R G B A, S / U times the share of catchers, that share.
FilmTile film_of(const PixelRect& rect, const std::vector<std::array<float, 8>>& pixels) {
  FilmTile film{
      .rect = rect,
      .channels = {"R", "G", "B", "A", "shadow.R", "shadow.G", "shadow.B", kCatcherChannel},
      .values = {}};
  for (std::size_t channel = 0; channel < 8; ++channel) {
    for (const auto& pixel : pixels) film.values.push_back(pixel[channel]);
  }
  return film;
}

std::array<float, 4> rgba(const FilmTile& film, std::size_t i) {
  return {film.plane(0)[i], film.plane(1)[i], film.plane(2)[i], film.plane(3)[i]};
}

// An object; nothing; a catcher in coloured shadow; a pixel of all three: 1/2, 1/4 and 1/4.
const std::vector<std::array<float, 8>> kPixels{{1, 2, 3, 1, 0, 0, 0, 0},
                                                {0, 0, 0, 0, 0, 0, 0, 0},
                                                {0, 0, 0, 0, .5f, .25f, 0, 1},
                                                {1, 1, 1, .5f, .125f, .125f, .125f, .25f}};

TEST(Shadow, EachSiteOfAPixelShowsItsPartOfThePlate) {
  FilmTile film = film_of({0, 0, 4, 1}, kPixels);
  lay_over_plate(film, {4, 1, {9, 9, 9, 4, 5, 6, 4, 4, 4, 8, 16, 24}});
  EXPECT_EQ(rgba(film, 0), (std::array<float, 4>{1, 2, 3, 1}));
  EXPECT_EQ(rgba(film, 1), (std::array<float, 4>{4, 5, 6, 1}));
  EXPECT_EQ(rgba(film, 2), (std::array<float, 4>{2, 1, 0, 1}));
  // A quarter sees the plate as it is, a quarter sees half of it.
  EXPECT_EQ(rgba(film, 3), (std::array<float, 4>{4, 7, 10, 1}));
}

TEST(Shadow, PixelsBesideThePlateStay) {
  // The second and the third column of the film lie on the plate's first and second.
  FilmTile film = film_of({-1, 0, 3, 1}, kPixels);
  lay_over_plate(film, {2, 1, {4, 5, 6, 4, 4, 4}});
  EXPECT_EQ(rgba(film, 0), (std::array<float, 4>{1, 2, 3, 1}));
  EXPECT_EQ(rgba(film, 1), (std::array<float, 4>{4, 5, 6, 1}));
  EXPECT_EQ(rgba(film, 2), (std::array<float, 4>{2, 1, 0, 1}));
  EXPECT_EQ(rgba(film, 3), (std::array<float, 4>{1, 1, 1, .5f}));
  // A region of one pixel.
  FilmTile part = film_of({1, 1, 2, 2}, {kPixels[1]});
  lay_over_plate(part, {2, 2, {0, 0, 0, 0, 0, 0, 0, 0, 0, 7, 8, 9}});
  EXPECT_EQ(rgba(part, 0), (std::array<float, 4>{7, 8, 9, 1}));
}

TEST(Shadow, WithoutCatchersOnlyAlphaCounts) {
  FilmTile film{.rect = {0, 0, 1, 1}, .channels = {"R", "G", "B", "A"}, .values = {1, 1, 1, .25f}};
  lay_over_plate(film, {1, 1, {4, 8, 0}});
  EXPECT_EQ(film.values, (std::vector<float>{4, 7, 1, 1}));
}

// Laid over a grey plate, both forms of a grey shadow give what lay_over_plate does.
TEST(Shadow, InAlphaIsBlackOverThePlate) {
  FilmTile film = film_of({0, 0, 4, 1}, kPixels);
  put_shadows_in_alpha(film);
  EXPECT_FLOAT_EQ(rgba(film, 0)[3], 1);
  EXPECT_FLOAT_EQ(rgba(film, 1)[3], 0);
  EXPECT_FLOAT_EQ(rgba(film, 2)[3], 1 - (0.2126f * .5f + 0.7152f * .25f));
  EXPECT_FLOAT_EQ(rgba(film, 3)[3], .5f + .125f);
  FilmTile laid = film_of({0, 0, 4, 1}, kPixels);
  lay_over_plate(laid, {4, 1, {8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8, 8}});
  EXPECT_FLOAT_EQ(rgba(laid, 3)[0], rgba(film, 3)[0] + (1 - rgba(film, 3)[3]) * 8);
}

TEST(Shadow, OfChannelsIsAShareOfWhatCatches) {
  FilmTile film = film_of({0, 0, 4, 1}, kPixels);
  finish_shadows(film);
  const float* const red = film.find("shadow.R");
  EXPECT_EQ((std::vector<float>{red[0], red[1], red[2], red[3]}),
            (std::vector<float>{1, 1, .5f, .5f}));
}

}  // namespace
}  // namespace baton
