#include "jobs/cli/farm_job_runner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "common/job/text/job_json.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

constexpr std::size_t kMaxOpenJobs = 8;
constexpr std::chrono::milliseconds kPause{20};

Error stopped() { return {ErrorKind::cancelled, "stopped; finished runs are kept"}; }

}  // namespace

FarmJobRunner::~FarmJobRunner() {
  finish_count();
  if (farm_) farm_->stop();
}

void FarmJobRunner::count_as_one(std::string label, std::size_t expected_frames) {
  whole_.emplace(std::move(label), expected_frames);
}

void FarmJobRunner::finish_count() {
  if (whole_) whole_->finish();
}

void FarmJobRunner::say(const std::string& text) {
  if (!whole_) JobRunner::say(text);
}

Status FarmJobRunner::start() {
  if (client_) return {};
  if (coordinator_) {
    farm_.emplace(LocalFarm::attach(coordinator_->endpoint));
  } else {
    BATON_ASSIGN(LocalFarm farm, LocalFarm::start(options_));
    coordinator_.emplace().endpoint = farm.endpoint();
    farm_.emplace(std::move(farm));
  }
  BATON_ASSIGN(RequestClient client, coordinator_->connect());
  client_.emplace(std::move(client));
  return {};
}

Status FarmJobRunner::submit(const JobSpec& wanted, std::size_t index, std::vector<Open>& open) {
  JobSpec job = wanted;
  job.quality.noise_threshold.reset();
  job.quality.time_limit.reset();
  job.quality.max_rounds = 0;
  BATON_ASSIGN(std::string document, make_job_document(job));
  BATON_ASSIGN(const std::optional<JobAccepted> accepted,
               ask_farm<JobAccepted>(
                   *farm_, *client_, signals_,
                   SubmitJob{std::move(document), restarts_looks_ || !job.output.is_look}));
  if (!accepted) return stopped();
  open.push_back({index, accepted->identity.id});
  return {};
}

Result<JobSummary> FarmJobRunner::ask(Open& job, const JobSpec& spec) {
  BATON_ASSIGN(const std::optional<ShownJob> shown,
               ask_farm<ShownJob>(*farm_, *client_, signals_, ShowJob{job.job.hex()}));
  if (!shown) return stopped();
  const JobDetail* const detail = &shown->detail;
  const JobSummary& summary = detail->summary;
  if (shown->lacks_renderer) {
    // Left by another program or machine: it begins again.
    BATON_ASSIGN(std::string document, make_job_document(spec));
    BATON_TRY(ask_farm<JobAccepted>(*farm_, *client_, signals_,
                                    SubmitJob{std::move(document), /*restart=*/true}));
    return summary;
  }
  if (!detail->waits.empty() && job.waits.empty())
    spdlog::warn("run '{}' seed {} waits for {}", spec.name, spec.seed, detail->waits);
  job.waits = detail->waits;
  if (summary.status == JobStatus::running || summary.status == JobStatus::done) return summary;
  if (summary.status == JobStatus::paused)
    return Error{ErrorKind::io, fmt::format("run '{}' seed {} is paused: it waits for {}",
                                            spec.name, spec.seed, detail->waits)};
  return Error{
      ErrorKind::bad_input,
      fmt::format("run '{}' seed {} {}: {}", spec.name, spec.seed,
                  job_status_name(detail->summary.status),
                  detail->failures.empty() ? detail->waits
                                           : fmt::format("{}", fmt::join(detail->failures, "\n")))};
}

Status FarmJobRunner::run(const std::vector<JobSpec>& jobs,
                          const std::function<Status(std::size_t, const JobSummary&)>& done) {
  BATON_TRY(start());
  RunCount own;
  RunCount& count = whole_ ? *whole_ : own;
  const std::size_t first = count.add(jobs);
  std::vector<Open> open;
  std::size_t next = 0, num_done = 0;
  while (num_done < jobs.size()) {
    while (open.size() < kMaxOpenJobs && next < jobs.size()) {
      BATON_TRY(submit(jobs[next], next, open));
      ++next;
    }
    for (std::size_t i = 0; i < open.size();) {
      BATON_ASSIGN(const JobSummary summary, ask(open[i], jobs[open[i].index]));
      count.has_frames(first + open[i].index, summary.frames_done);
      if (is_open(summary.status)) {
        ++i;
        continue;
      }
      BATON_TRY(done(open[i].index, summary));
      if (!farm_->is_own())
        BATON_TRY(ask_farm<JobList>(*farm_, *client_, signals_, DeleteJob{open[i].job.hex()}));
      count.job_done();
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(i));
      ++num_done;
    }
    if (!is_quiet_) count.update();
    if (signals_.stop_requested_within(kPause)) return stopped();
    BATON_TRY(farm_->tend());
  }
  if (!is_quiet_) own.finish();
  return {};
}

}  // namespace baton
