#include "jobs/auto/auto_pilot.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "jobs/auto/pilot_windows.h"
#include "jobs/auto/unit_costs.h"

namespace baton {
namespace {

/// Renderings of every candidate; then of those whose efficiency is not below the best one's by
/// more than the factor.
constexpr int kFirstSeeds = 3;
constexpr int kSecondSeeds = 12;
constexpr double kFarFromBest = 2.5;

/// What a pilot says of its candidates, and the share of pixels with a surface.
struct PilotResult {
  std::vector<PilotNumbers> numbers;
  double lit_share = 0;
};

/// Renders every candidate with `num_seeds` seeds; what an earlier round did is kept. ray_factor:
/// ray_cost_factor of the job.
Result<PilotResult> run_pilot(const JobSpec& job, double ray_factor,
                              const std::vector<AutoCandidate>& candidates, int num_seeds,
                              const StudyFolder& folder, JobRunner& runner) {
  Study study = pilot_study(job, candidates);
  study.num_seeds = num_seeds;
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));

  // The mean over windows of squared errors, the sum of counted work.
  PilotResult pilot;
  for (const AutoCandidate& candidate : candidates) pilot.numbers.push_back({candidate, 0, 0});
  std::vector<double> lit(candidates.size());
  double all_lit = 0, all_pixels = 0;
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const auto [scene, method] = std::pair(study.cells[c].scene, study.cells[c].method);
    PilotNumbers& seen = pilot.numbers[method];
    seen.error += relative_square(results.runs[c], results.references[scene]) /
                  static_cast<double>(study.scenes.size());
    for (const RunRecord& run : results.runs[c]) {
      seen.cost_us += counted_cost_us(study.cells[c].job, ray_factor, run.counts);
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
  const std::vector<JobSpec> windows = pilot_windows(job);
  for (const JobSpec& window : windows) {
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      StudyCell cell{study.scenes.size(), c, "", window};
      cell.job.sampling = candidates[c].sampling;
      cell.job.visibility.correlated = candidates[c].correlated;
      cell.job.name = "pilot " + candidates[c].name();
      study.cells.push_back(std::move(cell));
    }
    study.scenes.push_back(pilot_scene(window));
  }
  return study;
}

PilotPlan plan_pilot(const JobSpec& job, double ray_factor) {
  const std::vector<AutoCandidate> candidates = auto_candidates(job);
  const Study study = pilot_study(job, candidates);
  PilotPlan plan{.candidates = candidates.size(), .windows = study.scenes.size()};
  const auto add = [&](const JobSpec& spec, double runs, std::int64_t rays,
                       std::int64_t evaluations) {
    const auto pixels =
        static_cast<std::uint64_t>(spec.image.rendered().area()) * spec.frames.size();
    const RunCounts counts{.pixels = pixels,
                           .rays_shadow = pixels * static_cast<std::uint64_t>(rays),
                           .target_evaluations = pixels * static_cast<std::uint64_t>(evaluations)};
    plan.frames += static_cast<std::size_t>(runs * static_cast<double>(spec.frames.size()));
    plan.cpu_seconds += 1e-6 * runs * counted_cost_us(spec, ray_factor, counts);
  };
  constexpr double kLookedAtAgain = 0.5;
  constexpr double kRuns = kFirstSeeds + kLookedAtAgain * (kSecondSeeds - kFirstSeeds);
  for (const StudyCell& cell : study.cells) {
    const SamplingSpec& s = cell.job.sampling;
    add(cell.job, kRuns, traits(s.method).most_rays(s), s.num_candidates);
    plan.pixels = cell.job.image.rendered().area();
  }
  for (const StudyScene& scene : study.scenes) {
    // A pair is a sample of the light and one of the material.
    for (const JobSpec& reference : scene.reference)
      add(reference, 1, 2 * reference.sampling.reference_samples, 0);
  }
  return plan;
}

Result<std::vector<PilotNumbers>> settle_auto(JobSpec& job, const StudyFolder& folder,
                                              JobRunner& runner) {
  if (job.sampling.method != Method::automatic) return std::vector<PilotNumbers>();
  BATON_ASSIGN(const double ray_factor, ray_cost_factor(job));
  BATON_ASSIGN(PilotResult pilot,
               run_pilot(job, ray_factor, auto_candidates(job), kFirstSeeds, folder, runner));

  // Measure again, and better, those that may be the best.
  const std::vector<AutoCandidate> near = near_the_best(pilot.numbers);
  if (near.size() > 1) {
    BATON_ASSIGN(const PilotResult closer,
                 run_pilot(job, ray_factor, near, kSecondSeeds, folder, runner));
    for (const PilotNumbers& seen : closer.numbers) {
      *std::find_if(pilot.numbers.begin(), pilot.numbers.end(), [&](const PilotNumbers& first) {
        return first.candidate.name() == seen.candidate.name();
      }) = seen;
    }
  }
  const double lit_pixels = static_cast<double>(job.image.rendered().area()) *
                            static_cast<double>(job.frames.size()) * pilot.lit_share;
  apply_choice(choose_sampling(job, pilot.numbers, lit_pixels), pilot.numbers, job);
  return std::move(pilot.numbers);
}

Status settle_study(Study& study, const StudyFolder& folder, JobRunner& runner) {
  for (StudyCell& cell : study.cells) {
    BATON_ASSIGN(const std::vector<PilotNumbers> pilot, settle_auto(cell.job, folder, runner));
    if (pilot.empty()) continue;
    cell.chosen = cell.job.metadata[kAutoChoice];
    spdlog::info("{}: {}, {}; seen were {}", cell.job.name, cell.chosen,
                 cell.job.metadata["auto.reason"], cell.job.metadata["auto.pilot"]);
  }
  return {};
}

}  // namespace baton
