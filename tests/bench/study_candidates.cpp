// What a table of the product would buy: noise of the unshadowed light Lns of single pixels, from
// the candidates that all methods draw and from ones drawn by a table of light times BRDF
// [Conty Estevez & Lecocq 2018], 12 x 12 blocks of the map, at the same number of BRDF evaluations.
//
// Usage: study_candidates [STUDY.json] > CSV; the first measured frame of each scene
#include <array>
#include <map>
#include <numbers>
#include <string>

#include "common/math/low_discrepancy.h"
#include "jobs/study/study.h"
#include "tests/bench/sequential_runs.h"
#include "worker/integrator/candidate_samplers.h"
#include "worker/pass/primary.h"
#include "worker/scene/settle_motion.h"

namespace baton {
namespace {

constexpr int kSide = 12;
constexpr std::size_t kPools = 16;  ///< light pools, each with as many runs of every pixel
constexpr std::size_t kRuns = 16;
constexpr std::size_t kMaxPixels = 60;  ///< of a material
constexpr std::int32_t kCornerEvaluations = (kSide + 1) * (kSide + 1);

/// Position of a value in cumulative sums, and how far into its step it is, [0, 1).
struct Place {
  std::size_t step;
  double rest;
};
Place find(std::span<const double> sums, double u) {
  const double x = u * sums.back();
  const auto above = std::upper_bound(sums.begin(), sums.end(), x);
  const auto step =
      std::min<std::size_t>(static_cast<std::size_t>(above - sums.begin()), sums.size() - 1);
  const double before = step == 0 ? 0.0 : sums[step - 1];
  return {step, std::clamp((x - before) / std::max(sums[step] - before, 1e-300), 0.0, 0.9999999)};
}

/// The blocks of a bilinear map's table, and what lies below them.
class MapBlocks {
 public:
  explicit MapBlocks(const Environment& light)
      : light_(light), width_(light.map->width()), rows_(light.map->height() + 1) {
    BATON_CHECK(light.map->filter() == MapFilter::bilinear);
    down_.resize(static_cast<std::size_t>(width_ * rows_));
    for (int block = 0; block < kSide; ++block) {
      for (int i = 0; i < width_; ++i) {
        double sum = 0;
        for (int j = first(block, rows_); j < first(block + 1, rows_); ++j)
          down_[at(i, j)] = sum += mass(i, j);
        columns_[static_cast<std::size_t>(block)].push_back(sum);
        power_[static_cast<std::size_t>(block * kSide + block_of(i, width_))] += sum;
      }
    }
  }
  double power(int row, int column) const {
    return power_[static_cast<std::size_t>(row * kSide + column)];
  }
  std::size_t block_at(const Vec3& world) const {
    const auto [i, j] = cell_at(world);
    return static_cast<std::size_t>(block_of(j, rows_) * kSide + block_of(i, width_));
  }
  /// World direction of a corner of the blocks.
  Vec3 corner(int row, int column) const {
    return direction(static_cast<double>(first(column, width_)) + 0.5,
                     static_cast<double>(first(row, rows_)) - 0.5);
  }
  /// A direction within a block, by the light there.
  Vec3 sample(int row, int column, double u, double v) const {
    const auto begin = static_cast<std::size_t>(first(column, width_));
    const auto end = static_cast<std::size_t>(first(column + 1, width_));
    std::vector<double> sums;
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i)
      sums.push_back(sum += columns_[static_cast<std::size_t>(row)][i]);
    const Place across = find(sums, u);
    const int i = static_cast<int>(begin + across.step);
    sums.clear();
    for (int j = first(row, rows_); j < first(row + 1, rows_); ++j) sums.push_back(down_[at(i, j)]);
    const Place along = find(sums, v);
    const int j = first(row, rows_) + static_cast<int>(along.step);
    const double top = cosine(j), bottom = cosine(j + 1);
    const double polar = std::acos(top + (bottom - top) * along.rest);
    return direction(i + 0.5 + across.rest, polar / std::numbers::pi * (rows_ - 1) - 0.5);
  }

