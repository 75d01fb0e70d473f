#pragma once

#include "common/image/film_tile.h"

namespace baton {

/// The plane of films that tells which share of a pixel's sites sees what catches
/// shadows; frames do not have it. In films the planes shadow.* hold S / U times that share, so
/// that films have means like any others.
inline constexpr char kCatcherChannel[] = "catcher";

/// Divides the planes shadow.* of a film by the share; 1 where no site sees a catcher. Nothing
/// without these planes.
void finish_shadows(FilmTile& film);

}  // namespace baton
