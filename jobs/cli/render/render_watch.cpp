#include "jobs/cli/render/render_watch.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <filesystem>

#include "common/scene/settle/settle_motion.h"
#include "jobs/cli/say.h"
#include "jobs/cli/settle_method.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr double kCoarseScale = 0.25;

/// Every file that the job names.
std::vector<std::string> watched_files(const JobSpec& job) {
  std::vector<std::string> files = asset_paths(job);
  if (job.scene.gltf) files.push_back(job.scene.gltf->file);
  if (job.camera.gltf) files.push_back(job.camera.gltf->file);
  for (const ObjectSpec& object : job.scene.objects) {
    if (object.gltf) files.push_back(object.gltf->file);
  }
  return files;
}

/// Changes when the file is written, made or removed.
std::string stamp(const std::string& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (error) return path + ": none\n";
  const auto time = fs::last_write_time(path, error).time_since_epoch().count();
  return fmt::format("{}: {} bytes, {}\n", path, size, time);
}

/// Renders the job at a quarter of its size, then whole.
Result<std::optional<JobStatus>> render_twice(RenderSession& session, const JobSpec& job,
                                              bool restart,
                                              const std::function<bool()>& interrupted) {
  JobSpec coarse = job;
  coarse.image = scaled(job.image, kCoarseScale);
  BATON_ASSIGN(const std::optional<JobStatus> status, session.render(coarse, restart, interrupted));
  if (!status || *status != JobStatus::done || coarse.image == job.image) return status;
  return session.render(job, restart, interrupted);
}

}  // namespace

std::string watched_state(const JobArgument& argument) {
  const Result<JobSpec> wanted = load_wanted(argument);
  if (!wanted) return wanted.error().message;
  std::string state = to_json(*wanted);
  for (const std::string& file : watched_files(*wanted)) state += stamp(file);
  return state;
}

Result<ExitCode> watch_and_render(const RenderOptions& options) {
  BATON_ASSIGN(const JobSpec wanted, load_settled(options.job, true));
  BATON_TRY(check_out(options, wanted));
  const FarmOptions farm = farm_options(options, wanted);
  const SignalWait signals;
  BATON_ASSIGN(RenderSession session, RenderSession::start(options, farm, signals));
  bool stop = false;
  while (!stop) {
    const std::string state = watched_state(options.job);
    bool changed = false;
    const auto interrupted = [&] {
      changed = changed || watched_state(options.job) != state;
      return changed;
    };
    Result<JobSpec> version = load_settled(options.job, true);
    Status outcome = version ? check_out(options, *version) : Status(version.error());
    if (outcome.ok()) outcome = settle_method(*version, farm);
    if (outcome.ok()) {
      spdlog::info("a look: frames go to {}", version->output.directory);
      const auto rendered = render_twice(session, *version, options.restart, interrupted);
      if (!rendered) outcome = rendered.error();
      stop = rendered && !*rendered && !changed;
    }
    if (!outcome.ok()) tell("{}\n", outcome.error().message);
    if (!stop && !changed) tell("waiting for changes; Ctrl-C ends\n");
    while (!stop && !interrupted()) {
      BATON_TRY(session.tend());
      stop = signals.stop_requested_within(kFarmPollInterval);
    }
  }
  session.stop();
  return ExitCode::ok;
}

}  // namespace baton
