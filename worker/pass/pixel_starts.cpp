#include "worker/pass/pixel_starts.h"

#include "common/base/cpu_clock.h"
#include "common/base/poison.h"
#include "worker/pass/catcher.h"

namespace baton {

void PixelStarts::begin(const PixelBatch& batch, SampleState& state) {
  if (work_.at.history == nullptr) return;
  const StageTimer timer(work_.seconds.history);
  work_.at.history->look_up(work_.at.surfaces, batch.slots, work_.at.frame);
  if (!state.block_planes.empty())
    work_.at.history->inherit_blocks(work_.at.surfaces, batch.slots, state);
}

bool PixelStarts::find(std::size_t i, std::size_t slot, SampleState& state) {
  const TileSurfaces& surfaces = work_.at.surfaces;
  const std::size_t index = surfaces.pixels.index(slot);
  const bool sees_catcher = surfaces.sees_catcher(slot);
  Found& found = found_[i % 2];
  poison(found.old);
  found.history = PixelHistory::none;
  if (work_.at.history != nullptr) {
    found.history = work_.at.history->take(i, index, work_.catchers_before, state, found.old);
  } else if (work_.at.goes_on) {
    if (is_of_its_kind(sees_catcher, state, index)) {
      found.history = PixelHistory::same;
    } else if (!belongs_to_object(state, index)) {
      state.forget_pixel(index);  // a catcher's
    }
  }
  if (sees_catcher && found.history == PixelHistory::same)
    found.history = with_old_albedo(slot, found.old);
  return found.history != PixelHistory::none;
}

/// Surfaces of catchers that stay have the albedo of the frame before, where that was another.
PixelHistory PixelStarts::with_old_albedo(std::size_t slot, OldSurfaces& old) {
  CatcherAlbedo& before = work_.catchers_before;
  if (!before.is_known() || work_.catchers.is_like(before)) return PixelHistory::same;
  gather_sites(geometry_, work_.at.surfaces.pixel(slot), {}, old.sites, before);
  old.log_share.fill(0);
  return PixelHistory::moved;
}

PixelStart PixelStarts::of(std::size_t i) {
  const Found& found = found_[i % 2];
  PixelStart start{.has_history = found.history != PixelHistory::none};
  if (found.history == PixelHistory::moved) start.old = &found.old;
  if (work_.at.history != nullptr)
    start.neighbors = work_.at.history->neighbors(i, work_.catchers_before);
  return start;
}

}  // namespace baton
