#include "jobs/cli/farm/slurm_farm.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/base/files.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/captured_command.h"

namespace baton {
namespace {

/// Slurm's commands try for 10 s or so when the controller is away.
constexpr std::chrono::seconds kSlurmPatience{30};
constexpr std::chrono::seconds kAnswerPatience{2};
/// Pilots are sent home when at so many looks in a row the work was enough for fewer.
constexpr std::size_t kLooksBeforeShrinking = 3;
/// After so many arrays in vain others are submitted seldom.
constexpr int kMostVainArrays = 2;
constexpr std::chrono::seconds kVainPause{60};
constexpr std::uint64_t kMostPilotLog = 1 << 20;

/// The last line of a pilot's log, or why there is none.
std::string last_words(const std::string& log) {
  const Result<std::string> text = read_text_file(log, kMostPilotLog);
  if (!text) return text.error().message + ": do the nodes have this folder?";
  const std::size_t end = text->find_last_not_of('\n');
  if (end == text->npos) return log + ": empty";
  const std::size_t begin = text->find_last_of('\n', end) + 1;
  return fmt::format("{}: {}", log, text->substr(begin, end + 1 - begin));
}

}  // namespace

Result<std::vector<SlurmPilot>> find_pilots(const std::string& job_name) {
  BATON_ASSIGN(const std::string text, run_captured(squeue_command(job_name), kSlurmPatience));
  return parse_squeue(text);
}

Status SlurmFarm::prepare() const {
  BATON_TRY(check_log(options_.pilot));
  return write_file_atomic(options_.script, as_bytes_view(pilot_script(options_.pilot)));
}

void SlurmFarm::tend(RequestClient& client) {
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  next_ = now + options_.poll;
  const Result<JobList> list = ask<JobList>(client, ListJobs{}, kAnswerPatience);
  if (!list) return warn(list.error().message);
  Result<std::vector<SlurmPilot>> pilots = find_pilots(options_.pilot.job_name);
  if (!pilots) return warn(pilots.error().message);
  last_warning_.clear();
  warn_of_short_time(*list);
  const SlurmSnapshot seen = observe(*list, std::move(pilots).value(), now);
  warn_of_vain_arrays(seen);
  carry_out(give_orders(seen), client);
}

SlurmSnapshot SlurmFarm::observe(const JobList& list, std::vector<SlurmPilot> pilots,
                                 Clock::time_point now) {
  SlurmSnapshot seen;
  seen.least = options_.nodes.least;
  seen.most = options_.nodes.most;
  std::set<std::string> ids, names;
  for (const WorkerSummary& worker : list.workers) {
    const std::optional<std::string> id = pilot_of_worker(worker.worker_id);
    if (!id) continue;
    ids.insert(*id);
    names.insert(worker.worker_id);
    threads_per_pilot_ = worker.num_threads;
    seen.workers.push_back({*id, worker.worker_id, static_cast<std::int32_t>(worker.tasks.size()),
                            told_to_end_.contains(worker.worker_id)});
  }
  std::erase_if(told_to_end_, [&](const std::string& name) { return !names.contains(name); });
  seen.threads_per_pilot = threads_per_pilot_;

  // The most work of the last looks: a short lull sends nobody home.
  std::uint64_t tasks = list.tasks_ready;
  for (const ListedJob& job : list.jobs) tasks += job.summary.tasks_leased;
  tasks_.push_back(tasks);
  if (tasks_.size() > kLooksBeforeShrinking) tasks_.pop_front();
  seen.tasks = *std::max_element(tasks_.begin(), tasks_.end());

  // How long the pilots without a worker have been so.
  std::map<std::string, Clock::time_point> alone;
  for (SlurmPilot& pilot : pilots) {
    if (pilot.state != SlurmState::running || ids.contains(pilot.id)) continue;
    const auto before = alone_since_.find(pilot.id);
    const Clock::time_point since = before == alone_since_.end() ? now : before->second;
    alone.emplace(pilot.id, since);
    pilot.alone_s = std::chrono::duration<double>(now - since).count();
  }
  alone_since_ = std::move(alone);
  seen.pilots = std::move(pilots);
  return seen;
}

void SlurmFarm::carry_out(const SlurmOrders& orders, RequestClient& client) {
  if (!orders.cancel.empty()) {
    std::vector<std::string> command{"scancel"};
    command.insert(command.end(), orders.cancel.begin(), orders.cancel.end());
    spdlog::info("pilots are cancelled: {}", fmt::join(orders.cancel, " "));
    vain_.cancelled(orders.cancel);
    if (const auto done = run_captured(command, kSlurmPatience); !done) warn(done.error().message);
  }
  for (const std::string& worker : orders.drain) {
    spdlog::info("worker {} is sent home", worker);
    const Result<JobList> told = ask<JobList>(client, OrderWorker{worker}, kAnswerPatience);
    if (!told) {
      warn(told.error().message);
    } else {
      told_to_end_.insert(worker);
    }
  }
  const bool in_vain = vain_.count() >= kMostVainArrays;
  if (orders.submit > 0 && (!in_vain || Clock::now() - submitted_ > kVainPause))
    submit(orders.submit);
}

void SlurmFarm::submit(int count) {
  const Result<std::string> answer =
      run_captured(sbatch_command(options_.pilot, count, options_.script.string()), kSlurmPatience);
  if (!answer) return warn(answer.error().message);
  const std::string array = answer->substr(0, answer->find_first_of(";\n"));
  spdlog::info("{} pilots are submitted, array {}", count, array);
  vain_.submitted(array);
  submitted_ = Clock::now();
}

void SlurmFarm::warn_of_vain_arrays(const SlurmSnapshot& now) {
  if (!vain_.observe(now) || vain_.count() < kMostVainArrays) return;
  std::string log = options_.pilot.script_log;
  log.replace(log.rfind("%A_%a"), 5, vain_.last() + "_1");
  spdlog::warn(
      "no pilot of the last {} arrays has reached the coordinator; others are submitted "
      "every {} s; {}",
      vain_.count(), kVainPause.count(), last_words(log));
}

void SlurmFarm::warn_of_short_time(const JobList& list) {
  const double time = static_cast<double>(options_.pilot.time_s);
  if (told_short_time_ || time == 0 || 1.5 * list.task_seconds < time) return;
  told_short_time_ = true;
  spdlog::warn("tasks take up to {:.0f} s: pilots of --time {} have no room for them",
               list.task_seconds, options_.pilot.time);
}

/// The same thing in a row is said once.
void SlurmFarm::warn(const std::string& text) {
  if (text != last_warning_) spdlog::warn("{}; tried again", text);
  last_warning_ = text;
}

void SlurmFarm::cancel_all() {
  const auto done = run_captured({"scancel", "--name=" + options_.pilot.job_name}, kSlurmPatience);
  if (!done) spdlog::warn("pilots are left to end by themselves: {}", done.error().message);
}

}  // namespace baton
