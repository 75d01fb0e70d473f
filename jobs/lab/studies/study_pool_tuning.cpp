// What each tuned number of the pool sampler (worker/sampling/pool_tuning.h) is worth: half and
// twice of it, one at a time. Efficiency is 1 / (squared error x CPU time) of the measured frames,
// over that of the numbers in use; 95 % intervals by resampling the seeds. All variants take turns
// in one process.
//
// Usage: study_pool_tuning STUDY.json [SEEDS] > CSV; the study's cells with method `pool`
#include <string>

#include "common/scene/settle/settle_motion.h"
#include "jobs/lab/studies/sequential_runs.h"
#include "jobs/study/study.h"
#include "worker/method/pool/pool_method.h"

namespace baton {
namespace {

struct Number {
  const char* name;
  float PoolTuning::*value;
};
constexpr Number kNumbers[] = {{"surroundings", &PoolTuning::surroundings},
                               {"least_deviation", &PoolTuning::least_deviation},
                               {"least_contribution", &PoolTuning::least_contribution},
                               {"control_from", &PoolTuning::control_from},
                               {"usual_deviation", &PoolTuning::usual_deviation},
                               {"least_rays", &PoolTuning::least_rays},
                               {"most_candidates", &PoolTuning::most_candidates},
                               {"new_frame", &PoolTuning::new_frame}};

/// A set of numbers, and what its renderings measured, seed by seed.
struct Variant {
  std::string name;
  PoolTuning tuning;
  std::vector<double> squared_error, seconds, below_zero;
};

std::vector<Variant> variants() {
  std::vector<Variant> all{{"in use", {}, {}, {}, {}}};
  const auto add = [&](const std::string& name, auto change) {
    for (const float factor : {0.5f, 2.0f}) {
      PoolTuning tuning;
      change(tuning, factor);
      all.push_back({fmt::format("{},{}", name, factor), tuning, {}, {}, {}});
    }
  };
  for (const Number& number : kNumbers)
    add(number.name, [&](PoolTuning& t, float factor) { t.*number.value *= factor; });
  add("light.usual_noise", [](PoolTuning& t, float factor) { t.light.usual_noise *= factor; });
  add("light.least", [](PoolTuning& t, float factor) { t.light.least *= factor; });
  add("lobes.usual_noise", [](PoolTuning& t, float factor) { t.lobes.usual_noise *= factor; });
  add("lobes.least", [](PoolTuning& t, float factor) { t.lobes.least *= factor; });
  const auto scaled = [](std::int32_t value, float factor) {
    return static_cast<std::int32_t>(factor * static_cast<float>(value));
  };
  add("fewest_judged",
      [&](PoolTuning& t, float factor) { t.fewest_judged = scaled(t.fewest_judged, factor); });
  add("enough_beside_lobes", [&](PoolTuning& t, float factor) {
    t.enough_beside_lobes = scaled(t.enough_beside_lobes, factor);
  });
  return all;
}

/// One seed of a variant; truth: the last measured frame.
void measure(Variant& variant, JobSpec job, std::uint64_t seed, const FilmTile& truth,
             const SharedAssetsPtr& assets) {
  job.seed = seed;
  const std::vector<FrameResult> frames = render(job, assets, {}, [&](RenderContext& context) {
    context.method = make_pool_method(job, variant.tuning);
  });
  const double error = rmse(frames.back().film, truth);
  variant.squared_error.push_back(error * error);
  double seconds = 0;
  for (const FrameResult& frame : frames) seconds += frame.seconds();
  variant.seconds.push_back(seconds);
  const std::span<const float> red = plane(frames.back().film, "R");
  variant.below_zero.push_back(
      static_cast<double>(std::count_if(red.begin(), red.end(), [](float x) { return x < 0; })));
}

double mean_of(const std::vector<double>& values, const std::vector<std::size_t>& seeds) {
  double sum = 0;
  for (const std::size_t seed : seeds) sum += values[seed];
  return sum / static_cast<double>(seeds.size());
}

double efficiency(const Variant& variant, const Variant& usual,
                  const std::vector<std::size_t>& seeds) {
  const auto cost = [&](const Variant& v) {
    return mean_of(v.squared_error, seeds) * mean_of(v.seconds, seeds);
  };
  return cost(usual) / cost(variant);
}

void print_row(const std::string& scene, const Variant& variant, const Variant& usual) {
  const auto gain = [&](const std::vector<std::size_t>& seeds) {
    return efficiency(variant, usual, seeds);
  };
  const Interval interval = over_seeds(variant.seconds.size(), gain);
  const auto mean = [](const std::vector<double>& values) { return mean_interval(values).value; };
  fmt::print("{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.1f}\n", scene, variant.name,
             interval.value, interval.low, interval.high,
             mean(variant.squared_error) / mean(usual.squared_error),
             mean(variant.seconds) / mean(usual.seconds), mean(variant.below_zero));
}

int run(const std::string& path, int num_seeds) {
  const Study study = value_of(load_study(path));
  fmt::print("scene,number,factor,efficiency,low,high,squaredError,time,pixelsBelowZero\n");
  for (const StudyCell& cell : study.cells) {
    if (cell.job.sampling.method != Method::pool) continue;
    const StudyScene& scene = study.scenes[static_cast<std::size_t>(cell.scene)];
    const JobSpec job = value_of(settle_motion(cell.job));
    const SharedAssetsPtr assets = value_of(load_shared_assets(job));
    const FilmTile truth = render(value_of(settle_motion(scene.reference.front()))).back().film;
    std::vector<Variant> all = variants();
    for (int seed = 1; seed <= num_seeds; ++seed) {
      for (Variant& variant : all)
        measure(variant, job, static_cast<std::uint64_t>(seed), truth, assets);
    }
    for (std::size_t i = 1; i < all.size(); ++i) print_row(scene.name, all[i], all.front());
  }
  return 0;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: study_pool_tuning STUDY.json [SEEDS] > CSV\n");
    return 64;
  }
  return baton::run(argv[1], argc > 2 ? std::stoi(argv[2]) : 8);
}
