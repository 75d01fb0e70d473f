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

}  // namespace

std::vector<JobSpec> pilot_windows(const JobSpec& job) {
  const std::size_t num_frames = job.frames.size();
  const std::size_t length = std::min(num_frames, kWindowFrames);
  std::vector<JobSpec> windows{window_of(job, 0, length)};
  if (num_frames > 2 * kWindowFrames)
    windows.push_back(window_of(job, num_frames - length, num_frames));
  return windows;
}

std::vector<int> measured_frames(const JobSpec& window) {
  const auto num_measured =
      static_cast<std::ptrdiff_t>(std::min<std::size_t>(window.frames.size(), 2));
  return {window.frames.end() - num_measured, window.frames.end()};
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
