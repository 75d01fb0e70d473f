#include "jobs/cli/sweeps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "common/base/limits.h"
#include "common/image/image_io.h"
#include "common/job/plan/next_sweeps.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

/// A number of the header of a frame; 0: there is none.
double header_number(const std::filesystem::path& frame, const std::string& name) {
  const Result<ImageMetadata> metadata = read_exr_metadata(frame);
  if (!metadata) return 0;
  for (const auto& [key, value] : *metadata) {
    if (key == name) return std::strtod(value.c_str(), nullptr);
  }
  return 0;
}

/// Noise of the noisiest frame.
float largest_noise(const JobSpec& job) {
  float noise = 0;
  for (FrameIndex frame; frame.index() < job.frames.size(); ++frame) {
    const auto path = frame_path(job, frame);
    noise = std::max(noise, static_cast<float>(header_number(path, "baton:cyclesNoise")));
  }
  return noise;
}

/// Sweeps of the frames that are there, at most; 0: there are none, or not of whole sweeps.
int written_sweeps(const JobSpec& job) {
  double rounds = 0;
  for (FrameIndex frame; frame.index() < job.frames.size(); ++frame) {
    const auto path = frame_path(job, frame);
    rounds = std::max(rounds, header_number(path, "baton:rounds"));
  }
  const int whole = static_cast<int>(std::min<double>(rounds, limits::kMaxRounds));
  return whole % job.quality.rounds == 0 ? whole / job.quality.rounds : 0;
}

}  // namespace

int begin_sweeps(JobSpec& job, bool afresh) {
  if (!job.quality.may_grow()) return 0;
  const int written = afresh ? 0 : written_sweeps(job);
  job.quality.refinable = true;
  job.quality.sweeps = std::max(job.quality.sweeps, written);
  return written;
}

bool MoreSweeps::add_to(JobSpec& job) {
  QualitySpec& quality = job.quality;
  if (!quality.may_grow()) return false;
  const float noise = largest_noise(job);
  if (quality.noise_threshold && noise == 0) {
    fmt::print(stderr, "no frame tells its noise here: no more rounds\n");
    return false;
  }
  const std::chrono::duration<double> seconds = Clock::now() - start_;
  const int next = next_sweeps(quality, noise, seconds.count(), quality.sweeps - first_sweeps_);
  fmt::print(stderr, "{} rounds: noise {:.3g} as Cycles measures it{}\n",
             std::int64_t{quality.rounds} * quality.sweeps, noise,
             next > quality.sweeps
                 ? fmt::format("; {} more", std::int64_t{next - quality.sweeps} * quality.rounds)
                 : "");
  const bool grows = next > quality.sweeps;
  quality.sweeps = next;
  return grows;
}

}  // namespace baton
