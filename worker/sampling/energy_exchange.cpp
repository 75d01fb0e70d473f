#include "worker/sampling/energy_exchange.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {
namespace {

/// Offers answered together: enough rays for one call of the ray tracer, few enough for the cache.
constexpr std::size_t kBatchOffers = 2048;

constexpr std::array<Fold, 1> kSameSamples{Fold{}};
constexpr std::array<Fold, 1> kSplit{Fold{0, 1, 2.0f}};
constexpr std::array<Fold, 2> kCrossFold{Fold{0, 1, 1.0f}, Fold{1, 0, 1.0f}};

class Exchange {
 public:
  Exchange(const ExchangeSettings& settings, const SquarePartitions& partitions,
           const PixelMask& exchange, const PixelRect& inner, ExchangeScene& scene,
           std::span<Rgb> radiance)
      : settings_(settings),
        partitions_(partitions),
        exchange_(exchange),
        inner_(inner),
        scene_(scene),
        radiance_(radiance),
        squares_(static_cast<std::size_t>(partitions.count())),
        neighbours_(squares_.size()),
        strata_(squares_.size()) {
    const PixelRect& rect = exchange.rect();
    for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
      for (std::int32_t x = rect.x0; x < rect.x1; ++x) {
        inner_index_.push_back(
            inner.contains(x, y) ? static_cast<std::int32_t>(PixelMask::index(inner, x, y)) : -1);
      }
    }
  }

  /// Puts a pixel into the batch. Givers must come row by row: that is the order in which receivers
  /// add.
  void add(std::int32_t x, std::int32_t y) {
    const bool inside = inner_.contains(x, y);
    Giver giver{
        .x = x, .y = y, .inside = inside, .end_sample = 0, .num_lonely = partitions_.count()};
    const std::size_t first = batch_.size();
    scene_.append_samples(x, y, batch_);
    if (exchange_.at(x, y) && batch_.size() > first) {
      giver.num_lonely = meet_neighbours(x, y);
      for (std::size_t s = first; s < batch_.size(); ++s) make_offers(s, inside);
    }
    giver.end_sample = batch_.size();
    givers_.push_back(giver);
    if (offers_.size() >= kBatchOffers) flush();
  }

  /// Answers and books everything in the batch.
  void flush() {
    receptions_.resize(offers_.size());
    scene_.receive(batch_, offers_, receptions_);
    std::size_t sample = 0;
    std::size_t offer = 0;
    for (const Giver& giver : givers_) {
      for (; sample < giver.end_sample; ++sample) book(giver, sample, offer);
    }
    batch_.clear();
    offers_.clear();
    givers_.clear();
  }

 private:
  struct Giver {
    std::int32_t x, y;
    bool inside;
    std::size_t end_sample;   ///< past its samples in the batch
    std::int32_t num_lonely;  ///< partitions in which there is nobody to offer to
  };

  /// Lists the masked pixels that share a square with (x, y). Returns the number of partitions
  /// without any.
  std::int32_t meet_neighbours(std::int32_t x, std::int32_t y) {
    const Rng rng({.job_seed = settings_.job_seed,
                   .frame = settings_.frame,
                   .pixel = static_cast<std::uint32_t>(y * settings_.image_width + x)},
                  PassId::exchange);
    std::int32_t num_lonely = 0;
    Philox4x32::Counter random{};
    for (std::int32_t c = 0; c < partitions_.count(); ++c) {
      const auto word = static_cast<std::uint32_t>(c);
      if (word % 4 == 0) random = rng.bits(settings_.fold, word / 4);
      strata_[word] = random[word % 4];
      squares_[word].move_to(exchange_, partitions_, c, y);
      neighbours_[word] = squares_[word].others(x, y);
      num_lonely += neighbours_[word].count == 0 ? 1 : 0;
    }
    return num_lonely;
  }

