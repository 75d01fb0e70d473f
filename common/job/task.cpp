#include "common/job/task.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

#include "common/base/members.h"

namespace baton {
namespace {

/// Adds every number of `b` to that of `a`.
template <class T>
void add(T& a, const T& b) {
  if constexpr (std::is_arithmetic_v<T>) {
    a += b;
  } else if constexpr (requires { a.begin(); }) {
    for (std::size_t i = 0; i < a.size(); ++i) add(a[i], b[i]);
  } else {
    std::apply(
        [&](auto&... x) { std::apply([&](const auto&... y) { (add(x, y), ...); }, members_of(b)); },
        members_of(a));
  }
}

}  // namespace

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

void SamplingStats::merge(const SamplingStats& b) { add(*this, b); }

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

void RenderStats::merge(const RenderStats& b) { add(*this, b); }

}  // namespace baton
