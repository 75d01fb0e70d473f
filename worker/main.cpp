#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "common/base/command_pages.h"
#include "common/base/legible.h"
#include "common/base/log.h"
#include "common/base/option_environment.h"
#include "common/base/option_values.h"
#include "common/base/settings.h"
#include "worker/run/crash_handler.h"
#include "worker/run/replay.h"
#include "worker/run/worker.h"

/// What jemalloc reads when the process starts. Work space of tiles is freed and taken again all
/// the time, and giving it back at once would cost the system as much as all of its other work for
/// a worker: freed pages go back after a minute without use, large ones as well.
extern "C" {
extern const char* const malloc_conf;
const char* const malloc_conf = "background_thread:true,oversize_threshold:0,dirty_decay_ms:60000";
}

namespace {

/// SIGTERMs and SIGINTs so far, read by the control thread.
std::atomic<int> g_signals{0};

/// The first signal drains, the second gives back what is not finished, the third ends the process
/// at once.
void install_drain_handler() {
  struct sigaction action {};
  action.sa_handler = [](int number) {
    if (++g_signals == 2) ::signal(number, SIG_DFL);
  };
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGINT, &action, nullptr);
}

/// Of a worker: why no list could show it; empty: one can.
std::string name_fault(const std::string& name) {
  const std::string shown = baton::legible_line(name);
  if (shown == name) return {};
  return fmt::format("expected UTF-8 without line breaks and other controls, got '{}'", shown);
}

/// What a worker must be told on a machine that is lent to it.
struct PilotOptions {
  std::int64_t end_at = 0, idle_exit_s = 0, drain_s = 0, memory_mib = 0;
  std::vector<std::string> maps;
};

void add_pilot_options(CLI::App& app, PilotOptions& pilot) {
  app.add_option("--end-at", pilot.end_at,
                 "when it must be gone, in seconds since 1970: takes nothing that it cannot finish "
                 "before, gives back what it has not finished");
  app.add_option("--idle-exit", pilot.idle_exit_s, "ends after so many seconds without a task")
      ->check(CLI::Range(0, 1000000));
  app.add_option(
         "--drain", pilot.drain_s,
         "seconds that it goes on with its tasks when it is told to end, by SIGTERM or `baton "
         "worker drain`; default: to their end")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--memory", pilot.memory_mib,
                 "MiB of this machine that it may use, about; default: half")
      ->check(CLI::Range(0, 1 << 30));
  app.add_option("--map", pilot.maps,
                 "FROM=TO: the folder FROM of the others is TO here; may be repeated");
}

baton::Status take_pilot_options(const PilotOptions& pilot, baton::WorkerOptions& worker) {
  if (pilot.end_at > 0)
    worker.end_at = std::chrono::system_clock::time_point(std::chrono::seconds(pilot.end_at));
  worker.idle_exit = std::chrono::seconds(pilot.idle_exit_s);
  worker.drain = std::chrono::seconds(pilot.drain_s);
  if (pilot.memory_mib > 0) {
    worker.machine.memory =
        baton::MemoryBudget::of(static_cast<std::uint64_t>(pilot.memory_mib) << 20);
  }
  for (const std::string& text : pilot.maps) {
    BATON_ASSIGN(baton::PathMap map, baton::parse_path_map(text));
    worker.machine.maps.push_back(std::move(map));
  }
  return {};
}

CLI::App* add_replay_command(CLI::App& app, baton::ReplayOptions& options,
                             std::vector<int>& pixel) {
  CLI::App* const command =
      app.add_subcommand("replay", "Renders one tile in this process, without a farm");
  command->add_option("JOB", options.job, "job file")->required();
  command->add_option("--frame", options.frame_number, "frame number")->required();
  command->add_option("--tile", options.tile, "tile, 0-based, row by row")->required();
  command->add_option("--pixel", pixel, "x,y in the image: prints its channels and particles")
      ->delimiter(',')
      ->expected(2);
  command->add_option("--out", options.out, "EXR of the tile; default: tile<T>.frame<F>.exr");
  return command;
}

