#include "jobs/study/unit_costs.h"

#include <cstdint>
#include <set>
#include <vector>

#include "common/job/sequence.h"

namespace baton {
namespace {

/// Microseconds of a frame's light: to read and to reduce a texel of a file, a texel's share of
/// mixing and table, a pool and what it takes longer for each texel of the table.
constexpr double kReadTexel = 0.040;
constexpr double kReduceTexel = 0.005;
constexpr double kTableTexel = 0.0095;
constexpr double kPool = 2100;
constexpr double kPoolTexel = 0.003;

/// Microseconds of one of each. A move costs what it evaluates.
struct UnitCosts {
  double pixel;       ///< surfaces, film, the pixel's share of its sampler
  double shadow_ray;  ///< trace and shade; with a second pass, of either pass
  double evaluation;
};

UnitCosts units_of(const JobSpec& job) {
  // Fitted with one M alone, so the evaluations are those of bidirectional.
  if (job.visibility.correlated) return {2.50, 0.101, 0.0020};
  switch (job.sampling.method) {
    case Method::sequential:
      return {1.44, 0.087, 0.0075};
    case Method::pool:
      return {1.35, 0.090, 0.0036};
    case Method::bidirectional:
      return {1.00, 0.080, 0.0020};
    case Method::mis:
      return {1.37, 0.073, 0.0};
    default:
      return {0.76, 0.075, 0.0025};
  }
}

}  // namespace

double counted_cost_us(const JobSpec& job, const RunCounts& counts) {
  const auto count = [](std::uint64_t n) { return static_cast<double>(n); };
  const UnitCosts unit = units_of(job);
  return unit.pixel * count(counts.lit_pixels()) + unit.shadow_ray * count(counts.rays_shadow) +
         unit.evaluation * count(counts.target_evaluations);
}

double counted_light_us(const JobSpec& job, double file_texels, double texels) {
  // A map is read where the frames first need it; new texels need a new table, each frame a pool.
  std::set<std::int32_t> read;
  double tables = 0;
  const std::vector<FrameSpec> frames = expand_sequence(job);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const EnvironmentFrame& light = frames[i].environment;
    read.insert(light.map_a);
    if (light.mix > 0) read.insert(light.map_b);
    if (i == 0 || !light.same_texels(frames[i - 1].environment)) tables += 1;
  }
  const double reduced = texels < file_texels ? kReduceTexel : 0;
  return static_cast<double>(read.size()) * (kReadTexel + reduced) * file_texels +
         tables * kTableTexel * texels +
         static_cast<double>(frames.size()) * (kPool + kPoolTexel * texels);
}

}  // namespace baton
