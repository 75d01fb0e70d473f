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
        squares_(static_cast<std::size_t>(partitions.count())) {
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
    const std::size_t num_samples = batch_.size() - first;
    if (exchange_.at(x, y) && num_samples > 0) {
      giver.num_lonely = meet_neighbours(x, y);
      offers_.resize(std::max(offers_.size(), num_offers_ + num_samples * neighbours_.size()));
      for (std::size_t s = first; s < batch_.size(); ++s) make_offers(s, inside);
    }
    giver.end_sample = batch_.size();
    givers_.push_back(giver);
    if (num_offers_ >= kBatchOffers) flush();
  }

  /// Answers and books everything in the batch.
  void flush() {
    receptions_.resize(std::max(receptions_.size(), num_offers_ + kReceptionPadding));
    const std::span<const Offer> offers(offers_.data(), num_offers_);
    scene_.receive(offers, std::span(receptions_).first(num_offers_ + kReceptionPadding));
    std::size_t sample = 0;
    std::size_t offer = 0;
    for (const Giver& giver : givers_) {
      for (; sample < giver.end_sample; ++sample) book(giver, sample, offers, offer);
    }
    batch_.clear();
    givers_.clear();
    num_offers_ = 0;
  }

 private:
  struct Giver {
    std::int32_t x, y;
    bool inside;
    std::size_t end_sample;   ///< past its samples in the batch
    std::int32_t num_lonely;  ///< partitions in which there is nobody to offer to
  };

  /// The others of one square, with 32 random bits.
  struct Neighbours : SquareMembers::Others {
    std::uint32_t stratum = 0;
  };

  /// Lists the masked pixels that share a square with (x, y). Returns the number of partitions
  /// without any.
  std::int32_t meet_neighbours(std::int32_t x, std::int32_t y) {
    const Rng rng({.job_seed = settings_.job_seed,
                   .frame = settings_.frame,
                   .pixel = static_cast<std::uint32_t>(y * settings_.image_width + x)},
                  PassId::exchange);
    neighbours_.clear();
    Philox4x32::Counter random{};
    for (std::int32_t c = 0; c < partitions_.count(); ++c) {
      const auto word = static_cast<std::uint32_t>(c);
      if (word % 4 == 0) random = rng.bits(settings_.fold, word / 4);
      squares_[word].move_to(exchange_, partitions_, c, y);
      const SquareMembers::Others others = squares_[word].others(x, y);
      if (others.count > 0) neighbours_.push_back({others, random[word % 4]});
    }
    return partitions_.count() - static_cast<std::int32_t>(neighbours_.size());
  }

  /// Draws one (pixel, site) in each partition, uniformly; the slots of a pixel take different
  /// strata of it. Of a giver outside, only what comes in matters.
  void make_offers(std::size_t sample, bool inside) {
    const auto shift = static_cast<std::uint32_t>((std::uint64_t{batch_[sample].slot} << 32) /
                                                  settings_.num_slots);
    const std::uint32_t num_sites = settings_.num_sites;
    const auto* own_pixel = inside ? nullptr : inner_index_.data();
    Offer* offer = offers_.data() + num_offers_;
    for (const Neighbours& others : neighbours_) {
      const std::uint32_t position = others.stratum + shift;                // wraps around
      const std::uint64_t scaled = std::uint64_t{position} * others.count;  // 32 bits of fraction
      const std::uint32_t receiver = others.pick(static_cast<std::uint32_t>(scaled >> 32));
      if (own_pixel != nullptr && own_pixel[receiver] < 0) continue;
      *offer++ = {static_cast<std::uint32_t>(sample), receiver,
                  static_cast<std::uint32_t>((scaled & 0xffffffffu) * num_sites >> 32)};
    }
    num_offers_ = static_cast<std::size_t>(offer - offers_.data());
  }

  /// The acceptance over the receiver's target; finite where it reflects nothing.
  float acceptance_per_target(const GiverSample& given, std::uint32_t receiver,
                              const Reflected& seen) const {
    if (settings_.form == SecondPassForm::corrected)
      return std::min(1 / given.reflected.target, 1 / seen.target);
    if (!(seen.target > kSmallestTarget && given.lns > 0)) return 0;
    return std::min(1.0f, scene_.lns(receiver) / given.lns) / seen.target;
  }

  /// Gives away the accepted shares of one sample; the giver keeps the rest. `at` moves past the
  /// sample's offers.
  void book(const Giver& giver, std::size_t sample, std::span<const Offer> offers,
            std::size_t& at) {
    const GiverSample& given = batch_[sample];
    const auto c = static_cast<float>(partitions_.count());
    const float unit = given.energy / c;
    float accepted = 0;
    for (; at < offers.size() && offers[at].sample == sample; ++at) {
      // No branch on what the rays said: nothing reflected adds nothing.
      const Reflected& seen = receptions_[at];
      const float share_per_target = acceptance_per_target(given, offers[at].receiver, seen);
      accepted += share_per_target * seen.target;
      const std::int32_t to = inner_index_[offers[at].receiver];
      if (to >= 0)
        radiance_[static_cast<std::size_t>(to)] += seen.radiance * (share_per_target * unit);
    }
    if (!giver.inside) return;
    const float left = settings_.form == SecondPassForm::published
                           ? static_cast<float>(giver.num_lonely)
                           : std::max(c - accepted, 0.0f);
    radiance_[PixelMask::index(inner_, giver.x, giver.y)] +=
        given.reflected.radiance * (left / c * given.energy / given.reflected.target);
  }

  const ExchangeSettings& settings_;
  const SquarePartitions& partitions_;
  const PixelMask& exchange_;
  const PixelRect inner_;
  ExchangeScene& scene_;
  std::span<Rgb> radiance_;
  std::vector<SquareMembers> squares_;     ///< (C)
  std::vector<Neighbours> neighbours_;     ///< of the pixel in work: at most C
  std::vector<std::int32_t> inner_index_;  ///< (pixels of the mask) position in `inner`, or -1
  std::vector<Giver> givers_;
  std::vector<GiverSample> batch_;
  std::vector<Offer> offers_;  ///< of which the first num_offers_ are meant
  std::size_t num_offers_ = 0;
  std::vector<Reflected> receptions_;
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
