#include "worker/pass/tile_round.h"

#include "common/base/poison.h"
#include "worker/pass/render_context.h"

namespace baton {

RoundWork::RoundWork(const RenderContext& context, const TileRound& round)
    : at(round),
      job(context.job),
      light{round.light},
      catchers(round.light.irradiance.get(), round.light.now),
      catchers_before(round.light.irradiance_before.get(), round.light.before) {
  if (round.probe_light != nullptr)
    probe_light.emplace(RoundLight{*round.probe_light, light.now, light.before});
}

RngKey RoundWork::key(std::size_t index) const {
  const auto [x, y] = at.surfaces.rect.place(index);
  return pixel_key(job.seed, at.frame.number.value(), job.image.width, x, y,
                   at.frame.round_of_frame(at.round));
}

bool RoundWork::is_probe(std::size_t index) const {
  const auto [x, y] = at.surfaces.rect.place(index);
  return baton::is_probe(x, y, at.frame.number, job.seed);
}

BounceGroup RoundWork::group(std::size_t index) const {
  const auto [x, y] = at.surfaces.rect.place(index);
  return BounceGroup::of(job.seed, at.frame.number.value(), job.image.width, x, y,
                         at.frame.round_of_frame(at.round));
}

void PixelBatch::begin(std::span<const std::uint32_t> new_slots) {
  slots = new_slots;
  rays.clear();
  poison(end_ray);
  known.fill({});
  pixels.fill({});
  emission.fill({});
  again.fill({});
  indirect.fill({});
  groups_again.clear();
}

}  // namespace baton
