#include "jobs/study/map_pilot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>

#include "common/image/image_io.h"
#include "common/job/job_fields.h"
#include "common/job/motion.h"
#include "common/job/sequence.h"
#include "jobs/study/auto_pilot.h"
#include "jobs/study/map_choice.h"
#include "jobs/study/pilot_windows.h"
#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

/// The pictures that are compared: accurate for their cost, with samples drawn anew so that any
/// frames can be taken.
constexpr std::size_t kComparedFrames = 12;
constexpr double kComparedPixels = 6000;
constexpr int kComparedParticles = 64;
constexpr int kComparedCandidates = 512;
/// Seeds at first, and where they leave it open.
constexpr int kFirstSeeds = 6;
constexpr int kMoreSeeds = 16;

constexpr int kJudgedSeeds = 24;
constexpr double kGain = 1.05;

/// Pictures of the job under maps of several widths, by seed.
class MapComparison {
 public:
  /// job, folder, runner: must outlive the object. error: expected of the job.
  MapComparison(const JobSpec& job, double error, const StudyFolder& folder, JobRunner& runner)
      : error_(error), folder_(folder), runner_(runner) {
    std::vector<int> frames = compared_frames(job.frames);
    const double num_pixels = kComparedPixels / static_cast<double>(frames.size());
    job_ = small_job(job, std::move(frames), num_pixels);
    job_.name = "pilot map";
    job_.sampling = {};
    job_.sampling.method = Method::bidirectional;
    job_.sampling.num_particles = kComparedParticles;
    job_.sampling.num_candidates = kComparedCandidates;
    job_.visibility = {};
  }

  /// Whether maps of so many columns change nothing that matters; looks closer where that is open.
  Result<bool> is_harmless(int width) {
    SystematicDifference seen;
    MapVerdict verdict = MapVerdict::open;
    for (const int num_seeds : {kFirstSeeds, kMoreSeeds}) {
      if (verdict != MapVerdict::open) break;
      BATON_ASSIGN(seen, difference(width, num_seeds));
      verdict = judge_map(seen, error_);
    }
    const bool harmless = verdict == MapVerdict::harmless;
    fmt::format_to(std::back_inserter(told_),
                   "{}{} columns: {} (root mean square at most {:.4f}, mean {:+.4f} +- {:.4f})",
                   told_.empty() ? "" : "; ", width, harmless ? "as good" : "too coarse",
                   difference_limit(seen), seen.mean, seen.mean_error);
    return harmless;
  }

  /// What was seen of each width, in words.
  const std::string& told() const { return told_; }

 private:
  JobSpec picture_job(int width, int seed) const {
    JobSpec job = job_;
    job.seed = static_cast<std::uint64_t>(seed);
    if (width > 0) job.environment.max_width = width;
    return job;
  }

  /// R, G, B of all pixels with a surface, frame by frame. width 0: the maps as they are.
  Result<std::vector<float>> values(int width, int seed) const {
    const JobSpec job = picture_job(width, seed);
    BATON_ASSIGN(const std::string key, job_key(job));
    std::vector<float> values;
    for (const int frame : job.frames) {
      BATON_ASSIGN(const Picture picture,
                   read_picture(frame_file(folder_.frames_folder(key), frame)));
      for (std::size_t i = 0; i < picture.coverage.size(); ++i) {
        if (!(picture.coverage[i] > 0)) continue;
        const float* rgb = &picture.image.rgb[3 * i];
        values.insert(values.end(), rgb, rgb + 3);
      }
    }
    return values;
  }

  Result<SystematicDifference> difference(int width, int num_seeds) {
    std::vector<JobSpec> jobs;
    for (int seed = 1; seed <= num_seeds; ++seed) {
      jobs.push_back(picture_job(0, seed));
      jobs.push_back(picture_job(width, seed));
    }
    BATON_TRY(render_kept(jobs, folder_, runner_));
    std::vector<std::vector<float>> differences;
    double sum = 0;
    for (int seed = 1; seed <= num_seeds; ++seed) {
      BATON_ASSIGN(const std::vector<float> full, values(0, seed));
      BATON_ASSIGN(std::vector<float> coarse, values(width, seed));
      for (std::size_t i = 0; i < full.size(); ++i) {
        sum += full[i];
        coarse[i] -= full[i];
      }
      differences.push_back(std::move(coarse));
    }
    const double count = static_cast<double>(differences.front().size()) * num_seeds;
    return sum > 0 ? systematic_difference(differences, sum / count) : SystematicDifference{};
  }

  JobSpec job_;
  double error_;
  const StudyFolder& folder_;
  JobRunner& runner_;
  std::string told_;
};

