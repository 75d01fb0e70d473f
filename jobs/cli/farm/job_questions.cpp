#include "jobs/cli/farm/job_questions.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "common/base/legible.h"
#include "common/base/limits.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/worker_text.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

struct WhyOptions {
  CoordinatorLink link;
  std::string job, worker;
  std::optional<int> frame, tile;
  bool json = false;
};

Result<ExitCode> why(const WhyOptions& options) {
  if (options.tile && !options.frame)
    return Error{ErrorKind::usage, "--tile: expected --frame, too: of which frame?"};
  BATON_ASSIGN(RequestClient client, options.link.connect());
  const AskWhy question{options.job, options.worker, options.frame.has_value(),
                        FrameNumber(options.frame.value_or(0)), options.tile.value_or(-1)};
  BATON_ASSIGN(const ReasonChain chain, ask<ReasonChain>(client, question));
  if (options.json) {
    ordered_json rows = ordered_json::array();
    for (const Reason& reason : chain.reasons) rows.push_back(reason_json(reason));
    fmt::print("{}\n", json_text(rows, 2));
    return ExitCode::ok;
  }
  bool follows = false;
  for (const Reason& reason : chain.reasons) {
    // Whoever has a task may say nothing any more.
    follows = follows || (reason.kind == ReasonKind::silent && &reason != &chain.reasons.front());
    say("{}{}\n", follows ? "  <- " : "", reason_line(reason));
    follows = !is_last(reason.kind);
  }
  return ExitCode::ok;
}

struct TasksOptions {
  CoordinatorLink link;
  std::string job;  ///< empty: all
  bool running = false, slow = false, failed = false, json = false;
};

/// It takes half as long again as is usual, and longer by twice the spread, and by a second.
bool is_slow(const ListedTask& task) {
  const UsualTime& usual = task.usual;
  return !task.has_failed && usual.count >= 3 &&
         task.seconds > usual.median_s + std::max({usual.median_s / 2, 2 * usual.spread_s, 1.0});
}

std::string task_line(const ListedTask& task) {
  const std::string place = task.has_task ? place_text(task.task) : "a task of an earlier version";
  if (task.has_failed)
    return fmt::format("job {}  failed     {}, attempt {}  on {}, {}: {}", task.job.short_hex(),
                       place, task.task.attempt, task.worker, utc_text(task.time_ms), task.message);
  return fmt::format("job {}  {:<9}  {}, attempt {}  on {} for {}{}", task.job.short_hex(),
                     is_slow(task) ? "slow" : "running", place, task.task.attempt, task.worker,
                     task_time_text(task.seconds), usual_text(task.usual));
}

ordered_json task_json(const ListedTask& task) {
  ordered_json row = {{"job", task.job.hex()},
                      {"status", task.has_failed ? "failed" : "running"},
                      {"slow", is_slow(task)},
                      {"worker", task.worker}};
  if (task.has_task) row.update(place_json(task.task));
  if (task.has_failed) {
    row["failed"] = utc_json(task.time_ms);
    row["seconds"] = task.seconds;
    row["message"] = task.message;
  } else {
    row["seconds"] = task.seconds;
    add_usual(task.usual, row);
  }
  return row;
}

Result<ExitCode> show_tasks(const TasksOptions& options) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(TaskList found, ask<TaskList>(client, ListTasks{options.job}));
  const bool all = !options.running && !options.slow && !options.failed;
  std::erase_if(found.tasks, [&](const ListedTask& task) {
    const bool wanted = all || (options.running && !task.has_failed) ||
                        (options.slow && is_slow(task)) || (options.failed && task.has_failed);
    return !wanted;
  });
  if (options.json) {
    ordered_json rows = ordered_json::array();
    for (const ListedTask& task : found.tasks) rows.push_back(task_json(task));
    fmt::print("{}\n", json_text(rows, 2));
    return ExitCode::ok;
  }
  // Failures that say the same are told once, in the place of the last.
  using Failed = std::tuple<JobId, std::string, std::string>;
  const auto failed_of = [](const ListedTask& task) {
    return Failed(task.job, task.worker, first_line(task.message));
  };
  std::map<Failed, std::size_t> alike, still;
  for (const ListedTask& task : found.tasks) alike[failed_of(task)] += task.has_failed ? 1 : 0;
  still = alike;
  for (const ListedTask& task : found.tasks) {
    if (task.has_failed && --still[failed_of(task)] > 0) continue;
    say("{}\n", task_line(task));
    if (const std::size_t count = alike[failed_of(task)]; task.has_failed && count > 1)
      say("  {} attempts failed so, this is the last\n", count);
  }
  say("{} tasks{}\n", found.tasks.size(),
      options.job.empty() ? " of jobs that have not ended" : "");
  return ExitCode::ok;
}

