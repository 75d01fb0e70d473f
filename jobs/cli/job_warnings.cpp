#include "jobs/cli/job_warnings.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "common/job/aov.h"
#include "common/job/estimate.h"
#include "common/job/known_limits.h"
#include "common/job/sequence.h"
#include "common/job/store_estimate.h"
#include "jobs/cli/surface_share.h"
#include "jobs/cli/text.h"
#include "worker/scene/plate.h"
#include "worker/scene/scene_warnings.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Maps that are looked at while a job is rendered.
constexpr std::size_t kMostMaps = 16;
/// Factor by which the light's mean changes in a jump, and how many jumps are told one by one.
constexpr float kJump = 2;
constexpr std::size_t kMostJumps = 3;
/// Plates that are told one by one.
constexpr std::size_t kMostPlates = 3;

/// Of any map, also one that only the camera sees.
void texel_warning(const MapReport& map, std::vector<std::string>& warnings) {
  if (map.repaired_texels > 0)
    warnings.push_back(fmt::format("{}: {} texels are negative, NaN or infinite and count as 0",
                                   map.path, map.repaired_texels));
}

void plate_warnings(const std::vector<PlateReport>& plates, std::vector<std::string>& warnings) {
  std::size_t count = 0;
  for (const PlateReport& plate : plates) {
    if (plate.repaired == 0) continue;
    if (++count <= kMostPlates) warnings.push_back(repair_note(plate.path, plate.repaired));
  }
  if (count > kMostPlates)
    warnings.push_back(
        fmt::format("{} more plates have pixels that are NaN or infinite", count - kMostPlates));
}

void map_warnings(const MapReport& map, std::vector<std::string>& warnings) {
  const auto add = [&](const std::string& text) { warnings.push_back(map.path + ": " + text); };
  texel_warning(map, warnings);
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

/// Between two of the job's frames.
struct LightJump {
  int from = 0, to = 0;
  float ratio = 1;  ///< of the mean radiance; 1: only the map is another one
};

/// Where the light changes at once: its mean by a factor of two, or from one key's map to another's
/// within a frame. Numbered maps are a film, so that there only the mean tells.
std::vector<LightJump> light_jumps(const JobSpec& job, const AssetReport& assets) {
  std::vector<LightJump> jumps;
  if (!assets.every_map) return jumps;
  std::map<std::string, float> means;
  for (const MapReport& map : assets.maps) means[map.path] = map.mean;
  const std::vector<EnvironmentKey>& keys = job.environment.keys;
  const auto key = [&](std::int32_t i) -> const EnvironmentKey& {
    return keys[static_cast<std::size_t>(i)];
  };
  const auto level = [&](const EnvironmentFrame& at) {
    return (1 - at.mix) * means[key(at.map_a).map] + at.mix * means[key(at.map_b).map];
  };
  for (std::size_t i = 1; i < job.frames.size(); ++i) {
    const int from = job.frames[i - 1], to = job.frames[i];
    if (to != from + 1) continue;  // frames between them were left out on purpose
    const EnvironmentFrame a = environment_at(job.environment, from);
    const EnvironmentFrame b = environment_at(job.environment, to);
    const float before = level(a), after = level(b);
    const float ratio = before > 0 ? after / before : 1.0f;
    const bool cut = job.environment.interpolate && a.mix == 0 && b.mix == 0 &&
                     key(a.map_a).map != key(b.map_a).map;
    if (ratio > kJump || ratio * kJump < 1)
      jumps.push_back({from, to, ratio});
    else if (cut)
      jumps.push_back({from, to});
  }
  return jumps;
}

std::string jump_text(const LightJump& jump) {
  if (jump.ratio == 1)
    return fmt::format("the light jumps from frame {} to {}: another map", jump.from, jump.to);
  return fmt::format("the light jumps from frame {} to {}: {:.3g} times as bright", jump.from,
                     jump.to, jump.ratio);
}

void output_warnings(const JobSpec& job, const Scene& scene, std::vector<std::string>& warnings) {
  // The part of the path that is there already.
  fs::path folder = job.output.directory;
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  const bool is_folder = fs::is_directory(folder, error);
  if (!is_folder || ::access(folder.c_str(), W_OK | X_OK) != 0)
    warnings.push_back(fmt::format(
        "output.directory: {}: {} cannot be written: {}", job.output.directory, folder.string(),
        is_folder ? "no permission, or a read-only disk" : "it is not a folder"));
  const fs::space_info space = fs::space(folder, error);
  const JobEstimate e = estimate_job(job);
  const auto frames = static_cast<std::uint64_t>(e.frames * e.frame_bytes);
  const auto store = [&](double share) {
    return static_cast<std::uint64_t>(estimate_store(job, share).total());
  };
  if (error || space.available >= frames + store(1)) return;
  const std::uint64_t needed = store(surface_share(job, scene));
  if (space.available < frames + needed) {
    warnings.push_back(fmt::format("{}: {} are free, and frames may take {}, states and tiles {}",
                                   job.output.directory, bytes_text(space.available),
                                   bytes_text(frames), bytes_text(needed)));
  }
}

/// Values of `output` that say nothing here.
void idle_output_warnings(const JobSpec& job, std::vector<std::string>& warnings) {
  if (job.output.plate && !has_plate(job.output))
    warnings.push_back("output.plate: no effect without \"background\": \"plate\"");
  if (job.output.shadows == ShadowForm::alpha && !has_catcher(job))
    warnings.push_back("output.shadows: \"alpha\" has no effect, as nothing catches shadows");
}

void aov_warnings(const JobSpec& job, std::vector<std::string>& warnings) {
  for (const Aov aov : job.output.aovs) {
    if (const std::string_view why = why_empty(aov, job); !why.empty())
      warnings.push_back(
          fmt::format("output.aovs: {} says nothing here: {}", traits(aov).name, why));
  }
  if (draws_twice(job))
    warnings.push_back(
        "output.aovs: variance of a single round draws each pixel twice; with quality.rounds 2 the "
        "same time halves the variance");
}

/// The job with those files alone that warnings look at: some maps, and meshes without normals.
/// What surfaces look like is left out.
JobSpec outline_of(JobSpec job) {
  std::vector<EnvironmentKey>& keys = job.environment.keys;
  if (keys.size() > kMostMaps) {
    const std::size_t stride = (keys.size() + kMostMaps - 1) / kMostMaps;
    for (std::size_t i = 0; i * stride < keys.size(); ++i) keys[i] = keys[i * stride];
    keys.resize((keys.size() + stride - 1) / stride);
  }
  job.environment.camera_map.file.clear();
  job.output.plate.reset();
  for (auto& [name, mesh] : job.scene.meshes) mesh.smooth_normals = false;
  for (auto& [name, material] : job.scene.materials) material = {};
  return job;
}

}  // namespace

