// The experiments of [Ghosh, Doucet & Heidrich 2006] on a job's scene, as tables: usage:
// study_sequential JOB.json EXPERIMENT > CSV
//
// moves        error of the first carried frame against the number of moves or distributions
//              [fig. 2, 3]
// resampled    fraction of pixels resampled per frame: one distribution with five moves, five with
//              one [section 7]
// equal-time   sequential and bidirectional over a sequence, the latter with as many candidates as
//              the same time buys [fig. 1, 4, 5]
// drift        mean, median and spread of carried over true Lns through the job's frames, with and
//              without refresh
//
// Times are CPU seconds of sampling, visibility and shading; primary rays and the preparation of a
// frame's light are the same for all methods and left out. One tile, one thread.
#include <map>
#include <string>

#include "jobs/lab/studies/sequential_runs.h"

namespace baton {
namespace {

constexpr int kSeeds = 4;

/// Root mean square of log(a / b) of the unshadowed radiance over pixels where both are positive.
double log_lns_error(const FilmTile& a, const FilmTile& b) {
  double sum = 0;
  double count = 0;
  const auto x = plane(a, "lns");
  const auto y = plane(b, "lns");
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0 && y[i] > 0)) continue;
    const double error = std::log(double{x[i]} / y[i]);
    sum += error * error;
    count += 1;
  }
  return std::sqrt(sum / count);
}

/// Mean RMS error and seconds of each frame in `judged` over kSeeds renderings.
struct Score {
  double squared_error = 0, log_lns_error = 0, seconds = 0;
};
std::map<std::size_t, Score> score(const JobSpec& job,
                                   const std::map<std::size_t, FilmTile>& judged) {
  std::map<std::size_t, Score> scores;
  const auto add = [&](std::size_t index, const FrameResult& frame) {
    const FilmTile& truth = judged.at(index);
    const double error = rmse(frame.film, truth);
    Score& score = scores[index];
    score.squared_error += error * error / kSeeds;
    score.log_lns_error += log_lns_error(frame.film, truth) / kSeeds;
    score.seconds += frame.seconds() / kSeeds;
  };
  for (int seed = 1; seed <= kSeeds; ++seed) {
    JobSpec run = job;
    run.seed = static_cast<std::uint64_t>(seed);
    if (run.sampling.method != Method::sequential) {
      // Frames are independent of each other: only the measured ones are rendered.
      for (const auto& item : judged) add(item.first, render(frame_of(run, item.first)).front());
      continue;
    }
    run.frames.resize(judged.rbegin()->first + 1);
    const std::vector<FrameResult> frames = render(run);
    for (const auto& item : judged) add(item.first, frames[item.first]);
  }
  return scores;
}

std::map<std::size_t, FilmTile> references(const JobSpec& job,
                                           const std::vector<std::size_t>& indices) {
  std::map<std::size_t, FilmTile> films;
  for (const std::size_t index : indices) films[index] = reference(job, index);
  return films;
}

// ---- experiments --------------------------------------------------------------------------------

void study_moves(JobSpec job) {
  job.frames.resize(2);
  const auto truth = references(job, {1});
  fmt::print("kind,count,rmse,logLnsError,ms\n");
  const auto row = [&](const char* kind, int count, const JobSpec& variant) {
    const Score s = score(variant, truth).at(1);
    fmt::print("{},{},{:.6f},{:.5f},{:.3f}\n", kind, count, std::sqrt(s.squared_error),
               s.log_lns_error, 1e3 * s.seconds);
  };
  for (const int count : {1, 2, 4, 8, 16}) {
    row("moves", count, carried(job, 1, count, LnsUpdate::ratio));
    row("ratio", count, carried(job, count, 1, LnsUpdate::ratio));
    row("pathLeft", count, carried(job, count, 1, LnsUpdate::path_left));
    row("pathRight", count, carried(job, count, 1, LnsUpdate::path_right));
    row("pathTrapezoid", count, carried(job, count, 1, LnsUpdate::path_trapezoid));
  }
  for (const int candidates : {50, 100, 200, 400, 800})
    row("bidirectional", candidates, chosen(job, candidates));
}

void study_resampled(const JobSpec& job) {
  fmt::print("kind,frame,resampled\n");
  const auto rows = [&](const char* kind, const JobSpec& variant) {
    const std::vector<FrameResult> frames = render(variant);
    for (std::size_t i = 1; i < frames.size(); ++i) {
      const SamplingStats& s = frames[i].sampling;
      fmt::print("\"{}\",{},{:.5f}\n", kind, job.frames[i],
                 static_cast<double>(s.pixels_resampled) / static_cast<double>(s.pixels()));
    }
  };
  rows("1 distribution, 5 moves", carried(job, 1, 5, LnsUpdate::ratio));
  rows("5 distributions, 1 move", carried(job, 5, 1, LnsUpdate::path_trapezoid));
}

