#include "jobs/cli/farm/job_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/limits.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/events_text.h"
#include "jobs/cli/farm/worker_log_reader.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

constexpr std::chrono::milliseconds kFollowInterval{500};

struct LogOptions {
  CoordinatorLink link;
  std::string job;
  std::string folder;  ///< empty: as the coordinator has it
  std::size_t count = 200;
  bool follow = false, json = false;
};

/// A line of either kind.
struct LogEntry {
  std::int64_t time_ms = 0;
  std::string text;
};

std::vector<LogEntry> entries_of(const std::vector<FarmEvent>& events,
                                 const std::vector<WorkerLogLine>& lines, bool json) {
  std::vector<LogEntry> entries;
  for (const FarmEvent& event : events)
    entries.push_back({event.time_ms, json ? json_text(event_json(event)) : event_line(event)});
  for (const WorkerLogLine& line : lines) {
    entries.push_back({line.time_ms, json ? json_text({{"time", utc_iso(line.time_ms)},
                                                       {"worker", line.worker},
                                                       {"level", line.level},
                                                       {"text", line.text}})
                                          : fmt::format("{}  {}  {}: {}", utc_text(line.time_ms),
                                                        line.worker, line.level, line.text)});
  }
  std::ranges::stable_sort(entries, {}, &LogEntry::time_ms);
  return entries;
}

void print_entries(const std::vector<LogEntry>& entries, bool json) {
  for (const LogEntry& entry : entries) {
    if (json) fmt::print("{}\n", entry.text);
    if (!json) say("{}\n", entry.text);
  }
  std::fflush(stdout);
}

/// What happened to a job, and what its workers said of it.
Result<ExitCode> show_log(const LogOptions& options) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const ShownJob job, ask<ShownJob>(client, ShowJob{options.job}));
  ListEvents question{job.identity.id.hex(), {.count = limits::kMaxEventsTold}};
  BATON_ASSIGN(EventList found, ask<EventList>(client, question));
  const std::string folder = options.folder.empty() ? found.logs : options.folder;
  WorkerLogReader logs(folder, job.identity.id);
  if (!logs.is_there())
    tell("{}: not seen from here, so only the events are shown; --logs FOLDER says where it is\n",
         folder);
  std::vector<LogEntry> entries = entries_of(found.events, logs.read(), options.json);
  if (entries.size() > options.count) {
    entries.erase(entries.begin(), entries.end() - static_cast<std::ptrdiff_t>(options.count));
    tell("these are the newest {}; --last N shows more\n", options.count);
  }
  print_entries(entries, options.json);
  question.query.is_newest = false;
  while (options.follow) {
    if (!found.events.empty()) question.query.after_sequence = found.events.back().sequence;
    std::this_thread::sleep_for(kFollowInterval);
    BATON_ASSIGN(found, ask<EventList>(client, question));
    print_entries(entries_of(found.events, logs.read(), options.json), options.json);
  }
  return ExitCode::ok;
}

}  // namespace

void add_logs_option(CLI::App& command, std::string& folder) {
  command.add_option(
      "--logs", folder,
      "the workers' logs, where the coordinator's work folder has another path here");
}

void add_job_log(CLI::App& job, ExitCode& code) {
  auto options = std::make_shared<LogOptions>();
  CLI::App* log = job.add_subcommand(
      "log", "What happened to a job, and what its workers said of it, in the order of time");
  log->add_option("ID", options->job, kJobHelp)->required();
  log->add_flag("-f,--follow", options->follow, "goes on with what comes");
  log->add_option("--last", options->count, "at most so many lines, the newest")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  add_logs_option(*log, options->folder);
  add_coordinator_options(*log, options->link);
  log->add_flag("--json", options->json, "an object a line, for machines");
  log->footer(
      "Examples:\n"
      "  baton job log shot7 -f\n"
      "  baton job log 3f2a --last 20 --coordinator tcp://farm:5570");
  log->callback([options, &code] { code = finish_with_coordinator(show_log(*options)); });
}

}  // namespace baton
