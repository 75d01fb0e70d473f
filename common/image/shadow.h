#pragma once

#include <array>

#include "common/image/film_tile.h"
#include "common/image/image_io.h"

namespace baton {

/// The plane of films that tells which share of a pixel's sites sees what catches shadows; frames
/// do not have it. In films the planes shadow.* are S / U times that share, so that films have
/// means like any others.
inline constexpr char kCatcherChannel[] = "catcher";
inline constexpr std::array<const char*, 3> kShadowChannels{"shadow.R", "shadow.G", "shadow.B"};

/// Divides the planes shadow.* of a film by the share; 1 where no site sees a catcher. Nothing
/// without these planes.
void finish_shadows(FilmTile& film);

/// Lays a film without background over a plate: each site that sees nothing shows it, each that
/// sees a catcher shows it in shadow, so R, G and B get (share of nothing + shadow share) times
/// the plate, and A becomes 1. The plate's corner is the film's pixel (0, 0); pixels beside it
/// stay.
void lay_over_plate(FilmTile& film, const RgbImage& plate);

/// Makes what shadows take black in A: it grows by the share of catchers times one less the
/// luminance of S / U [Rec. 709]. Nothing without the planes shadow.*.
void put_shadows_in_alpha(FilmTile& film);

}  // namespace baton
