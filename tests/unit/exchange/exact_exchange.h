#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "worker/exchange/energy_exchange.h"
#include "worker/sampling/folds.h"

namespace baton::exact {

/// A handful of pixels that see a handful of directions: every expectation can be written down.
struct Scene {
  std::int32_t width = 1, height = 1;
  std::size_t num_sites = 1, num_directions = 1;
  std::vector<Rgb> reflected;         ///< (pixels, sites, directions) f cos L
  std::vector<std::uint8_t> visible;  ///< (pixels, sites, directions)

  Scene(std::int32_t w, std::int32_t h, std::size_t directions, std::size_t sites = 1)
      : width(w), height(h), num_sites(sites), num_directions(directions) {
    reflected.assign(num_pixels() * sites * directions, Rgb{1, 1, 1});
    visible.assign(reflected.size(), 1);
  }
  PixelRect rect() const { return {0, 0, width, height}; }
  std::size_t num_pixels() const { return static_cast<std::size_t>(width * height); }
  std::size_t num_points() const { return num_sites * num_directions; }
  std::size_t at(std::size_t pixel, std::size_t direction, std::size_t site = 0) const {
    return (pixel * num_sites + site) * num_directions + direction;
  }
  float target(std::size_t point) const { return mean(reflected[point]); }
  double lns(std::size_t pixel) const {
    double sum = 0;
    for (std::size_t i = 0; i < num_points(); ++i)
      sum += target(at(pixel, 0) + i) / static_cast<double>(num_sites);
    return sum;
  }
  /// The shadowed radiance.
  Rgb truth(std::size_t pixel) const {
    Rgb sum;
    for (std::size_t i = at(pixel, 0); i < at(pixel, 0) + num_points(); ++i) {
      if (visible[i] != 0) sum += reflected[i] / static_cast<float>(num_sites);
    }
    return sum;
  }
};

/// One sample of the first pass.
struct Sample {
  std::uint32_t slot = 0;
  std::size_t point = 0;  ///< in the arrays of the scene
  float energy = 0;
};

/// The samples of a first pass over a scene, handed to the exchange population by population.
class Source final : public ExchangeScene {
 public:
  /// Draws num_slots samples per pixel from p~, in independent populations of equal size;
  /// systematic within each.
  Source(const Scene& scene, std::uint32_t num_slots, std::uint32_t num_populations,
         std::uint32_t seed)
      : scene_(scene),
        num_slots_(num_slots),
        per_population_(num_slots / num_populations),
        samples_(scene.num_pixels() * num_slots) {
    for (std::size_t pixel = 0; pixel < scene.num_pixels(); ++pixel) {
      lns_.push_back(static_cast<float>(scene.lns(pixel)));
      const Rng rng({.job_seed = seed, .frame = 0, .pixel = static_cast<std::uint32_t>(pixel)},
                    PassId::choose);
      for (std::uint32_t k = 0; k < num_populations; ++k) draw(pixel, k, rng.uniforms(k, 0)[0]);
    }
  }

  void use(const Fold& fold) { fold_ = fold; }

  PixelMask failed(const Fold& fold) const {
    PixelMask mask(scene_.rect());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const auto pixel = static_cast<std::int32_t>(i / num_slots_);
      const bool counts =
          fold.mask_population < 0 || population(samples_[i]) == fold.mask_population;
      if (counts && scene_.visible[samples_[i].point] == 0)
        mask.set(pixel % scene_.width, pixel / scene_.width);
    }
    return mask;
  }

  void load_samples(std::span<Giver> givers, std::vector<GiverSample>& batch) override {
    batch.clear();
    points_.clear();
    for (Giver& giver : givers) {
      const std::size_t pixel = giver.rank;  // all pixels have one
      for (std::size_t i = pixel * num_slots_; i < (pixel + 1) * num_slots_; ++i) {
        const Sample& s = samples_[i];
        const bool given = fold_.giver_population < 0 || population(s) == fold_.giver_population;
        if (!given || scene_.visible[s.point] == 0) continue;
        batch.push_back({.slot = s.slot,
                         .energy = s.energy * fold_.energy_scale,
                         .reflected = {scene_.reflected[s.point], scene_.target(s.point)}});
        points_.push_back(s.point);
      }
      giver.end_sample = batch.size();
    }
  }

