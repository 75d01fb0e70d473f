#include "common/job/task.h"

namespace baton {

void RenderStats::merge(const RenderStats& b) {
  pixels += b.pixels;
  rays_primary += b.rays_primary;
  rays_shadow += b.rays_shadow;
  target_evaluations += b.target_evaluations;
  pixels_background += b.pixels_background;
  pixels_fresh += b.pixels_fresh;
  pixels_carried += b.pixels_carried;
  pixels_restarted += b.pixels_restarted;
  pixels_refreshed += b.pixels_refreshed;
  pixels_resampled += b.pixels_resampled;
  moves_proposed += b.moves_proposed;
  moves_accepted += b.moves_accepted;
  cpu_seconds += b.cpu_seconds;
  seconds_light += b.seconds_light;
  seconds_primary += b.seconds_primary;
  seconds_sample += b.seconds_sample;
  seconds_visibility += b.seconds_visibility;
  seconds_shade += b.seconds_shade;
  seconds_state += b.seconds_state;
}

}  // namespace baton
