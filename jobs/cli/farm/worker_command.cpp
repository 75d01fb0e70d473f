#include <fmt/format.h>

#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/job_questions.h"
#include "jobs/cli/farm/worker_text.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

struct WorkerCommandOptions {
  CoordinatorLink link;
  std::string worker_id;
  bool json = false, off = false;
};

void print_workers(const JobList& found, bool json) {
  if (json) {
    ordered_json list = ordered_json::array();
    for (const WorkerSummary& worker : found.workers) list.push_back(worker_json(worker));
    for (const auto* const absent : {&found.turned_away, &found.lost}) {
      for (const AbsentWorker& worker : *absent) list.push_back(absent_json(worker));
    }
    return fmt::print("{}\n", json_text(list, 2));
  }
  for (const WorkerSummary& worker : found.workers) say("{}\n", worker_lines(worker));
  for (const auto* const absent : {&found.turned_away, &found.lost}) {
    for (const AbsentWorker& worker : *absent) say("{}\n", absent_line(worker));
  }
  say("{} workers{}\n", found.workers.size(), absent_counts(found));
}

/// question: ListJobs or OrderWorker.
Result<ExitCode> ask_for_workers(const WorkerCommandOptions& options, const Message& question) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const JobList found, ask<JobList>(client, question));
  print_workers(found, options.json);
  return ExitCode::ok;
}

}  // namespace

void add_worker_command(CLI::App& app, ExitCode& code) {
  CLI::App* worker = app.add_subcommand("worker", "Looks after the workers of a coordinator");
  worker->require_subcommand(1);
  worker->footer(
      "Examples:\n"
      "  baton worker list --coordinator tcp://farm:5570\n"
      "  baton worker hold node7-1234         somebody needs its machine for an hour\n"
      "  baton worker hold node7-1234 --off\n"
      "  baton worker drain node7-1234        before its machine goes down");

  // No two commands share an option: see add_job_command().
  const auto add = [&](const char* name, const char* what, auto question) {
    CLI::App* command = worker->add_subcommand(name, what);
    auto options = std::make_shared<WorkerCommandOptions>();
    add_coordinator_options(*command, options->link);
    command->add_flag("--json", options->json, "for machines");
    command->callback([options, question, &code] {
      code = finish_with_coordinator(ask_for_workers(*options, question(*options)));
    });
    return std::pair(command, options.get());
  };
  add_worker_questions(*worker, code);
  add("list",
      "Connected workers: what each does, for how long; those turned away, or lost, in a day",
      [](const WorkerCommandOptions&) { return ListJobs{}; });
  const auto [drain, drained] =
      add("drain", "Lets a worker finish what it renders, then end; its other tasks go to others",
          [](const WorkerCommandOptions& options) { return OrderWorker{options.worker_id}; });
  drain->add_option("NAME", drained->worker_id, "as listed")->required();
  const auto [hold, held] =
      add("hold", "Lets a worker finish what it has, and gives it nothing new; it stays connected",
          [](const WorkerCommandOptions& options) {
            return OrderWorker{options.worker_id,
                               options.off ? WorkerOrder::release : WorkerOrder::hold};
          });
  hold->add_option("NAME", held->worker_id, "as listed")->required();
  hold->add_flag("--off", held->off, "gives it tasks again");
}

}  // namespace baton