 private:
  static int first(int block, int count) { return block * count / kSide; }
  static int block_of(int index, int count) {
    int block = index * kSide / count;
    while (first(block + 1, count) <= index) ++block;
    return block;
  }
  std::size_t at(int i, int j) const { return static_cast<std::size_t>(j * width_ + i); }
  /// Of the upper edge of a row of cells.
  double cosine(int row) const {
    return std::cos(std::clamp((row - 0.5) / (rows_ - 1), 0.0, 1.0) * std::numbers::pi);
  }
  double mass(int i, int j) const {
    const auto texel = static_cast<std::size_t>(j * light_.map->stride() + i + 1);
    return double{light_.map->texels()[texel].density} * (cosine(j) - cosine(j + 1)) * 2 *
           std::numbers::pi / width_;
  }
  /// x, y: texels from the left and, less one half, from the top.
  Vec3 direction(double x, double y) const {
    const double azimuth = (0.5 - x / width_) * 2 * std::numbers::pi;
    const double polar = std::clamp((y + 0.5) / (rows_ - 1), 0.0, 1.0) * std::numbers::pi;
    return light_.rotation * Vec3{static_cast<float>(std::sin(polar) * std::sin(azimuth)),
                                  static_cast<float>(std::cos(polar)),
                                  static_cast<float>(std::sin(polar) * std::cos(azimuth))};
  }
  std::pair<int, int> cell_at(const Vec3& world) const {
    const Vec3 w = light_.rotation.transposed() * world;
    const double x = (0.5 - std::atan2(w.x, w.z) / (2 * std::numbers::pi)) * width_ - 0.5;
    const double y = std::acos(std::clamp(w.y, -1.0f, 1.0f)) / std::numbers::pi * (rows_ - 1) + 0.5;
    const int i = static_cast<int>(std::floor(x));
    return {(i + width_) % width_, std::min(static_cast<int>(y), rows_ - 1)};
  }

  const Environment& light_;
  const int width_, rows_;
  std::vector<double> down_;                        ///< sums down the rows of a block, by cell
  std::array<std::vector<double>, kSide> columns_;  ///< by row of blocks: mass of its columns
  std::array<double, kSide * kSide> power_{};
};

/// (f cos)_rgb and the lobe's density along directions, for a pixel of one site.
struct Reflectance {
  std::vector<float> r, g, b, pdf;
};
Reflectance reflectance(const SiteBlock& sites, const std::vector<Vec3>& w) {
  std::vector<float> x, y, z;
  for (const Vec3& v : w) {
    x.push_back(v.x);
    y.push_back(v.y);
    z.push_back(v.z);
  }
  const std::vector<std::int32_t> site(w.size(), 0);
  Reflectance out;
  for (auto* column : {&out.r, &out.g, &out.b, &out.pdf}) column->resize(w.size());
  kernels::evaluate_bsdf(sites, site, x, y, z, out.r, out.g, out.b, out.pdf);
  return out;
}

/// One estimate of Lns from `counts` candidates, points of the pixel's own. Those of the light: by
/// the product table, or by the map alone.
double map_estimate(const SiteBlock& sites, const Environment& light, const MapBlocks& blocks,
                    const CandidateCounts& counts, bool by_table, const Rng& rng) {
  // The table.
  std::vector<Vec3> corners;
  for (int row = 0; row <= kSide; ++row) {
    for (int column = 0; column <= kSide; ++column) corners.push_back(blocks.corner(row, column));
  }
  const Reflectance at_corner = reflectance(sites, corners);
  const auto mean_at = [&](int row, int column) {
    const auto i = static_cast<std::size_t>(row * (kSide + 1) + column);
    return (at_corner.r[i] + at_corner.g[i] + at_corner.b[i]) / 3;
  };
  std::array<double, kSide * kSide> table{};
  double total = 0, brightest = 0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) {
        const double f = (mean_at(row, column) + mean_at(row + 1, column) +
                          mean_at(row, column + 1) + mean_at(row + 1, column + 1)) /
                         4;
        brightest = std::max(brightest, f);
        if (pass == 0) continue;
        // What no corner sees may still be seen in between.
        const auto k = static_cast<std::size_t>(row * kSide + column);
        total += table[k] = blocks.power(row, column) * (by_table ? f + 0.02 * brightest : 1.0);
      }
    }
  }

  // Draw.
  std::array<double, kSide> across{};
  double sum = 0;
  for (int column = 0; column < kSide; ++column) {
    for (int row = 0; row < kSide; ++row)
      sum += table[static_cast<std::size_t>(row * kSide + column)];
    across[static_cast<std::size_t>(column)] = sum;
  }
  const Philox4x32::Counter shift = rng.bits(0, 7);
  const auto point = [&](std::size_t i) {
    return std::array{uniform_float(sobol_table().x[i] ^ shift[0]),
                      uniform_float(sobol_table().y[i] ^ shift[1])};
  };
  std::vector<Vec3> w;
  for (std::int32_t i = 0; i < counts.from_light; ++i) {
    const auto u = point(static_cast<std::size_t>(i));
    const Place column = find(across, u[0]);
    std::array<double, kSide> down{};
    double rows = 0;
    for (std::size_t row = 0; row < kSide; ++row)
      down[row] = rows += table[row * kSide + column.step];
    const Place row = find(down, u[1]);
    w.push_back(blocks.sample(static_cast<int>(row.step), static_cast<int>(column.step),
                              column.rest, row.rest));
  }
  SiteBlock lobe = sites;
  lobe.specular_probability[0] = 1;
  for (std::int32_t i = 0; i < counts.from_bsdf; ++i) {
    const auto u = point(static_cast<std::size_t>(i));
    const std::int32_t site = 0;
    Vec3 v;
    kernels::sample_bsdf(lobe, {&site, 1}, {&u[0], 1}, {&u[1], 1}, {&v.x, 1}, {&v.y, 1}, {&v.z, 1});
    w.push_back(v);
  }

  // Weigh by the balance heuristic.
  const Reflectance f = reflectance(lobe, w);
  double estimate = 0;
  for (std::size_t i = 0; i < w.size(); ++i) {
    const EnvironmentMap::Texel l = light.evaluate(w[i]);
    const std::size_t k = blocks.block_at(w[i]);
    const double power = blocks.power(static_cast<int>(k / kSide), static_cast<int>(k % kSide));
    const double q = power > 0 ? l.density * table[k] / (total * power) : 0;
    const double proposal = counts.from_light * q + counts.from_bsdf * double{f.pdf[i]};
    if (proposal > 0) estimate += (f.r[i] * l.r + f.g[i] * l.g + f.b[i] * l.b) / 3 / proposal;
  }
  return estimate;
}