int replay(const baton::ReplayOptions& options) {
  const baton::Result<std::string> report = baton::replay_tile(options);
  if (report) {
    fmt::print("{}", *report);
    return 0;
  }
  spdlog::error("{}", report.error().message);
  return static_cast<int>(baton::exit_code_of(report.error().kind));
}

int work(baton::WorkerOptions& worker, const PilotOptions& pilot, const std::string& key_file,
         bool insecure) {
  install_drain_handler();
  worker.machine.num_threads = worker.num_threads;
  if (const baton::Status taken = take_pilot_options(pilot, worker); !taken) {
    spdlog::error("{}", taken.error().message);
    return static_cast<int>(baton::exit_code_of(taken.error().kind));
  }
  baton::Result<baton::ClientAccess> access =
      baton::client_access(key_file, insecure, worker.endpoint);
  if (!access) {
    spdlog::error("{}", access.error().message);
    return static_cast<int>(baton::exit_code_of(access.error().kind));
  }
  worker.access = std::move(access).value();
  return static_cast<int>(baton::run_worker(worker, g_signals));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Renders tiles for a baton-coordinator.", "baton-worker");
  app.set_version_flag("--version", baton::describe_worker);
  app.require_subcommand(0, 1);
  app.parse_complete_callback([&app] {
    if (const std::string fault = baton::value_fault(app); !fault.empty())
      throw CLI::ValidationError(fault);
  });

  // Without a subcommand: work for a coordinator.
  baton::WorkerOptions worker;
  worker.num_threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::int64_t give_up_s = worker.give_up.count();
  app.add_option("--coordinator", worker.endpoint, "endpoint, e.g. tcp://127.0.0.1:5570")
      ->envname("BATON_COORDINATOR");
  app.add_option("--threads", worker.num_threads, "render threads; default: one per processor")
      ->envname("BATON_THREADS")
      ->check(CLI::Range(1, 1024));
  app.add_option("--name", worker.worker_id,
                 "for people; several workers may have one; default: host and process id")
      ->envname("BATON_WORKER_NAME")
      ->check(name_fault);
  app.add_option("--give-up-s", give_up_s,
                 "ends when no coordinator has answered for so long; 0: never")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000000));

  std::string isa = "auto";
  app.add_option(
         "--isa", isa,
         "instruction set: auto, sse4, avx2 or avx512; one that all machines of a farm have "
         "makes their bytes alike")
      ->envname("BATON_ISA")
      ->capture_default_str();

  std::string key_file;
  bool insecure = false;
  app.add_option("--key", key_file, "worker.key of `baton key create`")->envname("BATON_KEY");
  app.add_flag("--insecure", insecure, "connect without a key");
  app.add_option("--root", worker.machine.roots,
                 "folder that jobs may read from and write to, may be repeated; default: all")
      ->envname("BATON_ROOT");

  PilotOptions pilot;
  add_pilot_options(app, pilot);

  baton::ReplayOptions replay_options;
  std::vector<int> pixel;
  CLI::App* const replay_command = add_replay_command(app, replay_options, pixel);

  baton::add_page_options<CLI::Success>(app);
  if (const auto settings = baton::take_settings(baton::describe_command(app)); !settings) {
    fmt::print(stderr, "{}\n", baton::legible_text(settings.error().message));
    return static_cast<int>(baton::exit_code_of(settings.error().kind));
  }
  try {
    baton::limit_environment(app, argc, argv);
    app.parse(argc, argv);
    if (!replay_command->parsed() && worker.endpoint.empty())
      throw CLI::RequiredError("--coordinator");
  } catch (const CLI::ParseError& error) {
    return baton::end_parsing(app, error);
  }

  baton::init_logging("baton-worker");
  baton::install_crash_handler();
  if (const baton::Status limited = baton::use_instruction_set(isa); !limited) {
    spdlog::error("{}", limited.error().message);
    return static_cast<int>(baton::exit_code_of(limited.error().kind));
  }
  if (replay_command->parsed()) {
    if (pixel.size() == 2) replay_options.pixel = baton::PixelPosition{pixel[0], pixel[1]};
    return replay(replay_options);
  }
  worker.give_up = std::chrono::seconds(give_up_s);
  return work(worker, pilot, key_file, insecure);
}
