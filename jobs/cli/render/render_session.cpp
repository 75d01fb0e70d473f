#include "jobs/cli/render/render_session.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include "common/base/limits.h"
#include "common/base/trace.h"
#include "common/job/plan/sequence.h"
#include "jobs/cli/frame_sheet.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/render/progress.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Each failure ends with the command that replays its tile alone.
void print_failures(const JobDetail& detail) {
  for (const std::string& failure : detail.failures) tell("failure: {}\n", failure);
}

void print_result(const JobSpec& job, const JobDetail& detail, double seconds) {
  say("job        {} in {:.1f} s\n", job_status_name(detail.summary.status), seconds);
  say("frames     {} of {} in {}/{}\n", detail.summary.frames_done, detail.summary.frames_total,
      job.output.directory, job.output.pattern);
  say("{}{}", job_statistics(detail.summary), judgement_text(detail));
}

/// A sheet that cannot be made is no failure of the job.
void write_sheet(const FrameSheet& sheet, const DisplayOptions& display, bool json) {
  const Result<std::optional<std::filesystem::path>> path = sheet.write(display);
  if (!path) return spdlog::warn("no contact sheet: {}", path.error().message);
  if (*path && !json) say("sheet      {}, {}\n", (*path)->string(), radiance_text(display));
}

}  // namespace

Status check_out(const RenderOptions& options, const JobSpec& job) {
  if (options.out.empty() || job.frames.size() == 1) return {};
  return Error{ErrorKind::usage,
               fmt::format("--out {}: expected a job of one frame, as with --frames {}, got {}",
                           options.out, job.frames.front(), job.frames.size())};
}

FarmOptions farm_options(const RenderOptions& options, const JobSpec& job) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  FarmOptions farm;
  farm.workers = std::max(1, options.workers);
  farm.threads_per_worker = options.threads_per_worker > 0 ? options.threads_per_worker
                                                           : std::max(1, processors / farm.workers);
  farm.memory_bytes = options.memory_mib << 20;
  farm.work_directory =
      fs::absolute(options.work_directory.empty() ? fs::path(job.output.directory) / ".baton"
                                                  : fs::path(options.work_directory));
  farm.store_limit_mib = options.store_limit_mib;
  farm.isa = options.isa;
  return farm;
}

void add_store_limit_option(CLI::App& command, std::uint64_t& store_limit_mib) {
  command
      .add_option("--store-limit", store_limit_mib,
                  "MiB that states and films may take in the work folder; a job that needs more "
                  "ends with an error and can go on; default: as the disk has room")
      ->envname("BATON_STORE_LIMIT")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
}

Result<RenderSession> RenderSession::start(const RenderOptions& options, const FarmOptions& farm,
                                           const SignalWait& signals) {
  BATON_ASSIGN(LocalFarm started, LocalFarm::start(farm));
  BATON_ASSIGN(RequestClient client, RequestClient::connect(started.endpoint()));
  return RenderSession(options, signals, std::move(started), std::move(client));
}

/// Follows the job to its end, reading finished frames for the sheet.
Result<std::optional<ShownJob>> RenderSession::follow(const JobSpec& spec, const JobId& job,
                                                      FrameSheet& sheet,
                                                      const std::function<bool()>& interrupted) {
  Progress progress(::isatty(STDERR_FILENO) == 1);
  std::string waits;
  std::size_t num_grown = 0;
  Digest version;
  for (;;) {
    BATON_ASSIGN(std::optional<ShownJob> shown,
                 ask_farm<ShownJob>(farm_, client_, signals_, ShowJob{job.hex()}));
    if (shown) {
      for (const std::string& note : warnings_.fresh(shown->detail.notes)) {
        progress.finish();
        spdlog::warn("{}", note);
      }
      for (const std::string& line : fresh_growth(*shown, num_grown)) {
        progress.finish();
        tell("{}\n", line);
      }
      // More sweeps make all frames anew.
      if (version != shown->detail.summary.version) {
        version = shown->detail.summary.version;
        progress = Progress(::isatty(STDERR_FILENO) == 1);
        sheet = FrameSheet(spec);
      }
      progress.update(shown->detail.summary, shown->now.eta, Clock::now());
      if (!shown->detail.waits.empty() && waits.empty() &&
          !((shown->detail.lacks_room || shown->lacks_renderer) && farm_.is_own())) {
        progress.finish();
        spdlog::warn("waits for {}", shown->detail.waits);
      }
      waits = shown->detail.waits;
      sheet.add(shown->detail.frames_done);
    }
    // Who paused it, if not the person before this terminal, will not resume it. In a farm of its
    // own nobody makes room either.
    const bool is_stuck = shown && (shown->detail.lacks_room || shown->lacks_renderer);
    const bool over = !shown || shown->detail.summary.status != JobStatus::running ||
                      (is_stuck && farm_.is_own());
    // Once all is rendered it is done in a moment.
    constexpr std::chrono::milliseconds kMoment{20};
    const bool is_rendered =
        shown && shown->detail.summary.tasks_done == shown->detail.summary.tasks_total;
    if (over || interrupted() ||
        signals_.stop_requested_within(is_rendered ? kMoment : kFarmPollInterval)) {
      progress.finish();
      return over ? shown : std::nullopt;
    }
    BATON_TRY(farm_.tend());
  }
}

