#include "jobs/cli/job_warnings.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <filesystem>

#include "common/job/estimate.h"
#include "common/job/job_fields.h"
#include "common/job/sequence.h"
#include "jobs/cli/text.h"
#include "worker/scene/settle_scene.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Checkpoints that stay in the work folder beside what is being written.
constexpr std::int64_t kCheckpointsKept = 3;
/// Maps that are looked at while a job is rendered.
constexpr std::size_t kMostMaps = 16;

void map_warnings(const MapReport& map, std::vector<std::string>& warnings) {
  const auto add = [&](const std::string& text) { warnings.push_back(map.path + ": " + text); };
  if (map.repaired_texels > 0) {
    add(fmt::format("{} texels are negative, NaN or infinite and count as 0", map.repaired_texels));
  }
  if (map.black) {
    add("the map is black: nothing will be lit");
  } else if (map.brightest <= 1) {
    add(
        fmt::format("no texel is brighter than 1 ({:.3g}): a picture of low dynamic range? Its "
                    "lamps and its sun are then too dark",
                    map.brightest));
  }
  if (map.file_width != 2 * map.file_height) {
    add(
        fmt::format("{}x{} texels, a lat-long map is twice as wide as high: the light will be "
                    "distorted",
                    map.file_width, map.file_height));
  }
}

/// What all frames, and the checkpoints that are kept, take before compression.
std::int64_t bytes_of(const JobSpec& job) {
  const JobEstimate e = estimate_job(job);
  const std::int64_t checkpoints = job.state.keep == StateKeep::all
                                       ? e.frames / job.state.checkpoint_every + 1
                                       : kCheckpointsKept;
  return e.frame_bytes * e.frames + e.state_bytes * checkpoints;
}

void output_warnings(const JobSpec& job, std::vector<std::string>& warnings) {
  // The part of the path that is there already.
  fs::path folder = job.output.directory;
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  if (!fs::is_directory(folder, error) || ::access(folder.c_str(), W_OK | X_OK) != 0)
    warnings.push_back(
        fmt::format("{}: {} cannot be written", job.output.directory, folder.string()));
  const fs::space_info space = fs::space(folder, error);
  const auto needed = static_cast<std::uint64_t>(bytes_of(job));
  if (!error && space.available < needed) {
    warnings.push_back(fmt::format("{}: {} are free, and frames and state may take {}",
                                   job.output.directory, bytes_text(space.available),
                                   bytes_text(needed)));
  }
}

/// Why an AOV shows nothing of this job; empty: it does.
std::string_view why_empty(Aov aov, const JobSpec& job) {
  const Method method = job.sampling.method;
  switch (aov) {
    case Aov::acceptance:
    case Aov::acceptance_local:
    case Aov::acceptance_independent:
    case Aov::resampled:
      return method == Method::sequential ? "" : "only `sequential` fills it";
    case Aov::variance:
      return traits(method).keeps_samples ? "only `reference`, `pool` and `ratio` fill it" : "";
    case Aov::ess:
      return traits(method).keeps_samples ? "" : "the method's rays have no weights";
    default:
      return "";
  }
}

void aov_warnings(const JobSpec& job, std::vector<std::string>& warnings) {
  for (const Aov aov : job.output.aovs) {
    if (const std::string_view why = why_empty(aov, job); !why.empty())
      warnings.push_back(fmt::format("output.aovs: {} says nothing here: {}",
                                     kAovs.at(static_cast<std::size_t>(aov)), why));
  }
}

}  // namespace

std::vector<std::string> job_warnings(const JobSpec& job, const AssetReport& assets) {
  std::vector<std::string> warnings;
  for (const MapReport& map : assets.maps) map_warnings(map, warnings);
  if (assets.dropped_triangles > 0) {
    warnings.push_back(
        fmt::format("{} triangles without area are left out", assets.dropped_triangles));
  }
  warnings.insert(warnings.end(), assets.odd_objects.begin(), assets.odd_objects.end());
  for (std::string& warning : gltf_warnings(job.scene)) warnings.push_back(std::move(warning));
  aov_warnings(job, warnings);
  output_warnings(job, warnings);
  return warnings;
}

WarningsAside::WarningsAside(JobSpec job)
    : thread_([job = std::move(job)]() mutable {
        std::vector<EnvironmentKey>& keys = job.environment.keys;
        if (keys.size() > kMostMaps) {
          const std::size_t stride = (keys.size() + kMostMaps - 1) / kMostMaps;
          for (std::size_t i = 0; i * stride < keys.size(); ++i) keys[i] = keys[i * stride];
          keys.resize((keys.size() + stride - 1) / stride);
        }
        const Result<AssetReport> assets = load_assets(job);
        if (!assets) return;
        for (const std::string& warning : job_warnings(job, *assets)) spdlog::warn("{}", warning);
      }) {}

}  // namespace baton
