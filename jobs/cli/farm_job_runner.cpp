#include "jobs/cli/farm_job_runner.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <numeric>

#include "common/job/job_json.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMaxOpenJobs = 8;
constexpr std::chrono::milliseconds kPause{20};
constexpr std::chrono::seconds kLineInterval{5};

Error stopped() { return {ErrorKind::cancelled, "stopped; finished runs are kept"}; }

/// Says now and then how far it is.
class Count {
 public:
  explicit Count(const std::vector<JobSpec>& jobs)
      : num_jobs_(jobs.size()), frames_done_(num_jobs_) {
    for (const JobSpec& job : jobs) num_frames_ += job.frames.size();
  }

  void has_frames(std::size_t job, std::size_t done) { frames_done_[job] = done; }
  void update(std::size_t jobs_done) {
    const Clock::time_point now = Clock::now();
    const bool terminal = ::isatty(STDERR_FILENO) == 1;
    if (jobs_done < num_jobs_ && now < next_) return;
    next_ = now + (terminal ? kPause : kLineInterval);
    const double seconds = std::chrono::duration<double>(now - start_).count();
    const auto done = std::accumulate(frames_done_.begin(), frames_done_.end(), std::size_t{0});
    const auto left = static_cast<double>(num_frames_ - done);
    fmt::print(stderr, "{}runs {}/{}  frames {}/{}  ETA {}{}", terminal ? "\r" : "", jobs_done,
               num_jobs_, done, num_frames_,
               done > 0 ? duration_text(left * seconds / static_cast<double>(done)) : "?",
               terminal && jobs_done < num_jobs_ ? "\x1b[K" : "\n");
  }

 private:
  std::size_t num_jobs_, num_frames_ = 0;
  std::vector<std::size_t> frames_done_;  ///< by job
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_;
};

}  // namespace

FarmJobRunner::~FarmJobRunner() {
  if (farm_) farm_->stop();
}

Status FarmJobRunner::start() {
  if (farm_) return {};
  BATON_ASSIGN(LocalFarm farm, LocalFarm::start(options_));
  BATON_ASSIGN(RequestClient client, RequestClient::connect(farm.endpoint()));
  farm_.emplace(std::move(farm));
  client_.emplace(std::move(client));
  return {};
}

Status FarmJobRunner::submit(const JobSpec& job, std::size_t index, std::vector<Open>& open) {
  BATON_ASSIGN(std::string document, make_job_document(job));
  BATON_ASSIGN(const std::optional<JobAccepted> accepted,
               ask_farm<JobAccepted>(*farm_, *client_, signals_,
                                     SubmitJob{std::move(document), /*restart=*/true}));
  if (!accepted) return stopped();
  open.push_back({index, accepted->job});
  return {};
}

Result<JobSummary> FarmJobRunner::ask(Open& job, const JobSpec& spec) {
  BATON_ASSIGN(const std::optional<JobDetail> detail,
               ask_farm<JobDetail>(*farm_, *client_, signals_, ShowJob{job.job.hex()}));
  if (!detail) return stopped();
  const JobSummary& summary = detail->summary;
  if (!detail->waits.empty() && job.waits.empty())
    spdlog::warn("run '{}' seed {} waits for {}", spec.name, spec.seed, detail->waits);
  job.waits = detail->waits;
  if (summary.status == JobStatus::running || summary.status == JobStatus::done) return summary;
  if (summary.status == JobStatus::paused)
    return Error{ErrorKind::io, fmt::format("run '{}' seed {} is paused: it waits for {}",
                                            spec.name, spec.seed, detail->waits)};
  return Error{ErrorKind::bad_input, fmt::format("run '{}' seed {} {}: {}", spec.name, spec.seed,
                                                 job_status_name(detail->summary.status),
                                                 fmt::join(detail->failures, "\n"))};
}

Status FarmJobRunner::run(const std::vector<JobSpec>& jobs,
                          const std::function<Status(std::size_t, const JobSummary&)>& done) {
  BATON_TRY(start());
  Count count(jobs);
  std::vector<Open> open;
  std::size_t next = 0, num_done = 0;
  while (num_done < jobs.size()) {
    while (open.size() < kMaxOpenJobs && next < jobs.size()) {
      BATON_TRY(submit(jobs[next], next, open));
      ++next;
    }
    for (std::size_t i = 0; i < open.size();) {
      BATON_ASSIGN(const JobSummary summary, ask(open[i], jobs[open[i].index]));
      count.has_frames(open[i].index, summary.frames_done);
      if (is_open(summary.status)) {
        ++i;
        continue;
      }
      BATON_TRY(done(open[i].index, summary));
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(i));
      ++num_done;
    }
    count.update(num_done);
    if (signals_.stop_requested_within(kPause)) return stopped();
    BATON_TRY(farm_->tend());
  }
  return {};
}

}  // namespace baton
