#include "jobs/study/auto_pilot.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

constexpr double kPilotPixels = 64 * 36;
constexpr std::size_t kWindowFrames = 12;
/// Runs of every candidate; then of those whose efficiency is not below the best one's by more than
/// the factor.
constexpr int kFirstSeeds = 3;
constexpr int kSecondSeeds = 12;
constexpr double kFarFromBest = 2.5;
constexpr int kReferenceSamples = 512;
/// Far from the seeds that people give.
constexpr std::uint64_t kReferenceSeed = 2'000'000'000;

/// The job at a small size for some of its frames.
JobSpec window_of(const JobSpec& job, std::size_t first, std::size_t last) {
  JobSpec window = job_window(job, {job.frames.begin() + static_cast<std::ptrdiff_t>(first),
                                    job.frames.begin() + static_cast<std::ptrdiff_t>(last)});
  const double scale =
      std::min(1.0, std::sqrt(kPilotPixels / (1.0 * job.image.width * job.image.height)));
  window.image.width = std::max(1, static_cast<int>(std::lround(job.image.width * scale)));
  window.image.height = std::max(1, static_cast<int>(std::lround(job.image.height * scale)));
  window.metadata.clear();
  window.output.background = Background::transparent;
  window.output.pixel_type = PixelType::full_float;
  window.output.pattern = kFramePattern;
  window.output.aovs = {Aov::lns};
  window.state.keep = StateKeep::last;
  return window;
}

StudyScene scene_of(const JobSpec& window) {
  StudyScene scene;
  scene.name = fmt::format("frames from {}", window.frames.front());
  // The last two frames, with the history that a carried sample then has.
  const std::size_t num_measured = std::min<std::size_t>(window.frames.size(), 2);
  scene.frames.assign(window.frames.end() - static_cast<std::ptrdiff_t>(num_measured),
                      window.frames.end());
  scene.crop = {0, 0, window.image.width, window.image.height};
  for (std::size_t half = 0; half < 2; ++half) {
    JobSpec& reference = scene.reference[half];
    reference = job_window(window, scene.frames);
    reference.name = "pilot reference";
    reference.sampling = {};
    reference.sampling.method = Method::reference;
    reference.sampling.reference_samples = kReferenceSamples;
    reference.seed = kReferenceSeed + half;
    reference.output.aovs = {Aov::lns, Aov::variance};
  }
  return scene;
}

/// Squared error over squared mean radiance.
double relative_square(const std::vector<RunRecord>& runs,
                       const std::vector<Reference>& references) {
  double sum = 0, mean = 0;
  for (std::size_t f = 0; f < references.size(); ++f) {
    for (const RunRecord& run : runs) sum += run.frames[f].mse / static_cast<double>(runs.size());
    mean += references[f].mean_radiance * references[f].mean_radiance;
  }
  return mean > 0 ? std::max(sum, 0.0) / mean : 0;
}

/// What a pilot says of its candidates, and the share of pixels with a surface.
struct PilotResult {
  std::vector<PilotNumbers> numbers;
  double lit_share = 0;
};

/// Runs every candidate with `num_seeds` seeds; what an earlier round did is kept.
Result<PilotResult> run_pilot(const JobSpec& job, const std::vector<AutoCandidate>& candidates,
                              int num_seeds, const StudyFolder& folder, JobRunner& runner) {
  Study study = pilot_study(job, candidates);
  study.num_seeds = num_seeds;
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));

  // The mean over windows of squared errors, the sum of counted work.
  PilotResult pilot;
  for (const AutoCandidate& candidate : candidates) pilot.numbers.push_back({candidate, 0, 0});
  std::vector<double> lit(candidates.size());
  double all_lit = 0, all_pixels = 0;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const auto method = static_cast<std::size_t>(study.cells[c].method);
    const auto scene = static_cast<std::size_t>(study.cells[c].scene);
    PilotNumbers& seen = pilot.numbers[method];
    seen.error += relative_square(results.runs[c], results.references[scene]) /
                  static_cast<double>(study.scenes.size());
    for (const RunRecord& run : results.runs[c]) {
      seen.cost_us += counted_cost_us(study.cells[c].job, run.counts);
      lit[method] += static_cast<double>(run.counts.lit_pixels());
      all_pixels += static_cast<double>(run.counts.pixels);
    }
  }
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    pilot.numbers[c].error = std::sqrt(pilot.numbers[c].error);
    pilot.numbers[c].cost_us /= std::max(lit[c], 1.0);
    all_lit += lit[c];
  }
  pilot.lit_share = all_lit / std::max(all_pixels, 1.0);
  return pilot;
}

