#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "common/image/film_tile.h"
#include "common/job/time.h"

namespace baton {

/// Makes `film`, of `sweep` alone, the mean of itself and of `earlier`, which is that of the sweeps
/// before it. All sweeps weigh the same, whatever they found, so the mean has no bias. Depth,
/// normal and material are those of the sweeps that see a surface; variance and error are the
/// scatter of the sweeps, sites included, in films that tell their errors. Error: films of
/// different tiles or channels.
Status add_sweeps(FilmTile earlier, Sweep sweep, FilmTile& film);

}  // namespace baton