enum class Source { pool, map, table };
constexpr std::array<const char*, 3> kSources{"pool", "map", "table"};

struct Row {
  std::int32_t num_candidates;
  Source source;
};
/// With a table the corners where it asks the BRDF count as candidates.
constexpr std::array kRows{Row{128 + kCornerEvaluations, Source::pool},
                           Row{128 + kCornerEvaluations, Source::map},
                           Row{128, Source::table},
                           Row{512 + kCornerEvaluations, Source::pool},
                           Row{512 + kCornerEvaluations, Source::map},
                           Row{512, Source::table}};

/// Estimates of one pixel's Lns.
struct Estimates {
  double sum = 0, squares = 0;
  std::array<double, kPools> sum_of_pool{};
  void add(std::size_t pool, double x) {
    sum += x;
    squares += x * x;
    sum_of_pool[pool] += x;
  }
  static constexpr double kCount = kPools * kRuns;
  double mean() const { return sum / kCount; }
  double variance() const {
    return std::max(0.0, squares / kCount - mean() * mean()) * kCount / (kCount - 1);
  }
};

/// Mean over pixels of an estimate over the truth, by light pool: pixels share those.
std::array<double, kPools> shares(const std::vector<Estimates>& pixels,
                                  const std::vector<Estimates>& truth) {
  std::array<double, kPools> out{};
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (std::size_t p = 0; p < kPools; ++p) {
      out[p] +=
          pixels[i].sum_of_pool[p] / (kRuns * truth[i].mean()) / static_cast<double>(pixels.size());
    }
  }
  return out;
}

