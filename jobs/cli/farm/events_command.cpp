#include "jobs/cli/farm/events_command.h"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "common/base/limits.h"
#include "common/base/utc.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/events_text.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

constexpr std::chrono::milliseconds kFollowInterval{500};

struct EventsOptions {
  CoordinatorLink link;
  std::string job;    ///< name, ID or its beginning; empty: of all
  std::string since;  ///< empty: since ever
  int count = 100;
  bool follow = false, json = false;
};

void print_events(const std::vector<FarmEvent>& events, bool json) {
  for (const FarmEvent& event : events) {
    if (json) fmt::print("{}\n", json_text(event_json(event)));
    if (!json) say("{}\n", event_line(event));
  }
  std::fflush(stdout);
}

/// What the job has from before its oldest event that is still there.
void print_forgotten(const std::vector<ForgottenEvents>& forgotten, bool json) {
  for (const ForgottenEvents& sum : forgotten) {
    if (json) {
      fmt::print("{}\n", json_text({{"kind", farm_event_name(sum.kind)},
                                    {"forgotten", sum.count},
                                    {"seconds", sum.seconds}}));
    } else {
      say("before              {:<19}  {} times{}\n", farm_event_name(sum.kind), sum.count,
          sum.seconds > 0 ? fmt::format(", {:.1f} s together", sum.seconds) : "");
    }
  }
}

/// What has happened, and with --follow what happens until the coordinator ends.
Result<ExitCode> show_events(const EventsOptions& options) {
  ListEvents question{options.job, {.count = options.count}};
  if (!options.since.empty()) {
    BATON_ASSIGN(question.query.since_ms, parse_since(options.since, now_ms()));
  }
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(EventList found, ask<EventList>(client, question));
  print_forgotten(found.forgotten, options.json);
  print_events(found.events, options.json);
  if (std::ssize(found.events) >= options.count)
    tell("these are the newest {}; --last N shows more\n", options.count);
  question.query.is_newest = false;
  question.query.count = limits::kMaxEventsTold;
  while (options.follow) {
    if (!found.events.empty()) question.query.after_sequence = found.events.back().sequence;
    std::this_thread::sleep_for(kFollowInterval);
    BATON_ASSIGN(found, ask<EventList>(client, question));
    print_events(found.events, options.json);
  }
  return ExitCode::ok;
}

}  // namespace

void add_events_command(CLI::App& farm, ExitCode& code) {
  auto options = std::make_shared<EventsOptions>();
  CLI::App* events = farm.add_subcommand(
      "events", "What has happened: jobs, tasks, workers, with time, cause and duration");
  add_coordinator_options(*events, options->link);
  events->add_option(
      "--job", options->job,
      "of this job alone: its name, its ID, or its beginning; all of the ID of one that "
      "was deleted");
  events->add_option("--since", options->since,
                     "30s, 15m, 2h or 3d ago, or a time in UTC: 2026-11-28T13:20:46");
  events->add_option("--last", options->count, "at most so many, the newest")
      ->check(CLI::Range(1, limits::kMaxEventsTold))
      ->capture_default_str();
  events->add_flag("--follow", options->follow, "goes on with what happens");
  events->add_flag("--json", options->json, "an object a line, for machines");
  events->footer(
      "Examples:\n"
      "  baton farm events --since 2h --coordinator tcp://farm:5570\n"
      "  baton farm events --job shot7 --follow");
  events->callback([options, &code] { code = finish_with_coordinator(show_events(*options)); });
}

}  // namespace baton
