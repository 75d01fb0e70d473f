#include "common/job/task.h"

#include <fmt/format.h>

#include <algorithm>

namespace baton {

std::string_view task_name(TaskKind kind) {
  switch (kind) {
    case TaskKind::render:
      return "render";
    case TaskKind::assemble:
      return "assemble";
    case TaskKind::second_pass:
      return "second pass";
  }
  return "unknown";
}

std::string describe_task(const TaskKey& task) {
  switch (task.kind) {
    case TaskKind::render:
      return fmt::format("run {} of tile {}", task.step, task.tile);
    case TaskKind::assemble:
      return fmt::format("assembly of frame index {}", task.step);
    case TaskKind::second_pass:
      return fmt::format("second pass of tile {} frame index {}", task.tile, task.step);
  }
  return "unknown task";
}

Digest held_state_name(const Digest& job, std::int32_t frame, std::int32_t tile) {
  return digest_of(fmt::format("{} holds frame {} tile {}", job.hex(), frame, tile));
}

std::vector<Digest> stored_blobs(const std::vector<BlobRef>& blobs) {
  std::vector<Digest> stored;
  for (const BlobRef& blob : blobs) {
    if (blob.kind != BlobKind::image && !blob.is_held()) stored.push_back(blob.digest);
  }
  return stored;
}

std::string_view job_status_name(JobStatus status) {
  switch (status) {
    case JobStatus::running:
      return "running";
    case JobStatus::done:
      return "done";
    case JobStatus::failed:
      return "failed";
    case JobStatus::cancelled:
      return "cancelled";
    case JobStatus::paused:
      return "paused";
  }
  return "unknown";
}

void SamplingStats::count_ess(float ess_ratio) {
  const auto bin = static_cast<std::size_t>(std::clamp(ess_ratio, 0.0f, 1.0f) * kEssBins);
  ++ess_histogram[std::min(bin, kEssBins - 1)];
}

void SamplingStats::merge(const SamplingStats& b) {
  pixels_fresh += b.pixels_fresh;
  pixels_carried += b.pixels_carried;
  pixels_restarted += b.pixels_restarted;
  pixels_refreshed += b.pixels_refreshed;
  pixels_refreshed_by_ratio += b.pixels_refreshed_by_ratio;
  pixels_resampled += b.pixels_resampled;
  local_proposed += b.local_proposed;
  local_accepted += b.local_accepted;
  independent_proposed += b.independent_proposed;
  independent_accepted += b.independent_accepted;
  for (std::size_t i = 0; i < kEssBins; ++i) ess_histogram[i] += b.ess_histogram[i];
}

std::string_view noise_source_name(NoiseSource source) {
  switch (source) {
    case NoiseSource::none:
      return "none";
    case NoiseSource::halves:
      return "halves";
    case NoiseSource::neighbors:
      return "neighbors";
    case NoiseSource::probes:
      return "probes";
  }
  return "unknown";
}

void FrameStats::merge(const FrameStats& b) {
  sampling.merge(b.sampling);
  if (b.quality.pixels > 0) quality = b.quality;
}

void RenderStats::merge(const RenderStats& b) {
  pixels += b.pixels;
  rays_primary += b.rays_primary;
  rays_shadow += b.rays_shadow;
  target_evaluations += b.target_evaluations;
  pixels_background += b.pixels_background;
  sampling.merge(b.sampling);
  cpu_seconds += b.cpu_seconds;
  seconds_light += b.seconds_light;
  seconds_primary += b.seconds_primary;
  seconds_sample += b.seconds_sample;
  seconds_visibility += b.seconds_visibility;
  seconds_shade += b.seconds_shade;
  seconds_state += b.seconds_state;
  pixels_masked += b.pixels_masked;
  rays_second_pass += b.rays_second_pass;
  seconds_second_pass += b.seconds_second_pass;
  seconds_second_rays += b.seconds_second_rays;
}

}  // namespace baton
