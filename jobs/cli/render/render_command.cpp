#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>

#include "common/base/machine_memory.h"
#include "common/base/trace.h"
#include "common/store/worker_logs.h"
#include "jobs/cli/check/asset_report.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/display.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/render/render_watch.h"
#include "jobs/cli/say.h"
#include "jobs/cli/settle_method.h"
#include "jobs/trace/trace_file.h"

namespace baton {
namespace {

using Clock = std::chrono::steady_clock;

/// Says how the job ended; one that failed because its files cannot be loaded is bad input.
ExitCode exit_code_of(const JobSpec& job, JobStatus status, std::uint64_t memory_mib) {
  if (status != JobStatus::failed) return exit_code_of_stopped(status);
  const Result<AssetReport> assets =
      load_assets(job, memory_mib > 0 ? memory_mib << 20 : default_memory_bytes());
  return assets ? ExitCode::failed : exit_code_of(assets.error().kind);
}

/// What all threads of a farm and of this process do, until it is written to a file.
class FarmTrace {
 public:
  /// file: empty: nothing is done.
  explicit FarmTrace(std::string file) : file_(std::move(file)) {}

  /// Once the farm is there. loaded, started: when the job was, and the farm.
  Status begin(const std::filesystem::path& work_folder, Clock::time_point loaded) {
    if (file_.empty()) return {};
    logs_ = worker_logs(work_folder);
    std::error_code error;
    std::filesystem::create_directories(logs_, error);
    BATON_TRY(trace_to_file(logs_ / "baton-render.trace", "baton render"));
    record_span(SpanKind::phase, "the job and its files", begin_, loaded, "");
    record_span(SpanKind::phase, "starting the farm", loaded, Clock::now(), "");
    return {};
  }
  /// Once it has ended.
  Status write() const {
    if (logs_.empty()) return {};
    end_trace();
    Trace trace = read_worker_traces(logs_);
    keep_since(trace, since_1970_s_);
    BATON_TRY(write_trace(file_, trace));
    tell("trace      {}; `baton trace` says what is in it\n", file_);
    return {};
  }

 private:
  const std::string file_;
  const Clock::time_point begin_ = Clock::now();
  const double since_1970_s_ =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  std::filesystem::path logs_;
};

/// again: the arguments that go on with it.
Result<ExitCode> run_render(const RenderOptions& options, const std::string& again) {
  FarmTrace trace(options.trace);
  BATON_ASSIGN(JobSpec job, load_settled(options.job));
  BATON_TRY(begin_at(job, options.from_frame));
  BATON_TRY(check_out(options, job));
  if (job.output.is_look) spdlog::info("a look: frames go to {}", job.output.directory);
  const FarmOptions farm = farm_options(options, job);
  BATON_TRY(settle_method(job, farm));

  const SignalWait signals;
  const Clock::time_point loaded = Clock::now();
  BATON_ASSIGN(RenderSession session, RenderSession::start(options, farm, signals));
  BATON_TRY(trace.begin(farm.work_directory, loaded));
  const Result<std::optional<JobStatus>> rendered =
      session.render(job, options.restart || options.from_frame);
  if (!rendered) {
    session.stop();
    return rendered.error();
  }
  const std::optional<JobStatus>& status = *rendered;
  if (status && options.keep_running) {
    tell("the coordinator still answers at {}; Ctrl-C ends it\n", session.endpoint());
    BATON_TRY(session.keep_running());
  }
  if (!status) spdlog::info("stopping; finished work is kept");
  session.stop();
  BATON_TRY(trace.write());
  if (status) return exit_code_of(job, *status, options.memory_mib);

  tell("to go on: baton render {}\n", again);
  return ExitCode::cancelled;
}

}  // namespace

void add_render_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Renders a job on this machine");
  add_job_argument(*command, options->job);
  command->add_option("--out", options->out, "also writes the only frame as PNG");
  add_radiance_options(*command, options->display);
  command
      ->add_option("--workers", options->workers,
                   "worker processes; default: 1, whose threads share scene and light")
      ->check(CLI::Range(1, 256));
  command
      ->add_option("--threads-per-worker", options->threads_per_worker,
                   "default: the processors shared out")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--memory", options->memory_mib,
                   "MiB that all workers together may use, about; default: half of the machine's")
      ->check(CLI::Range(1, 1 << 30));
  command
      ->add_option("--isa", options->isa,
                   "instruction set of the workers: auto, sse4, avx2 or avx512; default: auto")
      ->check(CLI::IsMember({"auto", "sse4", "avx2", "avx512"}));
  command->add_option("--work-dir", options->work_directory,
                      "journal, blobs and logs; default: .baton in the output folder");
  add_store_limit_option(*command, options->store_limit_mib);
  command->add_flag("--watch", options->watch,
                    "renders a look, coarse first, and again when the job or its files change, "
                    "until Ctrl-C");
  command->add_flag("--restart", options->restart,
                    "replace the frames of another picture in the output folder");
  add_from_frame_option(*command, options->from_frame);
  command->add_flag("--keep-running", options->keep_running,
                    "keep coordinator and workers until Ctrl-C");
  command
      ->add_option("--trace", options->trace,
                   "writes what each thread did, for `baton trace` and Perfetto")
      ->excludes("--watch");
  command->add_flag("--json", options->json, "the result for machines");
  command->footer(
      "Examples:\n"
      "  baton render job.json\n"
      "  baton render job.json --workers 4 --threads-per-worker 2\n"
      "  baton render job.json --frames 12 --scale .25 --set image.sites=1 --out look.png\n"
      "With --frames, --scale, --region or --set, frames go to a folder of their own, that of the\n"
      "job with -look behind its name.\n"
      "Ctrl-C stops; the same command goes on where it stopped.");
  command->callback([options, command, &code] {
    code = finish_with_coordinator(
        options->watch ? watch_and_render(*options)
                       : run_render(*options, typed_again(*command, {"--restart"})));
  });
}

}  // namespace baton
