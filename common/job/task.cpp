#include "common/job/task.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

#include "common/base/check.h"
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
  constexpr std::array<std::string_view, 3> kNames{"render", "assemble", "second pass"};
  return kNames.at(static_cast<std::size_t>(kind));
}

Run TaskKey::run() const {
  BATON_CHECK(kind == TaskKind::render);
  return Run(position);
}

FrameIndex TaskKey::frame() const {
  BATON_CHECK(kind == TaskKind::assemble);
  return FrameIndex(position);
}

Step TaskKey::step() const {
  BATON_CHECK(kind == TaskKind::second_pass);
  return Step(position);
}

TaskKey render_task(Run run, std::int32_t tile) { return {TaskKind::render, run.value(), tile}; }

TaskKey assemble_task(FrameIndex frame) { return {TaskKind::assemble, frame.value(), 0}; }

TaskKey second_pass_task(Step step, std::int32_t tile) {
  return {TaskKind::second_pass, step.value(), tile};
}

std::string describe_task(const TaskKey& task) {
  switch (task.kind) {
    case TaskKind::render:
      return fmt::format("run {} of tile {}", task.run(), task.tile);
    case TaskKind::assemble:
      return fmt::format("assembly of frame index {}", task.frame());
    case TaskKind::second_pass:
      return fmt::format("second pass of tile {} frame index {}", task.tile, task.step());
  }
  return "unknown task";
}

std::string_view blob_kind_name(BlobKind kind) {
  constexpr std::array<std::string_view, 4> kNames{"state", "film", "image", "first-pass samples"};
  return kNames.at(static_cast<std::size_t>(kind));
}

FrameIndex BlobRef::frame() const {
  BATON_CHECK(kind == BlobKind::image);
  return FrameIndex(position);
}

Step BlobRef::step() const {
  BATON_CHECK(kind != BlobKind::image);
  return Step(position);
}

Digest held_state_name(const Digest& job, Step step, std::int32_t tile) {
  return digest_of(fmt::format("{} holds frame {} tile {}", job.hex(), step, tile));
}

std::vector<Digest> stored_blobs(const std::vector<BlobRef>& blobs) {
  std::vector<Digest> stored;
  for (const BlobRef& blob : blobs) {
    if (blob.kind != BlobKind::image && !blob.is_held()) stored.push_back(blob.digest);
  }
  return stored;
}

std::string_view job_status_name(JobStatus status) {
  constexpr std::array<std::string_view, 5> kNames{"running", "done", "failed", "cancelled",
                                                   "paused"};
  return kNames.at(static_cast<std::size_t>(status));
}

void SamplingStats::count_ess(float ess_ratio) {
  const auto bin = static_cast<std::size_t>(std::clamp(ess_ratio, 0.0f, 1.0f) * kEssBins);
  ++ess_histogram[std::min(bin, kEssBins - 1)];
}

void SamplingStats::merge(const SamplingStats& b) { add(*this, b); }

std::string_view noise_source_name(NoiseSource source) {
  constexpr std::array<std::string_view, 5> kNames{"none", "halves", "neighbors", "probes",
                                                   "scatter"};
  return kNames.at(static_cast<std::size_t>(source));
}

void FrameStats::merge(const FrameStats& b) {
  sampling.merge(b.sampling);
  if (b.quality.pixels > 0) quality = b.quality;
}

void RenderStats::merge(const RenderStats& b) { add(*this, b); }

}  // namespace baton
