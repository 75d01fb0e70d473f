#include <fmt/format.h>

#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/job_summary.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

struct WorkerCommandOptions {
  CoordinatorLink link;
  std::string worker_id;
  bool json = false;
};

void print_workers(const std::vector<WorkerSummary>& workers, bool json) {
  if (json) {
    ordered_json list = ordered_json::array();
    for (const WorkerSummary& worker : workers) list.push_back(worker_json(worker));
    return fmt::print("{}\n", list.dump(2));
  }
  for (const WorkerSummary& worker : workers) fmt::print("{}\n", worker_line(worker));
  fmt::print("{} workers\n", workers.size());
}

/// question: ListJobs or DrainWorker.
Result<ExitCode> ask_for_workers(const WorkerCommandOptions& options, const Message& question) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const JobList found, ask<JobList>(client, question));
  print_workers(found.workers, options.json);
  return ExitCode::ok;
}

}  // namespace

void add_worker_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<WorkerCommandOptions>();
  CLI::App* worker = app.add_subcommand("worker", "Looks after the workers of a coordinator");
  worker->require_subcommand(1);
  worker->footer(
      "Examples:\n"
      "  baton worker list --coordinator tcp://farm:5570\n"
      "  baton worker drain node7-1234        before its machine goes down");

  CLI::App* list = worker->add_subcommand("list", "All connected workers and what they hold");
  CLI::App* drain = worker->add_subcommand(
      "drain", "Lets a worker finish what it renders, then end; its other tasks go to others");
  drain->add_option("NAME", options->worker_id, "as listed")->required();
  for (CLI::App* command : {list, drain}) {
    add_coordinator_options(*command, options->link);
    command->add_flag("--json", options->json, "for machines");
  }
  list->callback(
      [options, &code] { code = finish_with_coordinator(ask_for_workers(*options, ListJobs{})); });
  drain->callback([options, &code] {
    code = finish_with_coordinator(ask_for_workers(*options, DrainWorker{options->worker_id}));
  });
}

}  // namespace baton
