#include "jobs/cli/farm/job_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "common/base/utc.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/worker_text.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

struct ListOptions {
  CoordinatorLink link;
  bool all = false, is_long = false, json = false;
  std::string owner, activity, since, sort = "submitted";
};

using Less = std::function<bool(const ListedJob&, const ListedJob&)>;

template <class F>
Less by(F value) {
  return [value](const ListedJob& a, const ListedJob& b) { return value(a) < value(b); };
}

/// The orders of --sort.
const std::map<std::string, Less>& orders() {
  static const std::map<std::string, Less> all{
      {"submitted", by([](const ListedJob& j) { return j.identity.times.submitted_ms; })},
      {"started", by([](const ListedJob& j) { return j.identity.times.started_ms; })},
      {"ended", by([](const ListedJob& j) { return j.identity.times.ended_ms; })},
      {"name", by([](const ListedJob& j) { return j.summary.name; })},
      {"owner", by([](const ListedJob& j) { return j.summary.owner; })},
      {"priority", by([](const ListedJob& j) { return -j.summary.priority; })},
      {"status", by([](const ListedJob& j) { return j.now.activity; })}};
  return all;
}

std::vector<std::string> activities() {
  std::vector<std::string> names;
  for (int i = 0; i <= static_cast<int>(last_of(JobActivity{})); ++i)
    names.emplace_back(job_activity_name(static_cast<JobActivity>(i)));
  return names;
}

/// Which of the jobs are wanted, in which order.
std::vector<ListedJob> chosen(const ListOptions& options, std::int64_t since_ms,
                              std::vector<ListedJob> jobs) {
  std::erase_if(jobs, [&](const ListedJob& job) {
    return (!options.owner.empty() && job.summary.owner != options.owner) ||
           (!options.activity.empty() && job_activity_name(job.now.activity) != options.activity) ||
           (job.identity.times.ended_ms != 0 && job.identity.times.ended_ms < since_ms);
  });
  std::ranges::stable_sort(jobs, orders().at(options.sort));
  return jobs;
}

Result<ExitCode> list(const ListOptions& options) {
  std::int64_t since_ms = 0;
  if (!options.since.empty()) {
    BATON_ASSIGN(since_ms, parse_since(options.since, now_ms()));
  }
  BATON_ASSIGN(RequestClient client, options.link.connect());
  const bool asks_for_ended =
      options.activity == "done" || options.activity == "failed" || options.activity == "cancelled";
  const bool all = options.all || asks_for_ended;
  BATON_ASSIGN(const JobList found, ask<JobList>(client, ListJobs{all}));
  const std::vector<ListedJob> jobs = chosen(options, since_ms, found.jobs);
  if (!options.json) {
    for (const ListedJob& job : jobs)
      say("{}\n", options.is_long ? long_job_line(job) : job_line(job));
    say("{} jobs, {} workers", jobs.size(), found.workers.size());
    if (!all && found.num_ended > 0) say("; --all shows {} that have ended", found.num_ended);
    say("\n");
    return ExitCode::ok;
  }
  ordered_json result = {{"jobs", ordered_json::array()}, {"workers", ordered_json::array()}};
  for (const ListedJob& job : jobs) result["jobs"].push_back(summary_json(job));
  for (const WorkerSummary& worker : found.workers)
    result["workers"].push_back(worker_json(worker));
  fmt::print("{}\n", json_text(result, 2));
  return ExitCode::ok;
}

}  // namespace

void add_list_command(CLI::App& job, ExitCode& code) {
  auto options = std::make_shared<ListOptions>();
  CLI::App* lists = job.add_subcommand(
      "list", "The jobs that have not ended: what each does, how far it is, for what it waits");
  add_coordinator_options(*lists, options->link);
  lists->add_flag("--all", options->all, "also those that have ended");
  lists->add_flag("-l,--long", options->is_long, "with owner, priority and times (UTC)");
  lists->add_option("--owner", options->owner, "of this key alone");
  lists->add_option("--status", options->activity, "only those that are so")
      ->check(CLI::IsMember(activities()));
  lists->add_option("--since", options->since,
                    "open, or ended 30s, 15m, 2h or 3d ago, or at a time in UTC, or later");
  std::vector<std::string> keys;
  for (const auto& [key, order] : orders()) keys.push_back(key);
  lists->add_option("--sort", options->sort, "by what; priority: the highest first")
      ->check(CLI::IsMember(keys))
      ->capture_default_str();
  lists->add_flag("--json", options->json, "for machines");
  lists->footer(
      "Examples:\n"
      "  baton job list -l --owner anna --sort priority\n"
      "  baton job list --status failed --since 1d");
  lists->callback([options, &code] { code = finish_with_coordinator(list(*options)); });
}

}  // namespace baton
