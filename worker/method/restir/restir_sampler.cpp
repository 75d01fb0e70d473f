#include "worker/method/restir/restir_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "common/base/poison.h"
#include "common/math/hilbert.h"
#include "worker/method/carried/carried_light.h"
#include "worker/method/carried/carried_set.h"
#include "worker/method/restir/blocked_samples.h"
#include "worker/method/weighted/populations.h"

namespace baton {
namespace {

using kernels::PointRange;
using kernels::RestirPoints;

/// The sets of one pixel, gathered one after the other.
class SetGatherer {
 public:
  SetGatherer(RestirPoints& points, std::int32_t history_limit)
      : points_(points), history_limit_(static_cast<float>(history_limit)) {}

  std::span<const RestirSet> sets() const { return std::span(sets_).first(num_sets_); }
  /// Surfaces of the carried sets, null where they are those of now.
  std::span<const OldSurfaces* const> surfaces() const {
    return std::span(surfaces_).first(num_sets_ - 1);
  }
  std::size_t count() const { return count_; }

  /// The fresh set, whose samples lie in `points` already.
  void add_fresh(std::size_t n, float lns) {
    if (!(lns > 0)) n = 0;
    for (std::size_t j = 0; j < n; ++j) {
      points_.contribution[j] *= lns;
      points_.target_now[j] = (points_.r[j] + points_.g[j] + points_.b[j]) / 3;
    }
    count_ = n;
    end_set(1, nullptr);
  }
  /// A carried set. target_before: its own targets, if they are known; else empty.
  void add_carried(const CarriedSet& set, std::span<const float> target_before) {
    RestirPoints::Column<float>& known = points_.target_before[num_sets_ - 1];
    for (std::size_t j = 0; j < set.weight.size(); ++j) {
      if (!(set.weight[j] > 0)) continue;
      points_.code[count_] = set.direction[j];
      points_.site[count_] = set.site[j];
      points_.contribution[count_] = set.lns * set.weight[j];
      if (!target_before.empty()) known[count_] = target_before[j];
      ++count_;
    }
    end_set(std::min(static_cast<float>(set.confidence), history_limit_), set.surfaces);
  }
  /// Gives the vector that covers the last points directions and sites to evaluate, and turns the
  /// carried samples, unless `turn` is null.
  void finish(const Mat3* turn) {
    points_.code.pad(count_, OctDirection{0});
    points_.site.pad(count_, std::uint8_t{0});
    if (turn != nullptr) kernels::turn_points(*turn, sets_[0].end, count_, points_);
  }

 private:
  void end_set(float confidence, const OldSurfaces* surfaces) {
    const bool is_fresh = num_sets_ == 0;
    sets_[num_sets_] = {count_, confidence,
                        is_fresh ? nullptr : points_.target_before[num_sets_ - 1].from(0)};
    if (!is_fresh) surfaces_[num_sets_ - 1] = surfaces;
    ++num_sets_;
  }

  RestirPoints& points_;
  const float history_limit_;
  std::array<RestirSet, kMaxRestirSets> sets_;
  std::array<const OldSurfaces*, kMaxRestirSets> surfaces_{};
  std::size_t num_sets_ = 0;
  std::size_t count_ = 0;
};

/// Places along a Hilbert curve through 64 x 64 cells of the lattice of directions.
class DirectionCurve {
 public:
  DirectionCurve() {
    for (std::uint32_t cell = 0; cell < place_.size(); ++cell) {
      const std::uint32_t index =
          hilbert_index(cell % kSide << kShift, cell / kSide << kShift) >> 2 * kShift;
      place_[cell] = static_cast<std::uint16_t>(index);
    }
  }
  std::uint32_t place(OctDirection code) const {
    return place_[(code >> (16 + kShift)) * kSide + ((code & 0xFFFFu) >> kShift)];
  }

