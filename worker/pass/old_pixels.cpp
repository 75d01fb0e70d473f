#include "worker/pass/old_pixels.h"

#include <algorithm>

#include "worker/pass/populations.h"

namespace baton {

std::optional<OldPixels::Place> OldPixels::ask(std::int32_t x, std::int32_t y) {
  const auto found = std::find_if(states_.begin(), states_.end(), [&](const StatePtr& state) {
    return state->rect.contains(x, y);
  });
  if (found == states_.end()) return std::nullopt;
  const SampleState& state = **found;
  const auto index =
      static_cast<std::size_t>((y - state.rect.y0) * state.rect.width() + x - state.rect.x0);
  if (latest_source(state, index) == PixelSource::background) return std::nullopt;
  const Place place{&state, index, rays_.size()};
  append_primary_rays(job_, before_, x, y, rays_);
  return place;
}

void OldPixels::trace() {
  hits_.resize(rays_.size());
  trace_primary_rays(job_, before_, rays_, hits_);
  num_rays_ += rays_.size();
}

}  // namespace baton
