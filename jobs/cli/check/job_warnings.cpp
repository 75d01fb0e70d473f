#include "jobs/cli/check/job_warnings.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>

#include "common/advice/known_limits.h"
#include "common/job/aov.h"
#include "common/job/plan/estimate.h"
#include "common/job/plan/sequence.h"
#include "common/job/plan/store_estimate.h"
#include "common/scene/plate.h"
#include "common/scene/scene_warnings.h"
#include "jobs/cli/check/surface_share.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Lines that are told while a job is rendered.
constexpr std::size_t kMostTold = 20;
/// Plates that are told one by one.
constexpr std::size_t kMostPlates = 3;

void plate_warnings(const std::vector<PlateReport>& plates, std::vector<std::string>& warnings) {
  std::size_t count = 0;
  for (const PlateReport& plate : plates) {
    if (plate.notes.empty()) continue;
    if (++count <= kMostPlates)
      warnings.insert(warnings.end(), plate.notes.begin(), plate.notes.end());
  }
  if (count > kMostPlates)
    warnings.push_back(fmt::format("{} more plates are odd in such ways", count - kMostPlates));
}

void append(std::vector<std::string> lines, std::vector<std::string>& warnings) {
  std::ranges::move(lines, std::back_inserter(warnings));
}

std::vector<std::string> light_jumps(const JobSpec& job, const AssetReport& assets) {
  std::map<std::string, float> means;
  for (const MapReport& map : assets.maps) means[map.path] = map.mean;
  std::vector<std::string> jumps;
  for (std::size_t i = 1; i < job.frames.size(); ++i) {
    const auto jump =
        light_jump(job.environment, job.frames[i - 1], job.frames[i], [&](std::int32_t key) {
          return means[job.environment.keys[static_cast<std::size_t>(key)].map];
        });
    if (jump) jumps.push_back(*jump);
  }
  return jumps;
}

/// share: of the pixels that see a surface; asked where it matters.
void output_warnings(const JobSpec& job, const std::function<double()>& share,
                     std::vector<std::string>& warnings) {
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
  const auto store = [&](double of_pixels) {
    return static_cast<std::uint64_t>(estimate_store(job, of_pixels).total());
  };
  if (error || space.available >= frames + store(1)) return;
  const std::uint64_t needed = store(share());
  if (space.available < frames + needed) {
    warnings.push_back(fmt::format("{}: {} are free, and frames may take {}, states and tiles {}",
                                   job.output.directory, bytes_text(space.available),
                                   bytes_text(frames), bytes_text(needed)));
  }
}

/// Where the camera is and looks, if keys say it otherwise.
void idle_camera_warnings(const CameraSpec& camera, std::vector<std::string>& warnings) {
  if (camera.keys.empty()) return;
  const auto look = [&](const char* key, Vec3 CameraSpec::*own, Vec3 CameraKey::*of_key) {
    const bool is_used = camera.*own == CameraSpec().*own ||
                         std::ranges::any_of(camera.keys, [&](const CameraKey& k) {
                           return k.*of_key == camera.*own;
                         });
    if (!is_used)
      warnings.push_back(
          fmt::format("camera.{}: no effect, as every key of camera.keys has its own", key));
  };
  look("position", &CameraSpec::position, &CameraKey::position);
  look("lookAt", &CameraSpec::look_at, &CameraKey::look_at);
  look("up", &CameraSpec::up, &CameraKey::up);
}

/// What of light between surfaces says nothing here, and what it leaves out.
void bounce_warnings(const JobSpec& job, std::vector<std::string>& warnings) {
  if (job.light.bounces == 0 && job.light.filter_glossy != LightSpec().filter_glossy)
    warnings.push_back("light.filterGlossy: no effect, as light.bounces is 0");
  if (const std::string key = catcher_key(job); job.light.bounces > 0 && !key.empty())
    warnings.push_back(fmt::format(
        "light.bounces: {}: what catches shadows receives light between surfaces, and neither "
        "reflects nor blocks it",
        key));
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

/// surface_share, from meshes without normals.
double share_of_outline(JobSpec job) {
  for (auto& [name, mesh] : job.scene.meshes) mesh.smooth_normals = false;
  for (auto& [name, material] : job.scene.materials) material = {};
  const Result<Scene> scene = load_scene(job);
  return scene ? surface_share(job, *scene) : 1;
}

/// What the text of the job tells, light_jumps or not.
void text_warnings(const JobSpec& job, bool light_jumps, const std::function<double()>& share,
                   std::vector<std::string>& warnings) {
  append(limit_warnings(job, light_jumps), warnings);
  append(scene_warnings(job), warnings);
  aov_warnings(job, warnings);
  bounce_warnings(job, warnings);
  idle_camera_warnings(job.camera, warnings);
  idle_output_warnings(job, warnings);
  output_warnings(job, share, warnings);
}

}  // namespace

std::vector<std::string> job_warnings(const JobSpec& job, const AssetReport& assets) {
  std::vector<std::string> warnings;
  for (const MapReport& map : assets.maps) {
    append(texel_warnings(map), warnings);
    append(light_warnings(map), warnings);
  }
  if (assets.camera_map) append(texel_warnings(*assets.camera_map), warnings);
  plate_warnings(assets.plates, warnings);
  append(assets.odd_geometry, warnings);
  const std::vector<std::string> jumps = light_jumps(job, assets);
  const std::size_t told = std::min(jumps.size(), kMostJumps);
  append({jumps.begin(), jumps.begin() + static_cast<std::ptrdiff_t>(told)}, warnings);
  if (jumps.size() > told)
    warnings.push_back(fmt::format("the light jumps {} more times", jumps.size() - told));
  text_warnings(
      job, !jumps.empty(), [&] { return surface_share(job, *assets.scene); }, warnings);
  return warnings;
}

std::vector<std::string> WarningLog::fresh(const std::vector<std::string>& lines) {
  std::vector<std::string> fresh;
  for (const std::string& line : lines) {
    if (told_.size() > kMostTold || !told_.insert(line).second) continue;
    fresh.push_back(told_.size() <= kMostTold ? line : "there is more: `baton check` tells all");
  }
  return fresh;
}

void WarningLog::begin(const JobSpec& job) {
  std::vector<std::string> warnings;
  text_warnings(
      job, false, [&] { return share_of_outline(job); }, warnings);
  for (const std::string& warning : fresh(warnings)) spdlog::warn("{}", warning);
}

}  // namespace baton
