#include "worker/exchange/energy_exchange.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/poison.h"

namespace baton {
namespace {

/// Pixels whose offers are answered together: enough rays for one call of the ray tracer, few
/// enough for the cache.
constexpr std::size_t kBatchGivers = 32;

/// sum += seen * scale, all four floats at once.
void add_scaled(Reflected& sum, const Reflected& seen, float scale) {
  sum.radiance += seen.radiance * scale;
  sum.target += seen.target * scale;
}

class Exchange {
 public:
  Exchange(const ExchangeSettings& settings, const SquarePartitions& partitions,
           const PixelMask& exchange, const PixelMask& recompute, const PixelRect& inner,
           ExchangeScene& scene)
      : settings_(settings),
        partitions_(partitions),
        exchange_(exchange),
        inner_(inner),
        scene_(scene),
        ranks_(recompute.ranks()),
        squares_(static_cast<std::size_t>(partitions.count())) {
    recompute.visit_all([&](std::int32_t x, std::int32_t y) {
      inner_index_.push_back(
          inner.contains(x, y) ? static_cast<std::int32_t>(PixelMask::index(inner, x, y)) : -1);
    });
    sums_.resize(inner_index_.size());
  }

  /// Puts a pixel to recompute into the batch. Givers must come row by row: that is the order in
  /// which receivers add.
  void add(std::int32_t x, std::int32_t y) {
    if (!inner_.contains(x, y) && !exchange_.at(x, y)) return;
    givers_.push_back({x, y, static_cast<std::uint32_t>(ranks_[exchange_.index(x, y)])});
    if (givers_.size() == kBatchGivers) flush();
  }

  /// Offers the samples of the batch and records what is received.
  void flush() {
    // Offer.
    scene_.load_samples(givers_, batch_);
    num_lonely_.assign(givers_.size(), partitions_.count());
    offers_.resize(batch_.size() * static_cast<std::size_t>(partitions_.count()));
    Offer* end = offers_.data();
    std::size_t sample = 0;
    for (std::size_t g = 0; g < givers_.size(); ++g) {
      const Giver& giver = givers_[g];
      if (exchange_.at(giver.x, giver.y) && sample < giver.end_sample) {
        num_lonely_[g] = meet_neighbours(giver);
        for (std::size_t s = sample; s < giver.end_sample; ++s)
          end = make_offers(s, inner_index_[giver.rank] >= 0, end);
      }
      sample = giver.end_sample;
    }
    offers_.resize(static_cast<std::size_t>(end - offers_.data()));

    // Answer.
    receptions_.resize(std::max(receptions_.size(), offers_.size() + kReceptionPadding));
    poison(receptions_);
    scene_.receive(offers_, std::span(receptions_).first(offers_.size() + kReceptionPadding));

    // Book.
    if (settings_.form == SecondPassForm::corrected) {
      book_corrected();
    } else {
      book_published();
    }
    givers_.clear();
  }

  /// Adds what the pixels of `inner` got.
  void finish(std::span<Rgb> radiance) const {
    for (std::size_t rank = 0; rank < sums_.size(); ++rank) {
      if (inner_index_[rank] >= 0)
        radiance[static_cast<std::size_t>(inner_index_[rank])] += sums_[rank].radiance;
    }
  }

 private:
  /// The others of one square, with 32 random bits.
  struct Neighbours : SquareMembers::Others {
    std::uint32_t stratum = 0;
  };

  /// Lists the masked pixels that share a square with the giver. Returns the number of partitions
  /// without any.
  std::int32_t meet_neighbours(const Giver& giver) {
    const Rng rng(
        pixel_key(settings_.job_seed, settings_.frame, settings_.image_width, giver.x, giver.y),
        PassId::exchange);
    neighbours_.clear();
    Philox4x32::Counter random{};
    for (std::int32_t c = 0; c < partitions_.count(); ++c) {
      const auto word = static_cast<std::uint32_t>(c);
      if (word % 4 == 0) random = rng.bits(settings_.fold, word / 4);
      squares_[word].move_to(exchange_, partitions_, c, giver.y, ranks_);
      const SquareMembers::Others others = squares_[word].others(giver.x, giver.y);
      if (others.count > 0) neighbours_.push_back({others, random[word % 4]});
    }
    return partitions_.count() - static_cast<std::int32_t>(neighbours_.size());
  }

