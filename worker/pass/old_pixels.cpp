#include "worker/pass/old_pixels.h"

#include <algorithm>

#include "worker/pass/render_context.h"
#include "worker/pass/site_rays.h"

namespace baton {

OldPixels::OldPixels(const RenderContext& context, const FrameGeometry& before,
                     std::span<const StatePtr> states)
    : job_(context.job),
      before_(before),
      states_(states),
      round_(states.empty() ? 0 : context.frames[states.front()->step.index()].first_round) {
  for (const StatePtr& state : states)
    kept_.push_back(context.surfaces->find({state->step, state->tile}));
}

std::optional<OldPixels::Place> OldPixels::ask(std::int32_t x, std::int32_t y) {
  const auto found = std::find_if(states_.begin(), states_.end(), [&](const StatePtr& state) {
    return state->rect.contains(x, y);
  });
  if (found == states_.end()) return std::nullopt;
  const SampleState& state = **found;
  const auto index =
      static_cast<std::size_t>((y - state.rect.y0) * state.rect.width() + x - state.rect.x0);
  if (state.latest_source(index) == PixelSource::background) return std::nullopt;
  num_rays_ += static_cast<std::uint64_t>(job_.image.sites);
  const TileSurfaces* const kept = kept_[static_cast<std::size_t>(found - states_.begin())].get();
  if (kept != nullptr) return Place{&state, index, kept};
  asked_.push_back({x, y});
  return Place{&state, index, nullptr, asked_.size() - 1};
}

void OldPixels::trace() {
  std::vector<std::uint16_t> num_sites(asked_.size(), static_cast<std::uint16_t>(job_.image.sites));
  if (has_fine_sites(job_)) num_sites = count_sites(job_, before_, asked_);
  std::vector<Ray> rays;
  SiteRays sites(job_, before_.pose.camera, round_);
  first_hit_.clear();
  for (std::size_t i = 0; i < asked_.size(); ++i) {
    first_hit_.push_back(rays.size());
    sites.append(asked_[i][0], asked_[i][1], num_sites[i], rays);
  }
  hits_.resize(rays.size());
  trace_primary_rays(before_, rays, num_sites, hits_);
}

}  // namespace baton