/// Candidates that take about as long as `seconds` per frame: halved and doubled counts of a power
/// law.
int candidates_for(const JobSpec& job, double seconds) {
  JobSpec one = job;
  one.frames.resize(1);
  int best = 16;
  double best_distance = 1e9;
  for (const int candidates : {16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 800}) {
    const double distance =
        std::fabs(std::log(render(chosen(one, candidates)).front().seconds() / seconds));
    if (distance < best_distance) best = candidates;
    best_distance = std::min(best_distance, distance);
  }
  return best;
}

void study_equal_time(const JobSpec& job) {
  std::vector<std::size_t> judged;
  for (std::size_t i = 0; i < job.frames.size(); i += 4) judged.push_back(i);
  const auto truth = references(job, judged);
  fmt::print("kind,frame,rmse,ms\n");
  const auto rows = [&](const std::string& kind, const JobSpec& variant) {
    for (const auto& [index, s] : score(variant, truth)) {
      fmt::print("\"{}\",{},{:.6f},{:.3f}\n", kind, job.frames[index], std::sqrt(s.squared_error),
                 1e3 * s.seconds);
    }
  };
  const JobSpec sequential = carried(job, 5, 1, LnsUpdate::path_trapezoid);
  const int candidates = candidates_for(job, render(sequential)[1].seconds());
  rows("sequential", sequential);
  JobSpec refreshed = sequential;
  refreshed.sampling.refresh_ratio = 1.5f;
  rows("sequential, refreshRatio 1.5", refreshed);
  rows(fmt::format("bidirectional, M = {}", candidates), chosen(job, candidates));
  rows("bidirectional, M = 800", chosen(job, 800));
}

void study_drift(const JobSpec& base) {
  fmt::print("degPerFrame,kind,frame,mean,p05,median,p95\n");
  for (const double speed : {0.0, 0.1, 1.5}) {
    JobSpec job = base;
    job.environment.rotation_deg_per_frame = speed;

    // The truth at some frames: a great many candidates.
    std::map<std::size_t, FilmTile> truth;
    for (std::size_t i = 0; i < job.frames.size(); i += i < 20 ? 5 : 40) {
      truth[i] = render(frame_of(chosen(job, limits::kMaxCandidates), i)).front().film;
    }
    const auto rows = [&](const char* kind, const JobSpec& variant) {
      const std::vector<FrameResult> frames = render(variant);
      for (const auto& [index, film] : truth) {
        const auto lns = plane(frames[index].film, "lns");
        const auto expected = plane(film, "lns");
        std::vector<double> ratios;
        double mean = 0;
        for (std::size_t i = 0; i < lns.size(); ++i) {
          if (expected[i] > 0) ratios.push_back(lns[i] / double{expected[i]});
        }
        for (const double ratio : ratios) mean += ratio / static_cast<double>(ratios.size());
        std::sort(ratios.begin(), ratios.end());
        const auto quantile = [&](double q) {
          return ratios[static_cast<std::size_t>(q * static_cast<double>(ratios.size() - 1))];
        };
        fmt::print("{},{},{},{:.4f},{:.4f},{:.4f},{:.4f}\n", speed, kind, job.frames[index], mean,
                   quantile(0.05), quantile(0.5), quantile(0.95));
      }
    };
    const JobSpec ratio = carried(job, 5, 1, LnsUpdate::ratio);
    const JobSpec path = carried(job, 5, 1, LnsUpdate::path_trapezoid);
    rows("ratio", ratio);
    rows("path", path);
    JobSpec scheduled = path;
    scheduled.sampling.refresh_every = 8;
    rows("path refreshEvery 8", scheduled);
    JobSpec by_ratio = path;
    by_ratio.sampling.refresh_ratio = 1.5f;
    rows("path refreshRatio 1.5", by_ratio);
  }
}

int run(const std::string& path, const std::string& experiment) {
  const std::map<std::string, std::function<void(const JobSpec&)>> experiments{
      {"moves", study_moves},
      {"resampled", study_resampled},
      {"equal-time", study_equal_time},
      {"drift", study_drift}};
  const auto found = experiments.find(experiment);
  if (found == experiments.end()) {
    fmt::print(stderr, "usage: study_sequential JOB.json moves|resampled|equal-time|drift\n");
    return 64;
  }
  found->second(value_of(load_job(path)));
  return 0;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  return baton::run(argc > 1 ? argv[1] : "", argc > 2 ? argv[2] : "");
}