  /// Draws one (pixel, site) in each partition, uniformly; the slots of a pixel take different
  /// strata of it. Of a giver outside, only what comes in matters. Returns the end of the offers.
  Offer* make_offers(std::size_t sample, bool inside, Offer* offer) const {
    const auto shift = static_cast<std::uint32_t>((std::uint64_t{batch_[sample].slot} << 32) /
                                                  settings_.num_slots);
    const std::uint32_t num_sites = settings_.num_sites;
    for (const Neighbours& others : neighbours_) {
      const std::uint32_t position = others.stratum + shift;                // wraps around
      const std::uint64_t scaled = std::uint64_t{position} * others.count;  // 32 bits of fraction
      const std::uint32_t receiver = others.pick(static_cast<std::uint32_t>(scaled >> 32));
      if (!inside && inner_index_[receiver] < 0) continue;
      const auto site = static_cast<std::uint32_t>((scaled & 0xffffffffu) * num_sites >> 32);
      *offer++ = {static_cast<std::uint32_t>(sample), receiver, receiver * num_sites + site};
    }
    return offer;
  }

  /// a = min(1, p~' / p~).
  void book_corrected() {
    const auto acceptance = [](const GiverSample& given, const Giver&) {
      return [target = given.reflected.target](const Offer&, const Reflected& seen) {
        return 1 / std::max(target, seen.target);
      };
    };
    book(acceptance, [c = static_cast<float>(partitions_.count())](float accepted, std::int32_t) {
      return std::max(c - accepted, 0.0f);
    });
  }

  /// a = min(1, Lns' / Lns); what is refused is lost, or kept.
  void book_published() {
    const std::span<const float> lns = scene_.lns();
    const auto acceptance = [lns](const GiverSample&, const Giver& giver) {
      const float scale = lns[giver.rank] > 0 ? 1 / lns[giver.rank] : 0.0f;
      return [lns, scale](const Offer& offer, const Reflected& seen) {
        const float accepted = std::min(1.0f, lns[offer.receiver] * scale);
        return seen.target > kSmallestTarget ? accepted / seen.target : 0.0f;
      };
    };
    const bool lost = settings_.form == SecondPassForm::published;
    const auto c = static_cast<float>(partitions_.count());
    book(acceptance, [lost, c](float accepted, std::int32_t num_lonely) {
      return lost ? static_cast<float>(num_lonely) : std::max(c - accepted, 0.0f);
    });
  }

  /// Gives away the accepted shares of all samples of the batch; the giver keeps what is left.
  /// acceptance(sample, giver) is a function of an offer and what came of it: the probability over
  /// the receiver's target, finite where it reflects nothing. left(accepted, num_lonely): of C
  /// shares.
  template <class Acceptance, class Left>
  void book(const Acceptance& acceptance, const Left& left) {
    const auto c = static_cast<float>(partitions_.count());
    std::size_t sample = 0;
    std::size_t at = 0;
    for (std::size_t g = 0; g < givers_.size(); ++g) {
      for (; sample < givers_[g].end_sample; ++sample) {
        const GiverSample& given = batch_[sample];
        const auto accept = acceptance(given, givers_[g]);
        const float unit = given.energy / c;
        float accepted = 0;
        for (; at < offers_.size() && offers_[at].sample == sample; ++at) {
          // No branch on what the rays said: nothing reflected adds nothing.
          const Reflected& seen = receptions_[at];
          const float share_per_target = accept(offers_[at], seen);
          accepted += share_per_target * seen.target;
          add_scaled(sums_[offers_[at].receiver], seen, share_per_target * unit);
        }
        add_scaled(sums_[givers_[g].rank], given.reflected,
                   left(accepted, num_lonely_[g]) * unit / given.reflected.target);
      }
    }
  }

  const ExchangeSettings& settings_;
  const SquarePartitions& partitions_;
  const PixelMask& exchange_;
  const PixelRect inner_;
  ExchangeScene& scene_;
  const std::vector<std::int32_t> ranks_;  ///< (rectangle of the masks)
  std::vector<SquareMembers> squares_;     ///< (C)
  std::vector<Neighbours> neighbours_;     ///< those of the pixel in work, at most C
  std::vector<std::int32_t> inner_index_;  ///< (ranks) position in `inner`, or -1
  std::vector<Reflected> sums_;            ///< (ranks) what each got
  std::vector<Giver> givers_;
  /// (givers) partitions with nobody to offer to.
  std::vector<std::int32_t> num_lonely_;
  std::vector<GiverSample> batch_;
  std::vector<Offer> offers_;
  std::vector<Reflected> receptions_;
};

}  // namespace

void exchange_energy(const ExchangeSettings& settings, const SquarePartitions& partitions,
                     const PixelMask& exchange, const PixelMask& recompute, const PixelRect& inner,
                     ExchangeScene& scene, std::span<Rgb> radiance) {
  BATON_CHECK(radiance.size() == static_cast<std::size_t>(inner.area()));
  BATON_CHECK(exchange.rect() == recompute.rect() && settings.num_slots > 0 &&
              settings.num_sites > 0);
  Exchange work(settings, partitions, exchange, recompute, inner, scene);
  recompute.visit_all([&](std::int32_t x, std::int32_t y) { work.add(x, y); });
  work.flush();
  work.finish(radiance);
}

}  // namespace baton