double efficiency(const PilotNumbers& seen) {
  return 1 / std::max(seen.error * seen.error * seen.cost_us, 1e-30);
}

/// Families of which some member comes near the most efficient candidate.
std::vector<AutoCandidate> near_the_best(const std::vector<PilotNumbers>& pilot) {
  double best = 0;
  for (const PilotNumbers& seen : pilot) best = std::max(best, efficiency(seen));
  const auto is_near = [&](const std::string& family) {
    return std::any_of(pilot.begin(), pilot.end(), [&](const PilotNumbers& seen) {
      return seen.candidate.family == family && efficiency(seen) * kFarFromBest >= best;
    });
  };
  std::vector<AutoCandidate> near;
  for (const PilotNumbers& seen : pilot) {
    if (is_near(seen.candidate.family)) near.push_back(seen.candidate);
  }
  return near;
}

}  // namespace

Study pilot_study(const JobSpec& job, const std::vector<AutoCandidate>& candidates) {
  Study study;
  study.name = "pilot";
  for (const AutoCandidate& candidate : candidates) study.methods.push_back(candidate.name());
  const std::size_t num_frames = job.frames.size();
  const std::size_t length = std::min(num_frames, kWindowFrames);
  std::vector<JobSpec> windows{window_of(job, 0, length)};
  if (num_frames > 2 * kWindowFrames)
    windows.push_back(window_of(job, num_frames - length, num_frames));
  for (const JobSpec& window : windows) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      StudyCell cell{static_cast<int>(study.scenes.size()), static_cast<int>(c), "", window};
      cell.job.sampling = candidates[c].sampling;
      cell.job.visibility.correlated = candidates[c].correlated;
      cell.job.name = "pilot " + candidates[c].name();
      study.cells.push_back(std::move(cell));
    }
    study.scenes.push_back(scene_of(window));
  }
  return study;
}

Result<std::vector<PilotNumbers>> settle_auto(JobSpec& job, const StudyFolder& folder,
                                              JobRunner& runner) {
  if (job.sampling.method != Method::automatic) return std::vector<PilotNumbers>();
  BATON_ASSIGN(PilotResult pilot,
               run_pilot(job, auto_candidates(job), kFirstSeeds, folder, runner));

  // Look again, and closer, at those that may be the best.
  const std::vector<AutoCandidate> near = near_the_best(pilot.numbers);
  if (near.size() > 1) {
    BATON_ASSIGN(const PilotResult closer, run_pilot(job, near, kSecondSeeds, folder, runner));
    for (const PilotNumbers& seen : closer.numbers) {
      *std::find_if(pilot.numbers.begin(), pilot.numbers.end(), [&](const PilotNumbers& first) {
        return first.candidate.name() == seen.candidate.name();
      }) = seen;
    }
  }
  const double all_pixels =
      1.0 * job.image.width * job.image.height * static_cast<double>(job.frames.size());
  apply_choice(choose_sampling(job, pilot.numbers, all_pixels * pilot.lit_share), pilot.numbers,
               job);
  return std::move(pilot.numbers);
}

Status settle_study(Study& study, const StudyFolder& folder, JobRunner& runner) {
  for (StudyCell& cell : study.cells) {
    BATON_ASSIGN(const std::vector<PilotNumbers> pilot, settle_auto(cell.job, folder, runner));
    if (!pilot.empty())
      spdlog::info("{}: {}, {}; seen were {}", cell.job.name, cell.job.metadata[kAutoChoice],
                   cell.job.metadata["auto.reason"], cell.job.metadata["auto.pilot"]);
  }
  return {};
}

}  // namespace baton