 private:
  static constexpr std::uint32_t kBits = 6, kSide = 1u << kBits, kShift = 16 - kBits;
  std::array<std::uint16_t, kSide * kSide> place_;
};

/// Chooses systematically along the curve of directions, not set after set: what is kept is spread
/// over the reflected light, as fresh samples are.
void pick_along_curve(const RestirPoints& points, std::size_t count, double total, float u,
                      std::span<std::uint32_t> picks) {
  static const DirectionCurve curve;
  constexpr int kIndexBits = 12;
  static_assert(RestirPoints::kMost <= 1u << kIndexBits);
  std::array<std::uint32_t, RestirPoints::kMost> order;
  for (std::uint32_t i = 0; i < count; ++i)
    order[i] = curve.place(points.code[i]) << kIndexBits | i;
  std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
  std::array<float, RestirPoints::kMost> weight;
  for (std::size_t k = 0; k < count; ++k) {
    order[k] &= (1u << kIndexBits) - 1;
    weight[k] = points.weight[order[k]];
  }
  pick_systematically(std::span(weight).first(count), total, u, picks);
  for (std::uint32_t& pick : picks) pick = order[pick];
}

/// Makes points `picks` the samples of the pixel.
void take(const RestirPoints& from, std::span<const std::uint32_t> picks,
          const PixelSamples& samples) {
  for (std::size_t j = 0; j < picks.size(); ++j) {
    const std::size_t i = picks[j];
    samples.direction[j] = from.code[i];
    samples.site[j] = from.site[i];
    samples.weight[j] = 1.0f / static_cast<float>(picks.size());
    samples.r[j] = from.r[i];
    samples.g[j] = from.g[i];
    samples.b[j] = from.b[i];
  }
}

/// Targets of all sets at all points; returns how many were evaluated. own_is_known: those of set 1
/// at its own points.
std::size_t evaluate(const PixelInput& input, const kernels::CarriedLight& light,
                     const SetGatherer& all, bool has_own, bool own_is_known,
                     RestirPoints& points) {
  const std::span<const RestirSet> sets = all.sets();
  const std::size_t num_old = all.surfaces().size();
  const bool unchanged = has_own && input.start.old == nullptr && light.still;
  std::size_t evaluations = 0;
  const auto ask = [&](const PointRange& range) {
    if (range.first == range.last) return;
    const std::size_t each = (range.wants_now ? 1 : 0) + num_old - range.first_old;
    evaluations += (range.last - range.first) * each;
    if (each > 0) kernels::evaluate_points(input.sites, all.surfaces(), light, range, points);
  };

  // Where nothing has changed, the target of then is that of now.
  const std::size_t first_old = unchanged ? 1 : 0;
  const std::size_t end_of_own = has_own ? sets[1].end : sets[0].end;
  ask({.first = 0, .last = sets[0].end, .first_old = first_old});
  ask({.first = sets[0].end,
       .last = end_of_own,
       .wants_now = true,
       .first_old = own_is_known ? 1 : first_old});
  ask({.first = end_of_own, .last = all.count(), .wants_now = true, .first_old = first_old});
  if (unchanged)
    std::copy_n(points.target_now.from(0), all.count(), points.target_before[0].from(0));
  return evaluations;
}

}  // namespace

RestirSampler::RestirSampler(const JobSpec& job)
    : WeightedSampler(job),
      fresh_(population_spec(job).num_candidates, job.sampling.brdf_fraction),
      history_limit_(job.sampling.history_limit),
      reuse_visibility_(job.sampling.reuse_visibility) {}

PixelMethod make_restir_method(const JobSpec& job) {
  return {.format = &weighed_sample_format(),
          .start = [job] { return std::make_unique<RestirSampler>(job); }};
}

void RestirSampler::learn(const FoundRays& found, const PixelState& pixel) {
  if (reuse_visibility_) forget_blocked(found, pixel.index, pixel.tile);
}

PixelDiagnostics RestirSampler::draw(const PixelInput& input, const SetPlace& at,
                                     const PixelSamples& samples) {
  poison(points_);
  RestirPoints& points = points_;
  const std::span<const CarriedSet> neighbors = input.start.neighbors;
  std::uint16_t& confidence = confidence_plane(at.pixel.tile)[at.pixel.index];
  const std::size_t n = samples.weight.size();
  const bool has_own = input.start.has_history && confidence > 0;

  // A fresh set. Alone it is the pixel's.
  float lns = 0, lns_fresh = 0;
  PixelSource source = PixelSource::fresh;
  if (!has_own && neighbors.empty()) {
    confidence = 1;
    return fresh_.sample(input, samples);
  }
  BATON_CHECK(neighbors.size() <= limits::kMaxNeighbors);
  PixelDiagnostics diagnostics = fresh_.sample(
      input, {points.code.first(n), points.site.first(n), points.contribution.first(n),
              points.r.first(n), points.g.first(n), points.b.first(n), lns, lns_fresh, source});

  // The sets of the frame before. Their own targets are those of the directions that they had: a
  // direction that has been turned is rounded anew, and all densities of a weight must be taken at
  // one place, since only there the light, which may change steeply, is the same in all of them.
  const kernels::CarriedLight light = carried_light(input);
  const bool own_is_known = has_own && !at.target_before.empty() && light.turn == nullptr;
  SetGatherer all(points, history_limit_);
  all.add_fresh(n, lns);
  if (has_own) {
    all.add_carried({.direction = samples.direction,
                     .site = samples.site,
                     .weight = samples.weight,
                     .lns = samples.lns,
                     .confidence = confidence,
                     .surfaces = input.start.old},
                    own_is_known ? at.target_before : std::span<const float>());
  }
  for (const CarriedSet& neighbor : neighbors) all.add_carried(neighbor, {});
  all.finish(light.turn);

  // Weigh them together and choose.
  diagnostics.target_evaluations +=
      static_cast<std::int32_t>(evaluate(input, light, all, has_own, own_is_known, points));
  const double total =
      weigh_restir_sets(all.sets(), points.contribution.first(all.count()),
                        points.target_now.first(all.count()), points.weight.first(all.count()));
  confidence = next_confidence(all.sets(), history_limit_);
  samples.source = PixelSource::carried;
  const auto new_lns = static_cast<float>(total);
  if (!(new_lns > 0 && std::isfinite(new_lns))) {
    set_dark(samples);
    samples.lns_fresh = 0;
    diagnostics.ess = 0;
    return diagnostics;
  }
  std::array<std::uint32_t, limits::kMaxParticles> picks;
  pick_along_curve(points, all.count(), total, Rng(input.key, PassId::resample).uniforms(0, 0)[0],
                   std::span(picks).first(n));
  take(points, std::span(picks).first(n), samples);
  samples.lns = samples.lns_fresh = new_lns;
  diagnostics.ess = static_cast<float>(n);
  diagnostics.resampled = true;
  return diagnostics;
}

}  // namespace baton
