#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include "common/job/job_json.h"
#include "common/job/sequence.h"
#include "jobs/cli/ask_farm.h"
#include "jobs/cli/asset_report.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/frame_sheet.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/progress.h"
#include "jobs/cli/settle_method.h"
#include "worker/scene/settle_motion.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct RenderOptions {
  std::string job;
  int workers = 0;             ///< 0: one, whose threads share scene and light
  int threads_per_worker = 0;  ///< 0: the processors shared out
  std::string work_directory;  ///< empty: .baton in the output folder
  bool restart = false;
  bool keep_running = false;
  bool json = false;
};

FarmOptions farm_options(const RenderOptions& options, const JobSpec& job) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  FarmOptions farm;
  farm.workers = std::max(1, options.workers);
  farm.threads_per_worker = options.threads_per_worker > 0 ? options.threads_per_worker
                                                           : std::max(1, processors / farm.workers);
  farm.work_directory =
      fs::absolute(options.work_directory.empty() ? fs::path(job.output.directory) / ".baton"
                                                  : fs::path(options.work_directory));
  return farm;
}

/// Follows the job to its end, reading finished frames for the sheet; nullopt when the user asked
/// to stop.
Result<std::optional<JobDetail>> follow(LocalFarm& farm, RequestClient& client,
                                        const SignalWait& signals, const Digest& job,
                                        FrameSheet& sheet) {
  Progress progress(::isatty(STDERR_FILENO) == 1);
  for (;;) {
    BATON_ASSIGN(std::optional<JobDetail> detail,
                 ask_farm<JobDetail>(farm, client, signals, ShowJob{job.hex()}));
    if (detail) {
      progress.update(detail->summary, Clock::now());
      sheet.add(detail->frames_done);
    }
    const bool over = !detail || !is_open(detail->summary.status);
    if (over || signals.stop_requested_within(kFarmPollInterval)) {
      progress.finish();
      return over ? detail : std::nullopt;
    }
    BATON_TRY(farm.tend());
  }
}

/// Each failure ends with the command that replays its tile alone.
void print_failures(const JobDetail& detail) {
  for (const std::string& failure : detail.failures) fmt::print(stderr, "failure: {}\n", failure);
}

void print_result(const RenderOptions& options, const JobSpec& job, const JobDetail& detail,
                  double seconds) {
  if (options.json) return fmt::print("{}\n", detail_json(detail).dump(2));
  fmt::print("job        {} in {:.1f} s\n", job_status_name(detail.summary.status), seconds);
  fmt::print("frames     {} of {} in {}/{}\n", detail.summary.frames_done,
             detail.summary.frames_total, job.output.directory, job.output.pattern);
  fmt::print("{}", job_statistics(detail.summary));
}

/// A sheet that cannot be made is no failure of the job.
void write_sheet(const RenderOptions& options, const FrameSheet& sheet) {
  const Result<std::optional<fs::path>> path = sheet.write();
  if (!path) return spdlog::warn("no contact sheet: {}", path.error().message);
  if (*path && !options.json) fmt::print("sheet      {}\n", (*path)->string());
}

/// Says how the job ended; one that failed because its files cannot be loaded is bad input.
ExitCode exit_code_of(const JobSpec& job, JobStatus status) {
  if (status != JobStatus::failed) return exit_code_of(status);
  const Result<AssetReport> assets = load_assets(job);
  return assets ? ExitCode::failed : exit_code_of(assets.error().kind);
}

Result<ExitCode> run_render(const RenderOptions& options) {
  const Clock::time_point start = Clock::now();
  BATON_ASSIGN(JobSpec written, load_job(options.job));
  BATON_ASSIGN(JobSpec job, settle_motion(std::move(written)));
  const FarmOptions farm_setup = farm_options(options, job);
  BATON_TRY(settle_method(job, farm_setup));
  BATON_ASSIGN(std::string document, make_job_document(job));

  // Start the farm and hand it the job; one that it knows goes on where it stopped.
  const SignalWait signals;
  BATON_ASSIGN(LocalFarm farm, LocalFarm::start(farm_setup));
  BATON_ASSIGN(RequestClient client, RequestClient::connect(farm.endpoint()));
  BATON_ASSIGN(const std::optional<JobAccepted> accepted,
               ask_farm<JobAccepted>(farm, client, signals,
                                     SubmitJob{std::move(document), options.restart}));
  if (accepted && accepted->already_there) spdlog::info("going on with what is done already");

  FrameSheet sheet(job);
  std::optional<JobDetail> detail;
  if (accepted) {
    BATON_ASSIGN(detail, follow(farm, client, signals, accepted->job, sheet));
  }
  if (!detail) {
    spdlog::info("stopping; finished work is kept");
    farm.stop();
    const std::string place =
        options.work_directory.empty() ? "" : " --work-dir " + options.work_directory;
    fmt::print(stderr, "to go on: baton render {}{}\n", options.job, place);
    return ExitCode::cancelled;
  }

  print_result(options, job, *detail, std::chrono::duration<double>(Clock::now() - start).count());
  write_sheet(options, sheet);
  if (detail->summary.status == JobStatus::failed) print_failures(*detail);
  if (options.keep_running) {
    fmt::print(stderr, "the coordinator still answers at {}; Ctrl-C ends it\n", farm.endpoint());
    while (!signals.stop_requested_within(kFarmPollInterval)) BATON_TRY(farm.tend());
  }
  farm.stop();
  return exit_code_of(job, detail->summary.status);
}

}  // namespace

void add_render_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Renders a job on this machine");
  command->add_option("JOB", options->job, "job file")->required();
  command
      ->add_option("--workers", options->workers,
                   "worker processes; default: 1, whose threads share scene and light")
      ->check(CLI::Range(1, 256));
  command
      ->add_option("--threads-per-worker", options->threads_per_worker,
                   "default: the processors shared out")
      ->check(CLI::Range(1, 1024));
  command->add_option("--work-dir", options->work_directory,
                      "journal, blobs and logs; default: .baton in the output folder");
  command->add_flag("--restart", options->restart,
                    "replace the frames of another picture in the output folder");
  command->add_flag("--keep-running", options->keep_running,
                    "keep coordinator and workers until Ctrl-C");
  command->add_flag("--json", options->json, "the result for machines");
  command->footer(
      "Examples:\n"
      "  baton render job.json\n"
      "  baton render job.json --workers 4 --threads-per-worker 2\n"
      "Ctrl-C stops; the same command goes on where it stopped.");
  command->callback([options, &code] { code = finish_with_coordinator(run_render(*options)); });
}

}  // namespace baton
