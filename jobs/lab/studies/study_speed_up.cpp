// How much sooner the sequential sampler reaches the error of `bidirectional` [Ghosh, Doucet &
// Heidrich 2006, section 7: 2 for relighting, 1.6 for a moving camera]. For each carried frame of a
// job, and their mean: the time that `bidirectional` takes for the same mean squared error,
// interpolated over M, divided by the sequential sampler's. 95 % intervals by resampling the seeds.
// Times are CPU seconds with primary rays and reprojection, without the preparation of the light;
// all variants take turns in one process.
//
// Usage: study_speed_up JOB.json [SEEDS [FRAMES [DEGREES]]] > CSV. FRAMES: of the job, the first
// ones; DEGREES: that the light turns a frame, in place of the job's. `bound`: the error lies
// outside of what the M here reach, so the speed-up is at most or at least the value.
#include <array>
#include <numeric>
#include <string>

#include "common/scene/settle/settle_motion.h"
#include "jobs/lab/studies/sequential_runs.h"

namespace baton {
namespace {

constexpr std::array kCandidates{16, 32, 64, 128, 256, 512, 1024};

/// A variant with what its renderings measured.
struct Variant {
  std::string name;
  JobSpec job;
  std::vector<std::vector<double>> mse, seconds;  ///< (seeds, carried frames)
};

std::vector<Variant> sequential_variants(const JobSpec& job) {
  const JobSpec one = carried(job, 1, 1, LnsUpdate::ratio);
  const JobSpec five = carried(job, 5, 1, LnsUpdate::path_trapezoid);
  JobSpec scheduled = one;
  scheduled.sampling.refresh_every = 4;
  JobSpec by_ratio = five;
  by_ratio.sampling.refresh_ratio = 1.5f;
  return {{"P = 1", one, {}, {}},
          {"P = 1, refreshEvery 4", scheduled, {}, {}},
          {"P = 5", five, {}, {}},
          {"P = 5, refreshRatio 1.5", by_ratio, {}, {}}};
}

/// One seed of a variant: every frame but the first.
void measure(Variant& variant, std::uint64_t seed, const std::vector<FilmTile>& truth,
             const SharedAssetsPtr& assets) {
  variant.job.seed = seed;
  const std::vector<FrameResult> frames = render(variant.job, assets);
  std::vector<double>& mse = variant.mse.emplace_back();
  std::vector<double>& seconds = variant.seconds.emplace_back();
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const double error = rmse(frames[i].film, truth[i]);
    mse.push_back(error * error);
    seconds.push_back(frames[i].seconds_with_primary());
  }
}

/// Mean over some seeds and carried frames [first, end).
double mean_of(const std::vector<std::vector<double>>& values,
               const std::vector<std::size_t>& seeds, std::size_t first, std::size_t end) {
  double sum = 0;
  for (const std::size_t seed : seeds) {
    for (std::size_t i = first; i < end; ++i) sum += values[seed][i];
  }
  return sum / static_cast<double>(seeds.size() * (end - first));
}

/// A speed-up; bound: -1 at most, +1 at least this.
struct SpeedUp {
  double value = 0;
  int bound = 0;
};

/// Time of the curve at the error, over `seconds`. curve: (error, seconds), dearer and dearer;
/// between two points both are powers of each other.
SpeedUp speed_up(const std::vector<std::pair<double, double>>& curve, double error,
                 double seconds) {
  if (error >= curve.front().first) return {curve.front().second / seconds, -1};
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const auto& [from_error, from_seconds] = curve[i - 1];
    const auto& [to_error, to_seconds] = curve[i];
    if (error < to_error) continue;
    const double share = std::log(from_error / error) / std::log(from_error / to_error);
    return {from_seconds * std::pow(to_seconds / from_seconds, share) / seconds, 0};
  }
  return {curve.back().second / seconds, 1};
}

/// The same of the means over some seeds.
SpeedUp speed_up(const std::vector<Variant>& curve, const Variant& variant,
                 const std::vector<std::size_t>& seeds, std::size_t first, std::size_t end) {
  std::vector<std::pair<double, double>> points;
  for (const Variant& v : curve)
    points.emplace_back(mean_of(v.mse, seeds, first, end), mean_of(v.seconds, seeds, first, end));
  return speed_up(points, mean_of(variant.mse, seeds, first, end),
                  mean_of(variant.seconds, seeds, first, end));
}

/// One line of the table; `bidirectional` has no speed-up over itself.
void print_row(const std::string& frames, const std::vector<Variant>& curve, const Variant& variant,
               std::size_t first, std::size_t end) {
  std::vector<std::size_t> seeds(variant.mse.size());
  std::iota(seeds.begin(), seeds.end(), std::size_t{0});
  const double error = mean_of(variant.mse, seeds, first, end);
  const double seconds = mean_of(variant.seconds, seeds, first, end);
  fmt::print("\"{}\",{},{:.6f},{:.3f},", variant.name, frames, std::sqrt(error), 1e3 * seconds);
  if (variant.job.sampling.method == Method::bidirectional) {
    fmt::print(",,,\n");
    return;
  }
  const Interval interval = over_seeds(seeds.size(), [&](const std::vector<std::size_t>& some) {
    return speed_up(curve, variant, some, first, end).value;
  });
  const SpeedUp all = speed_up(curve, variant, seeds, first, end);
  fmt::print("{:.3f},{:.3f},{:.3f},{}\n", interval.value, interval.low, interval.high,
             all.bound < 0   ? "at most"
             : all.bound > 0 ? "at least"
                             : "");
}

int run(JobSpec job, int num_seeds) {
  job = value_of(settle_motion(std::move(job)));
  const SharedAssetsPtr assets = value_of(load_shared_assets(job));
  std::vector<FilmTile> truth(job.frames.size());
  for (std::size_t i = 1; i < truth.size(); ++i) truth[i] = reference(job, i);

  std::vector<Variant> variants = sequential_variants(job);
  std::vector<Variant> curve;
  for (const int candidates : kCandidates)
    curve.push_back(
        {fmt::format("bidirectional, M = {}", candidates), chosen(job, candidates), {}, {}});
  for (int seed = 1; seed <= num_seeds; ++seed) {
    for (std::vector<Variant>* some : {&variants, &curve}) {
      for (Variant& variant : *some)
        measure(variant, static_cast<std::uint64_t>(seed), truth, assets);
    }
  }

  fmt::print("kind,frames,rmse,ms,speedUp,low,high,bound\n");
  const std::size_t end = truth.size() - 1;
  for (const std::vector<Variant>* some : {&variants, &curve}) {
    for (const Variant& variant : *some) {
      for (std::size_t i = 0; i < end; i = 2 * i + 1)
        print_row(fmt::format("{}", job.frames[i + 1]), curve, variant, i, i + 1);
      print_row(fmt::format("{}-{}", job.frames[1], job.frames.back()), curve, variant, 0, end);
    }
  }
  return 0;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: study_speed_up JOB.json [SEEDS [FRAMES [DEGREES]]] > CSV\n");
    return 64;
  }
  baton::JobSpec job = baton::value_of(baton::load_job(argv[1]));
  if (argc > 3) job.frames.resize(std::min<std::size_t>(job.frames.size(), std::stoul(argv[3])));
  if (argc > 4) job.environment.rotation_deg_per_frame = std::stod(argv[4]);
  return baton::run(std::move(job), argc > 2 ? std::stoi(argv[2]) : 20);
}
