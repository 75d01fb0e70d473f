#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <functional>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/protocol/keys.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/events_command.h"
#include "jobs/cli/farm/farm_status.h"
#include "jobs/cli/farm/slurm_farm.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/render/render_session.h"
#include "jobs/cli/say.h"
#include "jobs/cli/settle_method.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct FarmCommandOptions {
  RenderOptions render;
  std::string nodes = "1", partition, time;
  std::vector<std::string> sbatch_arguments, worker_arguments;
  std::string coordinator, key, worker_key;  ///< a coordinator that is there
  std::string listen = "tcp://*:*", host;    ///< a coordinator that is started
  std::int64_t idle_exit_s = 300, drain_s = 20;
  double poll_s = 10;
};

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "localhost";
}

/// "tcp://*:5570" or "tcp://0.0.0.0:5570" as `host` is reached.
std::string endpoint_at(const std::string& endpoint, const std::string& host) {
  return fmt::format("tcp://{}:{}", host, endpoint.substr(endpoint.rfind(':') + 1));
}

/// A farm and how to speak to it.
struct OpenFarm {
  LocalFarm farm;
  CoordinatorLink link;
  std::string worker_key, pilot_endpoint;
};

Result<OpenFarm> attach(const FarmCommandOptions& options) {
  if (options.key.empty() != options.worker_key.empty()) {
    return Error{ErrorKind::usage,
                 "--key is for this command and --worker-key for the pilots: a coordinator with "
                 "keys needs both"};
  }
  BATON_TRY(client_access(options.worker_key, true, {}));  // before the pilots find out
  return OpenFarm{LocalFarm::attach(options.coordinator),
                  {options.coordinator, options.key},
                  options.worker_key,
                  options.coordinator};
}

/// How `baton` speaks to a coordinator, as arguments.
std::string link_arguments(const CoordinatorLink& link) {
  return fmt::format("--coordinator {}{}", link.endpoint,
                     link.key_file.empty() ? std::string() : " --key " + link.key_file);
}

/// Starts a coordinator where the nodes reach it, with keys of its own. It has the port of the last
/// time, which pilots may still be trying.
Result<OpenFarm> start(const FarmCommandOptions& options, FarmOptions farm) {
  const fs::path keys = farm.work_directory / "keys";
  std::error_code error;
  if (!fs::exists(keys / "server.key", error)) BATON_TRY(create_keys(keys));
  farm.server_key = (keys / "server.key").string();
  farm.workers = 0;
  farm.listen = options.listen;
  const auto last = read_text_file(farm.work_directory / "endpoint", limits::kMaxTextLength);
  if (last && farm.listen.ends_with(":*") && last->starts_with("tcp://"))
    farm.listen = last->substr(0, last->find('\n'));
  BATON_ASSIGN(LocalFarm started, LocalFarm::start(farm));
  const CoordinatorLink link{endpoint_at(started.endpoint(), "127.0.0.1"),
                             (keys / "admin.key").string()};
  const std::string host = options.host.empty() ? host_name() : options.host;
  const std::string endpoint = endpoint_at(started.endpoint(), host);
  return OpenFarm{std::move(started), link, (keys / "worker.key").string(), endpoint};
}

Result<PilotJob> pilot_job(const FarmCommandOptions& options, const OpenFarm& farm,
                           const fs::path& folder) {
  PilotJob pilot;
  BATON_ASSIGN(pilot.worker, sibling_program("baton-worker"));
  pilot.endpoint = farm.pilot_endpoint;
  if (!farm.worker_key.empty()) pilot.key = fs::absolute(farm.worker_key).string();
  pilot.script_log = (folder / "%A_%a.log").string();
  pilot.job_name = fmt::format("{}{}", kJobNamePrefix, digest_of(folder.string()).short_hex());
  pilot.partition = options.partition;
  pilot.time = options.time;
  if (!options.time.empty()) {
    BATON_ASSIGN(pilot.time_s, parse_walltime(options.time));
  }
  pilot.worker_arguments = {"--idle-exit", std::to_string(options.idle_exit_s), "--drain",
                            std::to_string(options.drain_s)};
  pilot.worker_arguments.insert(pilot.worker_arguments.end(), options.worker_arguments.begin(),
                                options.worker_arguments.end());
  pilot.sbatch_arguments = options.sbatch_arguments;
  return pilot;
}

/// Renders the job, or, without one, keeps the farm up for those that others submit.
Result<ExitCode> work(RenderSession& session, const RenderOptions& options,
                      const std::optional<JobSpec>& wanted,
                      const std::function<void()>& tend_pilots) {
  if (!wanted) {
    BATON_TRY(session.keep_running(tend_pilots));
    return ExitCode::ok;
  }
  if (wanted->output.is_look) tell("a look: frames go to {}\n", wanted->output.directory);
  const bool restart = options.restart || options.from_frame;
  BATON_ASSIGN(const std::optional<JobStatus> status, session.render(*wanted, restart, [&] {
    tend_pilots();
    return false;
  }));
  if (status) return exit_code_of_stopped(*status);
  tell("stopped; the same command goes on\n");
  return ExitCode::cancelled;
}

