#include "jobs/study/pilot_windows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

constexpr double kPilotPixels = 64 * 36;
constexpr std::size_t kWindowFrames = 12;
constexpr int kReferenceSamples = 512;
/// Far from the seeds that people give.
constexpr std::uint64_t kReferenceSeed = 2'000'000'000;

}  // namespace

JobSpec small_job(const JobSpec& job, std::vector<int> frames, double num_pixels) {
  JobSpec small = job_window(job, std::move(frames));
  const double scale =
      std::min(1.0, std::sqrt(num_pixels / (1.0 * job.image.width * job.image.height)));
  small.image.width = std::max(1, static_cast<int>(std::lround(job.image.width * scale)));
  small.image.height = std::max(1, static_cast<int>(std::lround(job.image.height * scale)));
  small.metadata.clear();
  small.output.background = Background::transparent;
  small.output.pixel_type = PixelType::full_float;
  small.output.pattern = kFramePattern;
  small.output.aovs = {Aov::lns};
  small.state.keep = StateKeep::last;
  return small;
}

std::vector<JobSpec> pilot_windows(const JobSpec& job) {
  const auto length = static_cast<std::ptrdiff_t>(std::min(job.frames.size(), kWindowFrames));
  const auto begin = job.frames.begin(), end = job.frames.end();
  std::vector<JobSpec> windows{small_job(job, {begin, begin + length}, kPilotPixels)};
  if (job.frames.size() > 2 * kWindowFrames)
    windows.push_back(small_job(job, {end - length, end}, kPilotPixels));
  return windows;
}

std::vector<int> measured_frames(const JobSpec& window) {
  const auto num_measured =
      static_cast<std::ptrdiff_t>(std::min<std::size_t>(window.frames.size(), 2));
  return {window.frames.end() - num_measured, window.frames.end()};
}

void keep_measured_frames(Study& study) {
  for (StudyCell& cell : study.cells) {
    JobSpec window = job_window(cell.job, measured_frames(cell.job));
    cell.job = std::move(window);
  }
}

StudyScene pilot_scene(const JobSpec& window) {
  StudyScene scene;
  scene.name = fmt::format("frames from {}", window.frames.front());
  scene.frames = measured_frames(window);
  scene.crop = {0, 0, window.image.width, window.image.height};
  for (std::size_t half = 0; half < 2; ++half) {
    JobSpec& reference = scene.reference[half];
    reference = job_window(window, scene.frames);
    reference.name = "pilot reference";
    reference.sampling = {};
    reference.sampling.method = Method::reference;
    reference.sampling.reference_samples = kReferenceSamples;
    reference.seed = kReferenceSeed + half;
    reference.output.aovs = {Aov::lns, Aov::variance, Aov::material};
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
