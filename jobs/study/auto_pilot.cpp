#include "jobs/study/auto_pilot.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

constexpr double kPilotPixels = 64 * 36;
constexpr std::size_t kWindowFrames = 10;
constexpr int kPilotSeeds = 3;
constexpr int kReferenceSamples = 512;
/// Far from the seeds that people give.
constexpr std::uint64_t kReferenceSeed = 2'000'000'000;

/// The job at a small size for some of its frames.
JobSpec window_of(const JobSpec& job, std::size_t first, std::size_t last) {
  JobSpec window = job;
  window.frames.assign(job.frames.begin() + static_cast<std::ptrdiff_t>(first),
                       job.frames.begin() + static_cast<std::ptrdiff_t>(last));
  // Turning starts at the first frame of a job.
  window.environment.rotation_start_deg +=
      job.environment.rotation_deg_per_frame * (window.frames.front() - job.frames.front());
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
  // The last two frames, with the history that a carried sample then has, and the first.
  scene.frames = {window.frames.front()};
  for (std::size_t i = window.frames.size() > 2 ? window.frames.size() - 2 : 1;
       i < window.frames.size(); ++i)
    scene.frames.push_back(window.frames[i]);
  scene.crop = {0, 0, window.image.width, window.image.height};
  for (std::size_t half = 0; half < 2; ++half) {
    JobSpec& reference = scene.reference[half];
    reference = window;
    reference.name = "pilot reference";
    reference.frames = scene.frames;
    reference.sampling = {};
    reference.sampling.method = Method::reference;
    reference.sampling.reference_samples = kReferenceSamples;
    reference.seed = kReferenceSeed + half;
    reference.output.aovs = {Aov::lns, Aov::variance};
  }
  return scene;
}

/// Squared error over squared mean radiance of the frames after the first (of the first alone where
/// there is no other).
double relative_square(const std::vector<RunRecord>& runs,
                       const std::vector<Reference>& references) {
  double sum = 0, mean = 0;
  for (std::size_t f = references.size() > 1 ? 1 : 0; f < references.size(); ++f) {
    for (const RunRecord& run : runs) sum += run.frames[f].mse / static_cast<double>(runs.size());
    mean += references[f].mean_radiance * references[f].mean_radiance;
  }
  return mean > 0 ? std::max(sum, 0.0) / mean : 0;
}

}  // namespace

Study pilot_study(const JobSpec& job, const std::vector<AutoCandidate>& candidates) {
  Study study;
  study.name = "pilot";
  study.num_seeds = kPilotSeeds;
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
      cell.job.name = "pilot " + candidates[c].name();
      study.cells.push_back(std::move(cell));
    }
    study.scenes.push_back(scene_of(window));
  }
  return study;
}

Result<std::vector<PilotNumbers>> settle_auto(JobSpec& job, const StudyFolder& folder,
                                              JobRunner& runner) {
  std::vector<PilotNumbers> pilot;
  if (job.sampling.method != Method::automatic) return pilot;
  const std::vector<AutoCandidate> candidates = auto_candidates(job);
  const Study study = pilot_study(job, candidates);
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));

  // The mean over windows of squared errors, the sum of counted work.
  const auto num_scenes = static_cast<double>(study.scenes.size());
  for (const AutoCandidate& candidate : candidates) pilot.push_back({candidate, 0, 0});
  double lit = 0, pixels = 0;  // of all runs
  std::vector<double> lit_of(candidates.size());
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    const auto method = static_cast<std::size_t>(study.cells[c].method);
    const auto scene = static_cast<std::size_t>(study.cells[c].scene);
    pilot[method].error += relative_square(results.runs[c], results.references[scene]) / num_scenes;
    for (const RunRecord& run : results.runs[c]) {
      pilot[method].cost_us += counted_cost_us(run.counts);
      lit_of[method] += static_cast<double>(run.counts.lit_pixels());
      pixels += static_cast<double>(run.counts.pixels);
    }
  }
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    lit += lit_of[c];
    pilot[c].error = std::sqrt(pilot[c].error);
    pilot[c].cost_us /= std::max(lit_of[c], 1.0);
  }
  const double all_pixels =
      1.0 * job.image.width * job.image.height * static_cast<double>(job.frames.size());
  apply_choice(choose_sampling(job, pilot, all_pixels * lit / std::max(pixels, 1.0)), pilot, job);
  return pilot;
}

Status settle_study(Study& study, const StudyFolder& folder, JobRunner& runner) {
  for (StudyCell& cell : study.cells) {
    BATON_ASSIGN(const std::vector<PilotNumbers> pilot, settle_auto(cell.job, folder, runner));
    if (!pilot.empty())
      spdlog::info("{}: {}, {}", cell.job.name, cell.job.metadata["auto.choice"],
                   cell.job.metadata["auto.reason"]);
  }
  return {};
}

}  // namespace baton