Result<ExitCode> run_slurm(const FarmCommandOptions& options) {
  const RenderOptions& render = options.render;
  BATON_ASSIGN(const NodeRange nodes, parse_node_range(options.nodes));
  if (!options.time.empty()) BATON_TRY(parse_walltime(options.time));
  std::optional<JobSpec> wanted;
  if (!render.job.file.empty()) {
    BATON_ASSIGN(wanted, load_settled(render.job));
    BATON_TRY(begin_at(*wanted, render.from_frame));
  } else if (render.work_directory.empty()) {
    return Error{ErrorKind::usage, "without a JOB, say --work-dir"};
  }
  const FarmOptions local = farm_options(render, wanted.value_or(JobSpec()));
  if (wanted) BATON_TRY(settle_method(*wanted, local));

  const SignalWait signals;
  BATON_ASSIGN(OpenFarm open,
               options.coordinator.empty() ? start(options, local) : attach(options));
  const fs::path folder = local.work_directory / "slurm";
  BATON_ASSIGN(PilotJob pilot, pilot_job(options, open, folder));
  SlurmFarm pilots({std::move(pilot), nodes, folder / "pilot.sh",
                    std::chrono::milliseconds(static_cast<std::int64_t>(1000 * options.poll_s))});
  BATON_TRY(pilots.prepare());
  BATON_ASSIGN(RequestClient client, open.link.connect());
  BATON_ASSIGN(RequestClient watcher, open.link.connect());
  tell("to look at the farm: baton farm status {}\n", link_arguments(open.link));
  if (!wanted) {
    tell("to hand in a job: baton job submit JOB {}\nCtrl-C ends the farm\n",
         link_arguments({open.pilot_endpoint, open.link.key_file}));
  }

  RenderSession session(render, signals, std::move(open.farm), std::move(client));
  auto outcome = work(session, render, wanted, [&] { pilots.tend(watcher); });
  pilots.cancel_all();
  session.stop();
  return outcome;
}

void add_slurm_command(CLI::App& farm, ExitCode& code) {
  auto options = std::make_shared<FarmCommandOptions>();
  CLI::App* slurm = farm.add_subcommand(
      "slurm",
      "Renders a job with workers that Slurm starts on its nodes, as many as there is work");
  add_job_argument(*slurm, options->render.job);
  slurm->get_option("JOB")->required(false)->description(
      "job file; without one: keeps the farm up for jobs that are submitted to it, until Ctrl-C");
  slurm->add_option("--nodes", options->nodes, "how many pilots, least and most: 4 or 1-8")
      ->capture_default_str();
  slurm->add_option("--partition", options->partition, "default: Slurm's");
  slurm->add_option("--time", options->time,
                    "of a pilot, as sbatch takes it, e.g. 2:00:00; default: the partition's");
  slurm->add_option("--sbatch-arg", options->sbatch_arguments,
                    "one more argument of sbatch, e.g. --sbatch-arg=--account=film; repeatable");
  slurm->add_option("--worker-arg", options->worker_arguments,
                    "one more argument of baton-worker, e.g. --worker-arg=--map=/a=/b; repeatable");
  slurm->add_option(
      "--work-dir", options->render.work_directory,
      "journal, blobs, keys and logs, on a disk that the nodes share; default: .baton "
      "in the output folder");
  add_store_limit_option(*slurm, options->render.store_limit_mib);
  slurm->add_option("--host", options->host,
                    "name or address by which the nodes reach this machine; default: its name");
  slurm->add_option("--listen", options->listen, "of the coordinator; port * picks a free one")
      ->capture_default_str();
  slurm
      ->add_option("--coordinator", options->coordinator,
                   "endpoint of one that runs already; default: starts one")
      ->envname("BATON_COORDINATOR");
  slurm->add_option("--key", options->key, "admin.key of that coordinator")->envname("BATON_KEY");
  slurm->add_option("--worker-key", options->worker_key, "worker.key of that coordinator");
  slurm->add_option("--idle-exit", options->idle_exit_s, "seconds without work that end a pilot")
      ->capture_default_str();
  slurm
      ->add_option(
          "--drain", options->drain_s,
          "seconds that a pilot goes on with its tasks when it is told to end; Slurm kills "
          "it after its KillWait")
      ->capture_default_str();
  slurm->add_option("--poll", options->poll_s, "seconds between two looks at the queue")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  slurm->add_flag("--restart", options->render.restart,
                  "replace the frames of another picture in the output folder");
  add_from_frame_option(*slurm, options->render.from_frame);
  slurm->add_flag("--json", options->render.json, "the result for machines");
  slurm->footer(
      "Examples:\n"
      "  baton farm slurm job.json --nodes 1-8 --time 2:00:00\n"
      "  baton farm slurm --nodes 0-8 --work-dir /shared/farm\n"
      "  baton farm slurm job.json --nodes 4 --partition cpu --sbatch-arg=--account=film\n"
      "Ctrl-C cancels the pilots; the same command goes on where it stopped.");
  slurm->callback([options, &code] { code = finish_with_coordinator(run_slurm(*options)); });
}

}  // namespace

void add_farm_command(CLI::App& app, ExitCode& code) {
  CLI::App* farm = app.add_subcommand("farm", "Farms of several machines");
  farm->footer(
      "Examples:\n"
      "  baton farm status --coordinator tcp://farm:5570\n"
      "  baton farm events --since 2h --follow\n"
      "  baton farm slurm job.json --nodes 1-8");
  farm->require_subcommand(1);
  add_slurm_command(*farm, code);
  add_events_command(*farm, code);
  add_status_commands(*farm, code);
}

}  // namespace baton
