#include "jobs/cli/farm/farm_status.h"

#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <map>

#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/slurm_farm.h"
#include "jobs/cli/farm/worker_text.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

struct StatusOptions {
  CoordinatorLink link;
  bool json = false, yes = false;
};

/// Pilots of Slurm beside their workers, which may be missing, and workers that have no pilot.
struct Crews {
  struct Pilot {
    SlurmPilot pilot;
    std::vector<WorkerSummary> workers;
  };
  std::vector<Pilot> pilots;
  std::multimap<std::string, WorkerSummary> unknown_pilots;  ///< by pilot: not in the queue
  std::vector<WorkerSummary> others;
  std::string silence;  ///< why Slurm says nothing; empty: it does
};

Crews find_crews(const std::vector<WorkerSummary>& workers) {
  Crews crews;
  for (const WorkerSummary& worker : workers) {
    if (const auto pilot = pilot_of_worker(worker.worker_id)) {
      crews.unknown_pilots.emplace(*pilot, worker);
    } else {
      crews.others.push_back(worker);
    }
  }
  const Result<std::vector<SlurmPilot>> pilots = find_pilots("");
  if (!pilots) crews.silence = pilots.error().message;
  for (const SlurmPilot& pilot : pilots ? *pilots : std::vector<SlurmPilot>()) {
    if (!pilot.job_name.starts_with(kJobNamePrefix)) continue;
    Crews::Pilot& crew = crews.pilots.emplace_back(Crews::Pilot{pilot, {}});
    const auto [first, last] = crews.unknown_pilots.equal_range(pilot.id);
    for (auto worker = first; worker != last; ++worker) crew.workers.push_back(worker->second);
    crews.unknown_pilots.erase(first, last);
  }
  return crews;
}

void print_status(const JobList& list, const Crews& crews) {
  for (const ListedJob& job : list.jobs) say("{}\n", job_line(job));
  say("{} jobs, {} tasks are ready\n\n", list.jobs.size(), list.tasks_ready);
  if (!crews.silence.empty()) say("no word from Slurm: {}\n", crews.silence);
  for (const auto& [pilot, workers] : crews.pilots) {
    const auto print = [&pilot = pilot](const std::string& worker) {
      say("pilot {:<10} {:<10} {:<10} {:>10} left  {}\n", pilot.id, pilot.state_text,
          pilot.node.empty() ? pilot.reason : pilot.node, pilot.time_left, worker);
    };
    if (workers.empty()) print("no worker");
    for (const WorkerSummary& worker : workers) print(worker_lines(worker));
  }
  for (const auto& [id, worker] : crews.unknown_pilots)
    say("pilot {:<10} {:<10} {:<10} {:>10}       {}\n", id, "", "not in the queue", "",
        worker_lines(worker));
  for (const WorkerSummary& worker : crews.others) say("{}\n", worker_lines(worker));
  say("{} pilots, {} workers{}\n", crews.pilots.size(), list.workers.size(), absent_counts(list));
}

ordered_json status_json(const JobList& list, const Crews& crews) {
  ordered_json result = {
      {"jobs", ordered_json::array()},
      {"jobsEnded", list.num_ended},
      {"tasksReady", list.tasks_ready},
      {"workers", ordered_json::array()},
      {"turnedAway", absent_json(list.turned_away)},
      {"lost", absent_json(list.lost)},
      {"pilots", ordered_json::array()},
      {"slurm", crews.silence.empty() ? ordered_json() : ordered_json(crews.silence)}};
  for (const ListedJob& job : list.jobs) result["jobs"].push_back(summary_json(job));
  for (const WorkerSummary& worker : list.workers) result["workers"].push_back(worker_json(worker));
  for (const auto& [pilot, workers] : crews.pilots) {
    ordered_json row = {{"id", pilot.id},
                        {"name", pilot.job_name},
                        {"status", pilot.state_text},
                        {"reason", pilot.reason},
                        {"node", pilot.node},
                        {"timeLeft", pilot.time_left},
                        {"workers", ordered_json::array()}};
    for (const WorkerSummary& worker : workers) row["workers"].push_back(worker.worker_id);
    result["pilots"].push_back(std::move(row));
  }
  return result;
}

Result<ExitCode> show_status(const StatusOptions& options) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const JobList list, ask<JobList>(client, ListJobs{}));
  const Crews crews = find_crews(list.workers);
  if (options.json) {
    fmt::print("{}\n", json_text(status_json(list, crews), 2));
  } else {
    print_status(list, crews);
  }
  return ExitCode::ok;
}

/// Whether the person at the terminal agrees. usage: there is none, and nobody said --yes.
Result<bool> confirm(const std::string& question) {
  if (::isatty(STDIN_FILENO) == 0)
    return Error{ErrorKind::usage, question + ": not a terminal: say --yes"};
  tell("{}? [y/N] ", question);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "yes";
}

Result<ExitCode> stop(const StatusOptions& options) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const JobList list, ask<JobList>(client, ListJobs{}));
  const std::string what =
      fmt::format("stop the coordinator at {}, with {} workers and {} jobs", options.link.endpoint,
                  list.workers.size(), list.jobs.size());
  if (!options.yes) {
    BATON_ASSIGN(const bool agreed, confirm(what));
    if (!agreed) return ExitCode::cancelled;
  }
  BATON_TRY(ask<Shutdown>(client, StopCoordinator{}));
  if (options.json) {
    fmt::print("{}\n", json_text({{"stopped", options.link.endpoint},
                                  {"workers", list.workers.size()},
                                  {"openJobs", list.jobs.size()}},
                                 2));
    return ExitCode::ok;
  }
  say("the coordinator ends, and its {} workers with it; {} jobs go on when it is started "
      "again\n",
      list.workers.size(), list.jobs.size());
  return ExitCode::ok;
}

}  // namespace

void add_status_commands(CLI::App& farm, ExitCode& code) {
  auto shown = std::make_shared<StatusOptions>();
  CLI::App* status =
      farm.add_subcommand("status", "Jobs, pilots of Slurm beside their workers, other workers");
  add_coordinator_options(*status, shown->link);
  status->add_flag("--json", shown->json, "for machines");
  status->footer("Example: baton farm status --json --coordinator tcp://farm:5570");
  status->callback([shown, &code] { code = finish_with_coordinator(show_status(*shown)); });

  auto stopped = std::make_shared<StatusOptions>();
  CLI::App* stops = farm.add_subcommand(
      "stop", "Ends the coordinator and its workers; finished work stays, open jobs go on later");
  add_coordinator_options(*stops, stopped->link);
  stops->add_flag("--yes", stopped->yes, "asks nothing; needed where there is no terminal");
  stops->add_flag("--json", stopped->json, "for machines");
  stops->footer("Example: baton farm stop --yes --key keys/admin.key");
  stops->callback([stopped, &code] { code = finish_with_coordinator(stop(*stopped)); });
}

}  // namespace baton