std::vector<std::string> job_warnings(const JobSpec& job, const AssetReport& assets) {
  std::vector<std::string> warnings;
  for (const MapReport& map : assets.maps) map_warnings(map, warnings);
  if (assets.camera_map) texel_warning(*assets.camera_map, warnings);
  plate_warnings(assets.plates, warnings);
  if (assets.dropped_triangles > 0) {
    warnings.push_back(
        fmt::format("{} triangles without area are left out", assets.dropped_triangles));
  }
  warnings.insert(warnings.end(), assets.odd_objects.begin(), assets.odd_objects.end());
  const std::vector<LightJump> jumps = light_jumps(job, assets);
  for (std::size_t i = 0; i < std::min(jumps.size(), kMostJumps); ++i)
    warnings.push_back(jump_text(jumps[i]));
  if (jumps.size() > kMostJumps)
    warnings.push_back(fmt::format("the light jumps {} more times", jumps.size() - kMostJumps));
  for (std::string& warning : limit_warnings(job, !jumps.empty()))
    warnings.push_back(std::move(warning));
  for (std::string& warning : scene_warnings(job.scene)) warnings.push_back(std::move(warning));
  aov_warnings(job, warnings);
  idle_output_warnings(job, warnings);
  output_warnings(job, *assets.scene, warnings);
  return warnings;
}

WarningsAside::WarningsAside(JobSpec job)
    : thread_([job = std::move(job)] {
        const JobSpec outline = outline_of(job);
        Result<AssetReport> assets = load_assets(outline);
        if (!assets) return;
        assets->every_map = outline.environment.keys.size() == job.environment.keys.size();
        for (const std::string& warning : job_warnings(job, *assets)) spdlog::warn("{}", warning);
      }) {}

}  // namespace baton
