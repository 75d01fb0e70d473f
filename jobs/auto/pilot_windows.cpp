#include "jobs/auto/pilot_windows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

constexpr double kPilotPixels = 64 * 36;
constexpr std::size_t kWindowFrames = 12;
constexpr std::size_t kMeasured = 2;
constexpr int kReferenceSamples = 512;
/// Far from the seeds that people give.
constexpr std::uint64_t kReferenceSeed = 2'000'000'000;

}  // namespace

JobSpec small_job(const JobSpec& job, std::vector<FrameNumber> frames) {
  JobSpec small = job;
  small.frames = std::move(frames);
  const auto pixels = static_cast<double>(job.image.rendered().area());
  small.image = scaled(job.image, std::min(1.0, std::sqrt(kPilotPixels / pixels)));
  small.metadata.clear();
  prepare_measured(small);
  small.output.aovs = {Aov::lns};
  small.state.preroll = 0;  // by the frames that are measured pixels know enough
  return small;
}

std::vector<JobSpec> pilot_windows(const JobSpec& job) {
  const auto length = static_cast<std::ptrdiff_t>(std::min(job.frames.size(), kWindowFrames));
  const auto begin = job.frames.begin(), end = job.frames.end();
  std::vector<JobSpec> windows{small_job(job, {begin, begin + length})};
  if (job.frames.size() > 2 * kWindowFrames) windows.push_back(small_job(job, {end - length, end}));
  return windows;
}

StudyScene pilot_scene(const JobSpec& window) {
  StudyScene scene;
  scene.name = fmt::format("frames from {}", window.frames.front());
  const auto num_measured = static_cast<std::ptrdiff_t>(std::min(window.frames.size(), kMeasured));
  scene.frames = {window.frames.end() - num_measured, window.frames.end()};
  const PixelRect image = window.image.shown();
  scene.crop = {0, 0, image.width(), image.height()};
  for (std::size_t half = 0; half < 2; ++half) {
    JobSpec& reference = scene.reference[half];
    reference = reference_job(window, kReferenceSamples, scene.frames, static_cast<int>(half));
    reference.name = "pilot reference";
    reference.seed = kReferenceSeed + half;
  }
  return scene;
}

double relative_square(std::span<const RunRecord> runs, const std::vector<Reference>& references) {
  double sum = 0, mean = 0;
  for (std::size_t f = 0; f < references.size(); ++f) {
    for (const RunRecord& run : runs) sum += run.frames[f].mse / static_cast<double>(runs.size());
    mean += references[f].mean_radiance * references[f].mean_radiance;
  }
  return mean > 0 ? std::max(sum, 0.0) / mean : 0;
}

}  // namespace baton