/// Squared error and cost per pixel of `choice` under maps as they are and `width` wide.
struct Judged {
  std::array<double, 2> square{}, cost_us{};
};
Result<Judged> judge_widths(const JobSpec& job, const AutoChoice& choice, int width,
                            const StudyFolder& folder, JobRunner& runner) {
  const AutoCandidate chosen{"chosen", choice.sampling, choice.correlated};
  Study study = pilot_study(job, {chosen, chosen});
  for (StudyCell& cell : study.cells) {
    if (cell.method == 1) cell.job.environment.max_width = width;
  }
  study.first_seed = kFirstMapSeed;
  study.num_seeds = kJudgedSeeds;
  if (fresh_method(choice.sampling.method)) keep_measured_frames(study);
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));

  Judged judged;
  std::array<double, 2> lit{};
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const auto method = static_cast<std::size_t>(study.cells[c].method);
    const auto scene = static_cast<std::size_t>(study.cells[c].scene);
    judged.square[method] += relative_square(results.runs[c], results.references[scene]) /
                             static_cast<double>(study.scenes.size());
    for (const RunRecord& run : results.runs[c]) {
      judged.cost_us[method] += counted_cost_us(study.cells[c].job, run.counts);
      lit[method] += static_cast<double>(run.counts.lit_pixels());
    }
  }
  for (std::size_t k = 0; k < 2; ++k) judged.cost_us[k] /= std::max(lit[k], 1.0);
  return judged;
}

struct MapSize {
  int width = 0, height = 0;
};

/// Of the job's first map, as its file has it.
Result<MapSize> first_map_size(const JobSpec& job) {
  BATON_ASSIGN(const RgbImage map, read_rgb_image(job.environment.keys.front().map));
  return MapSize{map.width, map.height};
}

/// Light of a whole job per pixel with a surface and frame, under maps reduced to `width`.
double light_us(const JobSpec& job, const MapSize& map, int width, double lit_pixels) {
  const double file_texels = 1.0 * map.width * map.height;
  const double share = std::min(1.0 * width / map.width, 1.0);
  return counted_light_us(job, file_texels, file_texels * share * share) /
         std::max(lit_pixels, 1.0);
}

}  // namespace

std::vector<int> compared_frames(const std::vector<int>& frames) {
  const std::size_t count = std::min(frames.size(), kComparedFrames);
  std::vector<int> compared;
  for (std::size_t i = 0; i < count; ++i)
    compared.push_back(frames[count == 1 ? 0 : i * (frames.size() - 1) / (count - 1)]);
  return compared;
}

Status coarsen_maps(const JobSpec& job, LitPixels lit, const StudyFolder& folder, JobRunner& runner,
                    AutoChoice& choice) {
  // A picture of the map needs all of it.
  const bool shown =
      job.output.background == Background::environment && (lit.share < 1 || moves(job));
  BATON_ASSIGN(const MapSize map, first_map_size(job));
  const int asked = job.environment.max_width;
  const int full = asked > 0 ? std::min(map.width, asked) : map.width;
  const std::vector<int> widths = coarser_widths(full);
  if (widths.empty() || !(choice.error > 0)) return {};
  if (shown) {
    choice.reason += "; the maps as they are, as the background shows them";
    return {};
  }

  // Find the coarsest that does no harm.
  MapComparison comparison(job, choice.error, folder, runner);
  BATON_ASSIGN(const std::optional<int> width,
               coarsest_harmless(widths, [&](int tried) { return comparison.is_harmless(tried); }));
  choice.maps = fmt::format("{}; allowed are {:.4f}", comparison.told(), kMapShare * choice.error);
  if (!width) {
    choice.reason += "; the maps as they are, as coarser ones change the pictures";
    return {};
  }

  // See what it gains.
  BATON_ASSIGN(const Judged judged, judge_widths(job, choice, *width, folder, runner));
  const double cost = judged.cost_us[0] + light_us(job, map, full, lit.total);
  const double coarse_cost = judged.cost_us[1] + light_us(job, map, *width, lit.total);
  const double gain = judged.square[0] * cost / std::max(judged.square[1] * coarse_cost, 1e-30);
  if (gain < kGain) {
    choice.reason += fmt::format(
        "; the maps as they are, as {} columns are {:.2f} times as efficient", *width, gain);
    return {};
  }
  choice.reason += fmt::format("; maps of {} columns, which are {:.2f} times as efficient as {}",
                               *width, gain, full);
  choice.max_map_width = *width;
  choice.error = std::sqrt(judged.square[1]);
  return {};
}

}  // namespace baton