  void receive(std::span<const Offer> offers, std::span<Reflected> receptions) override {
    for (std::size_t i = 0; i < offers.size(); ++i) {
      const std::size_t direction = points_[offers[i].sample] % scene_.num_directions;
      const std::size_t point =
          scene_.at(offers[i].receiver, direction, offers[i].surface % scene_.num_sites);
      receptions[i] = {};
      if (scene_.visible[point] != 0)
        receptions[i] = {scene_.reflected[point], scene_.target(point)};
    }
  }
  std::span<const float> lns() const override { return lns_; }

 private:
  int population(const Sample& s) const { return static_cast<int>(s.slot / per_population_); }

  void draw(std::size_t pixel, std::uint32_t k, float u) {
    const double lns = scene_.lns(pixel);
    std::size_t point = 0;
    double passed = 0;  // share of Lns before `point`
    const auto share = [&] {
      return scene_.target(scene_.at(pixel, 0) + point) / static_cast<double>(scene_.num_sites) /
             lns;
    };
    for (std::uint32_t j = 0; j < per_population_; ++j) {
      const double position = (j + double{u}) / per_population_;
      while (point + 1 < scene_.num_points() && position >= passed + share()) {
        passed += share();
        ++point;
      }
      const std::uint32_t slot = k * per_population_ + j;
      samples_[pixel * num_slots_ + slot] = {slot, scene_.at(pixel, 0) + point,
                                             static_cast<float>(lns / num_slots_)};
    }
  }

  const Scene& scene_;
  const std::uint32_t num_slots_, per_population_;
  std::vector<Sample> samples_;      ///< (pixels, slots)
  std::vector<float> lns_;           ///< (pixels)
  std::vector<std::size_t> points_;  ///< of the batch
  Fold fold_;
};

struct Method {
  SecondPassForm form = SecondPassForm::corrected;
  MaskPolicy policy = MaskPolicy::cross_fold;
  /// Every pixel takes part, whatever its rays said.
  bool mask_all = false;
  std::int32_t side = 5, partitions = 4, dilate = 0;
  std::uint32_t num_slots = 16;
};

inline PixelMask everything(const PixelRect& rect) {
  PixelMask mask(rect);
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    for (std::int32_t x = rect.x0; x < rect.x1; ++x) mask.set(x, y);
  }
  return mask;
}

inline SquarePartitions partitions_of(const Scene& scene, const Method& method,
                                      std::uint64_t seed) {
  return {scene.rect(), method.side, method.partitions, Rng({.job_seed = seed}, PassId::partition)};
}

/// One run of both passes: the radiance of each pixel.
inline std::vector<Rgb> render(const Scene& scene, const Method& method, std::uint32_t seed,
                               std::optional<PixelRect> inner = std::nullopt) {
  const std::uint32_t populations = method.policy == MaskPolicy::same_samples ? 1 : 2;
  Source source(scene, method.num_slots, populations, seed);
  const SquarePartitions partitions = partitions_of(scene, method, seed);
  const PixelRect rect = inner.value_or(scene.rect());
  std::vector<Rgb> radiance(static_cast<std::size_t>(rect.area()));
  ExchangeSettings settings{.form = method.form,
                            .num_slots = method.num_slots,
                            .num_sites = static_cast<std::uint32_t>(scene.num_sites),
                            .job_seed = seed,
                            .image_width = scene.width};
  const PixelMask all = everything(scene.rect());
  for (const Fold& fold : folds_of(method.policy)) {
    source.use(fold);
    const PixelMask mask =
        method.mask_all ? all : dilate(source.failed(fold), method.dilate, all, scene.rect());
    exchange_energy(settings, partitions, mask, all, rect, source, radiance);
    ++settings.fold;
  }
  return radiance;
}

/// Mean over independent runs and its standard error, per pixel and channel.
struct Estimate {
  std::vector<double> mean, error;  ///< (pixels, 3)
};
inline Estimate estimate(const Scene& scene, const Method& method, int runs) {
  const std::size_t n = scene.num_pixels() * 3;
  std::vector<double> sum(n), squares(n);
  for (int run = 1; run <= runs; ++run) {
    const std::vector<Rgb> pixels = render(scene, method, static_cast<std::uint32_t>(run));
    for (std::size_t i = 0; i < n; ++i) {
      const Rgb& p = pixels[i / 3];
      const double v = i % 3 == 0 ? p.x : i % 3 == 1 ? p.y : p.z;
      sum[i] += v;
      squares[i] += v * v;
    }
  }
  Estimate e;
  for (std::size_t i = 0; i < n; ++i) {
    const double m = sum[i] / runs;
    e.mean.push_back(m);
    e.error.push_back(std::sqrt(std::max(squares[i] / runs - m * m, 0.0) / (runs - 1)));
  }
  return e;
}

}  // namespace baton::exact
