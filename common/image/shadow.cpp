#include "common/image/shadow.h"

namespace baton {

void finish_shadows(FilmTile& film) {
  const float* const share = film.find(kCatcherChannel);
  if (share == nullptr) return;
  for (const char* const name : {"shadow.R", "shadow.G", "shadow.B"}) {
    float* const shadow = film.find(name);
    for (std::size_t i = 0; i < film.num_pixels(); ++i)
      shadow[i] = share[i] > 0 ? shadow[i] / share[i] : 1;
  }
}

}  // namespace baton
