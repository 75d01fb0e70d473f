#include "worker/exchange/traced_exchange.h"

#include <algorithm>

#include "common/base/cpu_clock.h"
#include "common/base/poison.h"
#include "worker/sampling/folds.h"

namespace baton {

void TracedExchange::use(const Fold& fold) {
  fold_ = fold;
  lns_.clear();
  const SecondPassForm form = work_.context.job.visibility.form;
  if (form != SecondPassForm::published && form != SecondPassForm::published_kept) return;
  work_.masks.any.visit_all([&](std::int32_t x, std::int32_t y) {
    const SampleRegion::Place place = work_.samples.find(x, y);
    const auto populations = static_cast<std::size_t>(place.tile->num_populations);
    const auto population = static_cast<std::size_t>(std::max(fold.giver_population, 0));
    lns_.push_back(place.tile->lns[place.pixel * populations + population]);
  });
}

void TracedExchange::load_samples(std::span<Giver> givers, std::vector<GiverSample>& batch) {
  // List the samples and who they are of.
  const auto num_sites = static_cast<std::uint32_t>(work_.context.job.image.sites);
  batch.clear();
  code_.clear();
  own_offers_.clear();
  for (Giver& giver : givers) {
    const SampleRegion::Place place =
        work_.samples.find(giver.x, giver.y).of_population(fold_.giver_population);
    for (std::size_t i = place.first; i < place.first + place.count; ++i) {
      const FirstPassSamples& from = *place.tile;
      own_offers_.push_back({static_cast<std::uint32_t>(batch.size()), giver.rank,
                             giver.rank * num_sites + from.site[i]});
      code_.push_back(from.direction[i]);
      batch.push_back(
          {.slot = from.slot[i], .energy = from.energy[i] * fold_.energy_scale, .reflected = {}});
    }
    giver.end_sample = batch.size();
  }

  // See what their own surfaces make of the light along them.
  light_.resize(code_.size());
  poison(light_);
  kernels::look_up_lights(environment_, code_, light_);
  own_.resize(code_.size() + kReceptionPadding);
  poison(own_);
  kernels::reflect_lights(work_.surfaces.table(), light_, own_offers_, own_);

  // Keep what reflects.
  std::size_t sample = 0;
  std::size_t end = 0;
  for (Giver& giver : givers) {
    for (; sample < giver.end_sample; ++sample) {
      if (!(own_[sample].target > kSmallestTarget)) continue;
      batch[end] = batch[sample];
      batch[end].reflected = own_[sample];
      light_[end++] = light_[sample];
    }
    giver.end_sample = end;
  }
  batch.resize(end);
  light_.resize(end);
}

void TracedExchange::receive(std::span<const Offer> offers, std::span<Reflected> receptions) {
  kernels::reflect_and_cast(work_.surfaces.table(), light_, offers, receptions, rays_);
  {
    const StageTimer timer(seconds_rays_);
    work_.geometry.accel->occluded(rays_.rays);
  }
  rays_traced_ += rays_.rays.size();

  // Blocked ones become 0; free ones write into the padding instead, without a branch, which would
  // be mispredicted too often.
  for (std::size_t r = 0; r < rays_.rays.size(); ++r)
    receptions[rays_.rays.t_far[r] < 0 ? rays_.offer[r] : offers.size()] = {};
}

}  // namespace baton