/// Pixels by the name of their material, evenly spread.
std::map<std::string, std::vector<SiteBlock>> pixels_of(const RenderContext& context,
                                                        std::int32_t frame) {
  const auto geometry = value_of(context.geometry->at(frame));
  const TileSurfaces surfaces = trace_primary(
      context.job, *geometry, {0, 0, context.job.image.width, context.job.image.height});
  std::map<std::string, std::vector<SiteBlock>> all;
  for (std::size_t i = 0; i < surfaces.first_site.size(); ++i) {
    if (!surfaces.sees_surface(i)) continue;
    SiteBlock sites;
    context.gather_sites(surfaces.pixel(i), sites);
    all[std::next(context.job.scene.materials.begin(), surfaces.first_surface(i).material)->first]
        .push_back(sites);
  }
  for (auto& [name, pixels] : all) {
    std::vector<SiteBlock> some;
    const std::size_t count = std::min(kMaxPixels, pixels.size());
    for (std::size_t i = 0; i < count; ++i) some.push_back(pixels[i * pixels.size() / count]);
    pixels = some;
  }
  return all;
}

/// Root mean square over pixels of the relative standard deviation, and the mean difference from
/// `judge`, with the half-width of its 95 % interval.
void print(const std::string& label, const Row& row, const std::vector<Estimates>& pixels,
           const std::vector<Estimates>& judge) {
  double noise = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    noise += pixels[i].variance() / (judge[i].mean() * judge[i].mean());
  const auto own = shares(pixels, judge), others = shares(judge, judge);
  double off = 0, squares = 0;
  for (std::size_t p = 0; p < kPools; ++p) {
    const double d = own[p] - others[p];
    off += d / kPools;
    squares += d * d / kPools;
  }
  constexpr double kStudent = 2.131;  // of 15 degrees of freedom
  fmt::print("{},{},{},{:.2f},{:.2f},{:.2f}\n", label,
             kSources[static_cast<std::size_t>(row.source)],
             row.num_candidates + (row.source == Source::table ? kCornerEvaluations : 0),
             100 * std::sqrt(noise / static_cast<double>(pixels.size())), 100 * off,
             100 * kStudent * std::sqrt((squares - off * off) / (kPools - 1)));
}

/// Runs one row for the pixels of one material.
std::vector<Estimates> estimate(const std::vector<SiteBlock>& pixels, const FrameLight& light,
                                const MapBlocks& blocks, float brdf_fraction, const Row& row) {
  const EnvironmentView view = view_of(light.now);
  std::vector<Estimates> estimates(pixels.size());
  auto set = std::make_unique<kernels::CandidateSet>();
  for (std::uint32_t p = 0; p < kPools; ++p) {
    const LightPool pool =
        make_light_pool(light.now, light.before, p, 0,
                        {.num_taken = static_cast<std::uint32_t>(row.num_candidates)});
    for (std::size_t i = 0; i < pixels.size() * kRuns; ++i) {
      const SiteBlock& sites = pixels[i / kRuns];
      const CandidateCounts counts = candidate_counts(sites, row.num_candidates, brdf_fraction);
      const Rng rng({.job_seed = p, .pixel = static_cast<std::uint32_t>(i)}, PassId::candidates);
      if (row.source != Source::pool) {
        estimates[i / kRuns].add(
            p, map_estimate(sites, light.now, blocks, counts, row.source == Source::table, rng));
      } else {
        kernels::draw_candidates(sites, view, pool, counts, rng, *set);
        estimates[i / kRuns].add(p, set->total);
      }
    }
  }
  return estimates;
}

int run(const std::string& path) {
  const Study study = value_of(load_study(path));
  fmt::print(
      "scene,material,candidates,evaluations,noisePercent,differencePercent,"
      "differenceHalfWidth\n");
  for (const StudyScene& scene : study.scenes) {
    JobSpec job = value_of(settle_motion(scene.reference.front()));
    job.image.sites = 1;
    const auto context = value_of(load_render_context(job, Digest{1, 1}));
    const auto light = value_of(context->lights->at(0));
    const MapBlocks blocks(light->now);
    for (const auto& [material, pixels] : pixels_of(*context, 0)) {
      std::vector<Estimates> judge;
      for (const Row& row : kRows) {
        const std::vector<Estimates> estimates =
            estimate(pixels, *light, blocks, job.sampling.brdf_fraction, row);
        if (judge.empty()) judge = estimates;
        print(scene.name + "," + material, row, estimates, judge);
      }
    }
  }
  return 0;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  return baton::run(argc > 1 ? argv[1] : "jobs/studies/real-scenes.json");
}