struct SetOptions {
  CoordinatorLink link;
  std::string job;
  std::vector<std::string> settings;
  bool json = false;
};

/// "priority=80".
Result<std::int32_t> parse_priority(const std::string& text) {
  constexpr std::string_view kName = "priority=";
  std::int32_t value = 0;
  const char* const end = text.data() + text.size();
  const bool is_named = text.starts_with(kName);
  const auto [rest, fault] =
      std::from_chars(text.data() + (is_named ? kName.size() : text.size()), end, value);
  if (!is_named || fault != std::errc() || rest != end || value < 0 || value > limits::kMaxPriority)
    return Error{ErrorKind::usage, fmt::format("{}: expected priority=N, N from 0 to {}", text,
                                               limits::kMaxPriority)};
  return value;
}

Result<ExitCode> set(const SetOptions& options) {
  std::int32_t priority = 0;
  for (const std::string& setting : options.settings) {
    BATON_ASSIGN(priority, parse_priority(setting));
  }
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const ShownJob job,
               ask_until_done<ShownJob>(client, SetPriority{options.job, priority}));
  if (options.json) {
    fmt::print("{}\n", json_text(detail_json(job), 2));
  } else {
    say("{}\n", long_job_line({job.identity, job.detail.summary, job.now}));
  }
  return ExitCode::ok;
}

}  // namespace

void add_job_questions(CLI::App& job, ExitCode& code) {
  auto question = std::make_shared<WhyOptions>();
  CLI::App* why_job =
      job.add_subcommand("why", "Why a job, a frame or a tile is not done: the chain of causes");
  why_job->add_option("ID", question->job, kJobHelp)->required();
  why_job->add_option("--frame", question->frame, "default: the first that is not written");
  why_job->add_option("--tile", question->tile, "of that frame, from 0")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  add_coordinator_options(*why_job, question->link);
  why_job->add_flag("--json", question->json, "an array of causes, the last one last");
  why_job->footer(
      "Examples:\n"
      "  baton job why shot7\n"
      "  baton job why 3f2a --frame 13 --tile 7 --coordinator tcp://farm:5570");
  why_job->callback([question, &code] { code = finish_with_coordinator(why(*question)); });

  auto tasks = std::make_shared<TasksOptions>();
  CLI::App* show = job.add_subcommand(
      "tasks", "Tasks that workers have now, and attempts that have failed (at most 100 a job)");
  show->add_option("ID", tasks->job, std::string(kJobHelp) + "; default: all that have not ended");
  show->add_flag("--running", tasks->running, "those that a worker has");
  show->add_flag("--slow", tasks->slow, "of them, those that take half as long again as is usual");
  show->add_flag("--failed", tasks->failed, "attempts that have failed, and why");
  add_coordinator_options(*show, tasks->link);
  show->add_flag("--json", tasks->json, "for machines");
  show->footer(
      "Examples:\n"
      "  baton job tasks\n"
      "  baton job tasks shot7 --slow --failed");
  show->callback([tasks, &code] { code = finish_with_coordinator(show_tasks(*tasks)); });

  auto change = std::make_shared<SetOptions>();
  CLI::App* sets = job.add_subcommand(
      "set", "Changes the place of an open job in the queue; its ID and version stay");
  sets->add_option("ID", change->job, kJobHelp)->required();
  sets->add_option("SETTING", change->settings,
                   fmt::format("priority=N, 0 to {}, higher comes first", limits::kMaxPriority))
      ->required();
  add_coordinator_options(*sets, change->link);
  sets->add_flag("--json", change->json, "for machines");
  sets->footer("Example: baton job set 3f2a priority=90");
  sets->callback([change, &code] { code = finish_with_coordinator(set(*change)); });
}

void add_worker_questions(CLI::App& worker, ExitCode& code) {
  auto question = std::make_shared<WhyOptions>();
  CLI::App* why_worker = worker.add_subcommand("why", "What a worker does, or why it does nothing");
  why_worker->add_option("NAME", question->worker, "as listed")->required();
  add_coordinator_options(*why_worker, question->link);
  why_worker->add_flag("--json", question->json, "an array of causes");
  why_worker->footer("Example: baton worker why node7-1234");
  why_worker->callback([question, &code] { code = finish_with_coordinator(why(*question)); });
}

}  // namespace baton