/// Waits until a worker is there, not for long: who does not come is told of while the job runs.
Status RenderSession::await_worker() {
  constexpr std::chrono::seconds kPatience{20};
  constexpr std::chrono::milliseconds kInterval{20};  // a worker is there in a tenth of a second
  const Clock::time_point end = Clock::now() + kPatience;
  while (Clock::now() < end) {
    BATON_ASSIGN(const std::optional<JobList> list,
                 ask_farm<JobList>(farm_, client_, signals_, ListJobs{}));
    if (!list || !list->workers.empty() || signals_.stop_requested_within(kInterval)) return {};
    BATON_TRY(farm_.tend());
  }
  return {};
}

/// In a farm of its own nobody else waits for a job that was interrupted: what writes into the
/// folder under another name ends, and leaves what it has done.
Status RenderSession::end_namesakes(const JobSpec& job) {
  BATON_ASSIGN(const std::optional<JobList> list,
               ask_farm<JobList>(farm_, client_, signals_, ListJobs{}));
  for (const ListedJob& other : list ? list->jobs : std::vector<ListedJob>()) {
    std::error_code error;
    const bool is_here =
        other.summary.output_directory == job.output.directory ||
        fs::equivalent(other.summary.output_directory, job.output.directory, error);
    if (!is_here || other.summary.name == job.name || !is_open(other.summary.status)) continue;
    tell("job '{}', which was interrupted, makes way\n", other.summary.name);
    BATON_ASSIGN(const std::optional<ShownJob> ended,
                 ask_farm<ShownJob>(farm_, client_, signals_, CancelJob{other.identity.id.hex()}));
    if (!ended) return {};
  }
  return {};
}

/// Submits the job and follows it to its end.
Result<std::optional<ShownJob>> RenderSession::render_document(
    const JobSpec& job, bool restart, FrameSheet& sheet, const std::function<bool()>& interrupted) {
  std::optional<Span> phase(std::in_place, SpanKind::phase, "digests of files");
  BATON_ASSIGN(const std::string document, make_job_document(job));
  if (farm_.is_own()) BATON_TRY(end_namesakes(job));
  // What --restart begins again depends on who renders.
  if (restart && farm_.is_own()) BATON_TRY(await_worker());
  for (;;) {
    phase.emplace(SpanKind::phase, "submission");
    BATON_ASSIGN(const std::optional<JobAccepted> accepted,
                 ask_farm<JobAccepted>(farm_, client_, signals_, SubmitJob{document, restart}));
    phase.emplace(SpanKind::phase, "rendering");
    if (!accepted) return std::optional<ShownJob>();
    tell("{}", accepted->plan);
    BATON_ASSIGN(std::optional<ShownJob> shown,
                 follow(job, accepted->identity.id, sheet, interrupted));
    // By what the workers render is known once they are there: then what they cannot go on with is
    // begun again.
    if (!restart || !shown || !shown->lacks_renderer) return shown;
  }
}

Result<std::optional<JobStatus>> RenderSession::render(JobSpec job, bool restart,
                                                       const std::function<bool()>& interrupted) {
  const Clock::time_point start = Clock::now();
  warnings_.begin(job);
  FrameSheet sheet(job);
  BATON_ASSIGN(const std::optional<ShownJob> shown,
               render_document(job, restart, sheet, interrupted));
  if (!shown) return std::optional<JobStatus>();
  const JobStatus status = shown->detail.summary.status;
  if (options_.json) {
    fmt::print("{}\n", json_text(detail_json(*shown), 2));
  } else {
    print_result(job, shown->detail, std::chrono::duration<double>(Clock::now() - start).count());
  }
  {
    const Span phase(SpanKind::phase, "contact sheet");
    write_sheet(sheet, options_.display, options_.json);
  }
  if (status == JobStatus::done) BATON_TRY(write_png_of(job));
  if (status == JobStatus::failed) print_failures(shown->detail);
  if (shown->lacks_renderer && farm_.is_own())
    return Error{ErrorKind::version, "the job waits for " + shown->detail.waits +
                                         "; where that is an instruction set of this machine, "
                                         "`baton render --isa` goes on"};
  if (status == JobStatus::paused || shown->detail.lacks_room)
    tell("{}: the job waits for {}\nto go on: the same command\n",
         status == JobStatus::paused ? "paused" : "stopped", shown->detail.waits);
  std::fflush(stdout);
  if (exit_code_of(shown->detail) == ExitCode::io) return Error{ErrorKind::io, shown->detail.waits};
  return std::optional(status);
}

void RenderSession::stop() {
  const Span phase(SpanKind::phase, "stopping the farm");
  farm_.stop();
}

Status RenderSession::write_png_of(const JobSpec& job) const {
  if (options_.out.empty()) return {};
  BATON_ASSIGN(RgbImage image, read_rgb_image(frame_path(job, FrameIndex(0)), ExrWindow::seen));
  const Display shown = display_radiance(std::move(image), options_.display);
  BATON_TRY(write_png(options_.out, shown.image));
  if (!options_.json) say("picture    {}, {}\n", options_.out, shown.how);
  return {};
}

Status RenderSession::keep_running(const std::function<void()>& meanwhile) {
  while (!signals_.stop_requested_within(kFarmPollInterval)) {
    BATON_TRY(farm_.tend());
    meanwhile();
  }
  return {};
}

}  // namespace baton