  /// Draws one (pixel, site) in each partition, uniformly; the slots of a pixel take different
  /// strata of it. Of a giver outside, only what comes in matters.
  void make_offers(std::size_t sample, bool inside) {
    const std::uint32_t shift = static_cast<std::uint32_t>(
        (std::uint64_t{batch_[sample].slot} << 32) / settings_.num_slots);
    const std::uint32_t num_sites = settings_.num_sites;
    for (std::size_t c = 0; c < neighbours_.size(); ++c) {
      const SquareMembers::Others& others = neighbours_[c];
      if (others.count == 0) continue;
      const std::uint32_t position = strata_[c] + shift;  // wraps around
      const auto pair = static_cast<std::uint32_t>(
          (std::uint64_t{position} * (std::uint64_t{others.count} * num_sites)) >> 32);
      const std::uint32_t receiver = others.pick(num_sites == 1 ? pair : pair / num_sites);
      if (!inside && inner_index_[receiver] < 0) continue;
      offers_.push_back(
          {static_cast<std::uint32_t>(sample), receiver, num_sites == 1 ? 0 : pair % num_sites});
    }
  }

  /// Gives away the accepted shares of one sample; the giver keeps the rest. `offer` moves past the
  /// sample's offers.
  void book(const Giver& giver, std::size_t sample, std::size_t& offer) {
    const GiverSample& given = batch_[sample];
    const auto c = static_cast<float>(partitions_.count());
    const float unit = given.energy / c;
    float accepted = 0;
    for (; offer < offers_.size() && offers_[offer].sample == sample; ++offer) {
      const Reception& reception = receptions_[offer];
      const float share = acceptance(settings_.form, given, reception);
      if (!(share > 0)) continue;
      accepted += share;
      const std::int32_t to = inner_index_[offers_[offer].receiver];
      if (to < 0) continue;
      radiance_[static_cast<std::size_t>(to)] +=
          reception.reflected * (share * unit / reception.target);
    }
    if (!giver.inside) return;
    const float left = settings_.form == SecondPassForm::published
                           ? static_cast<float>(giver.num_lonely)
                           : std::max(c - accepted, 0.0f);
    radiance_[PixelMask::index(inner_, giver.x, giver.y)] +=
        given.reflected * (left / c * given.energy / given.target);
  }

  const ExchangeSettings& settings_;
  const SquarePartitions& partitions_;
  const PixelMask& exchange_;
  const PixelRect inner_;
  ExchangeScene& scene_;
  std::span<Rgb> radiance_;
  std::vector<SquareMembers> squares_;             ///< (C)
  std::vector<SquareMembers::Others> neighbours_;  ///< (C) of the pixel in work
  std::vector<std::int32_t> inner_index_;  ///< (pixels of the mask) position in `inner`, or -1
  std::vector<std::uint32_t> strata_;      ///< (C) 32 random bits
  std::vector<Giver> givers_;
  std::vector<GiverSample> batch_;
  std::vector<Offer> offers_;
  std::vector<Reception> receptions_;
};

}  // namespace

std::span<const Fold> folds_of(MaskPolicy policy) {
  switch (policy) {
    case MaskPolicy::same_samples:
      return kSameSamples;
    case MaskPolicy::split:
      return kSplit;
    case MaskPolicy::cross_fold:
      return kCrossFold;
  }
  return {};
}

float acceptance(SecondPassForm form, const GiverSample& giver, const Reception& reception) {
  if (!reception.visible || !(reception.target > 0)) return 0;
  if (form == SecondPassForm::corrected) return std::min(1.0f, reception.target / giver.target);
  return giver.lns > 0 ? std::min(1.0f, reception.lns / giver.lns) : 0.0f;
}

void exchange_energy(const ExchangeSettings& settings, const SquarePartitions& partitions,
                     const PixelMask& exchange, const PixelMask& recompute, const PixelRect& inner,
                     ExchangeScene& scene, std::span<Rgb> radiance) {
  BATON_CHECK(radiance.size() == static_cast<std::size_t>(inner.area()));
  BATON_CHECK(exchange.rect() == recompute.rect() && settings.num_slots > 0 &&
              settings.num_sites > 0);
  Exchange work(settings, partitions, exchange, inner, scene, radiance);
  const PixelRect& rect = recompute.rect();
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    for (std::int32_t x = rect.x0; x < rect.x1; ++x) {
      if (recompute.at(x, y) && (inner.contains(x, y) || exchange.at(x, y))) work.add(x, y);
    }
  }
  work.flush();
}

}  // namespace baton
