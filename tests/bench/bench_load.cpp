// What one coordinator bears: simulated workers over real sockets, a job of many tiny tiles, a real
// journal. Nothing is rendered; workers publish a few bytes for each output. When nine tenths of
// the tiles are done the coordinator is killed and started again. Workers and coordinator share the
// machine: what the workers cost here is somebody else's time on a farm.
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <future>
#include <limits>
#include <numeric>
#include <thread>

#include "common/job/text/job_json.h"
#include "common/protocol/client.h"
#include "jobs/cli/child_process.h"
#include "tests/bench/simulated_workers.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

struct LoadOptions {
  int workers = 1000, tiles = 1000000, threads = 2, tile_ms = 0;
  std::string method = "bidirectional";
  bool keys = false;  ///< every connection is encrypted
  fs::path work_dir = fs::temp_directory_path() / fmt::format("baton-load-{}", ::getpid());
  fs::path store = fs::path("/dev/shm") / fmt::format("baton-load-{}", ::getpid());
};

constexpr int kTileSide = 8;
constexpr int kMostTilesOfAFrame = 1024;  // an image of 256 x 256 pixels
constexpr auto kPatience = 30min;
constexpr double kNever = std::numeric_limits<double>::quiet_NaN();

double seconds_since(LoadClock::time_point start) {
  return std::chrono::duration<double>(LoadClock::now() - start).count();
}

/// A job of at least so many tiles, each a task of its own.
Result<JobSpec> make_job(const LoadOptions& options) {
  const fs::path map = options.work_dir / "map.exr";  // nobody looks into it
  BATON_TRY(write_file_unsynced(map, as_bytes_view("no picture")));
  const int tiles_of_frame = std::clamp(options.tiles / 8, 4, kMostTilesOfAFrame);
  const int rows = 1 << (std::bit_width(static_cast<unsigned>(tiles_of_frame)) - 1) / 2;
  const int columns = tiles_of_frame / rows;
  const int frames = (options.tiles + rows * columns - 1) / (rows * columns);
  const std::string text = fmt::format(
      R"({{"specificationVersion": 1, "name": "load", "frames": "1-{}",
           "image": {{"width": {}, "height": {}, "tileSize": {}}},
           "camera": {{"position": [0, 1, 4], "lookAt": [0, 0, 0]}},
           "scene": {{"materials": {{"floor": {{"type": "diffuse"}}}}, "ground": {{"material": "floor"}}}},
           "environment": {{"map": "{}"}}, "sampling": {{"method": "{}"}},
           "state": {{"checkpointEvery": 1}}, "output": {{"directory": "{}"}}}})",
      frames, kTileSide * columns, kTileSide * rows, kTileSide, map.string(), options.method,
      (options.work_dir / "frames").string());
  return parse_job(text, "load", options.work_dir);
}

// ---- the coordinator ----------------------------------------------------------------------------

/// The keys of an encrypted run.
fs::path keys_of(const LoadOptions& options) { return options.work_dir / "keys"; }

Result<ChildProcess> start_coordinator(const LoadOptions& options, const std::string& endpoint,
                                       std::string& concrete) {
  const fs::path file = options.work_dir / "endpoint";
  fs::remove(file);
  BATON_ASSIGN(const std::string program, sibling_program("baton-coordinator"));
  std::vector<std::string> command{program,      "--work-dir", (options.work_dir / "farm").string(),
                                   "--listen",   endpoint,     "--endpoint-file",
                                   file.string()};
  if (options.keys) command.insert(command.end(), {"--key", keys_of(options) / "server.key"});
  if (!options.keys) command.emplace_back("--insecure");
  BATON_ASSIGN(ChildProcess process,
               ChildProcess::start(command, options.work_dir / "coordinator.log"));
  while (!fs::exists(file)) {
    if (const auto end = process.ended()) return Error{ErrorKind::internal, "coordinator: " + *end};
    std::this_thread::sleep_for(1ms);
  }
  BATON_ASSIGN(concrete, read_text_file(file, 4096));
  concrete.pop_back();  // the end of the line
  return process;
}

/// A value of /proc/PID/status in bytes: VmRSS, VmHWM.
std::uint64_t memory_of(const ChildProcess& process, const std::string& key) {
  std::ifstream status(fmt::format("/proc/{}/status", process.pid()));
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key + ":")) return 1024 * std::stoull(line.substr(key.size() + 1));
  }
  return 0;
}

/// CPU seconds, user and system.
double cpu_of(const ChildProcess& process) {
  std::ifstream stat(fmt::format("/proc/{}/stat", process.pid()));
  const std::string text{std::istreambuf_iterator<char>(stat), {}};
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::vector<std::string> words{std::istream_iterator<std::string>(fields), {}};
  if (words.size() < 13) return 0;
  return (std::stod(words[11]) + std::stod(words[12])) /
         static_cast<double>(::sysconf(_SC_CLK_TCK));
}

std::size_t count_lines(const fs::path& log, const std::string& part) {
  std::ifstream file(log);
  std::size_t count = 0;
  for (std::string line; std::getline(file, line);)
    count += line.find(part) != std::string::npos ? 1 : 0;
  return count;
}

/// The job as the coordinator tells it; what it tells is durable.
Result<JobSummary> ask_job(RequestClient& client) {
  BATON_ASSIGN(const Message answer, client.request(ListJobs{.all = true}, 10s));
  const auto* list = std::get_if<JobList>(&answer);
  if (list == nullptr || list->jobs.size() != 1)
    return Error{ErrorKind::internal, "no list of one job"};
  return list->jobs.front().summary;
}

/// Asks until `wanted` of the job.
template <class Wanted>
Result<JobSummary> wait_for(RequestClient& client, const Wanted& wanted) {
  const auto deadline = LoadClock::now() + kPatience;
  while (LoadClock::now() < deadline) {
    // A question to a coordinator that was killed a moment ago has no answer.
    Result<JobSummary> job = ask_job(client);
    if (!job && job.error().kind == ErrorKind::timeout) continue;
    if (!job || wanted(*job)) return job;
    if (!is_open(job->status))
      return Error{ErrorKind::internal, fmt::format("the job is {}", job_status_name(job->status))};
    std::this_thread::sleep_for(50ms);
  }
  return Error{ErrorKind::timeout, "the job takes too long"};
}

// ---- the run ------------------------------------------------------------------------------------

struct Figures {
  std::uint64_t tasks = 0, measured_tasks = 0, again = 0;
  std::uint64_t memory_bytes = 0, restarted_bytes = 0;  ///< the most, in either life
  std::uint64_t measured_bytes = 0;
  double measured_s = 0, cpu_s = 0, submit_s = 0;
  double restart_s = kNever, granted_s = kNever;  ///< never: all was done before
  std::size_t expired = 0;
  std::vector<float> waits;
};

Result<Figures> measure(const LoadOptions& options) {
  for (const fs::path& folder : {options.work_dir / "frames", options.work_dir / "farm"})
    fs::create_directories(folder);
  fs::create_directories(options.store);
  fs::create_directory_symlink(fs::absolute(options.store), options.work_dir / "farm" / "store");
  BATON_ASSIGN(const JobSpec job, make_job(options));
  BATON_ASSIGN(const std::string document, make_job_document(job));
  Figures figures;

  ClientAccess access;
  std::optional<ClientKey> worker_key;
  if (options.keys) {
    BATON_TRY(create_keys(keys_of(options)));
    BATON_ASSIGN(access, client_access((keys_of(options) / "admin.key").string(), false, {}));
    BATON_ASSIGN(worker_key, read_client_key(keys_of(options) / "worker.key"));
  }

  // A coordinator and its job.
  std::string endpoint;
  BATON_ASSIGN(ChildProcess coordinator, start_coordinator(options, "tcp://127.0.0.1:*", endpoint));
  const std::uint64_t memory_before = memory_of(coordinator, "VmRSS");
  BATON_ASSIGN(RequestClient client, RequestClient::connect(endpoint, access));
  auto start = LoadClock::now();
  BATON_ASSIGN(const Message accepted, client.request(SubmitJob{document}, 60s));
  figures.submit_s = seconds_since(start);

  // The workers.
  BATON_ASSIGN(BlobStore store, BlobStore::open(options.work_dir / "farm" / "store"));
  LoadRun run{.job = job,
              .digest = std::get<JobAccepted>(accepted).version,
              .endpoint = endpoint,
              .key = worker_key,
              .tile_time = std::chrono::milliseconds(options.tile_ms),
              .store = std::move(store)};
  zmq::context_t context(1);
  context.set(zmq::ctxopt::max_sockets, options.workers + 16);
  std::vector<std::future<Result<std::vector<float>>>> threads;
  for (int i = 0; i < options.threads; ++i) {
    threads.push_back(std::async(std::launch::async, [&, i] {
      return simulate_workers(run, context, options.workers * i / options.threads,
                              options.workers * (i + 1) / options.threads);
    }));
  }
  const auto work = [&]() -> Status {
    // The steady state: from the first tenth to the last.
    const auto part_done = [&](double part) {
      return [part](const JobSummary& j) {
        return static_cast<double>(j.tasks_done) >= part * static_cast<double>(j.tasks_total);
      };
    };
    BATON_ASSIGN(const JobSummary first, wait_for(client, part_done(0.1)));
    start = LoadClock::now();
    const double cpu_start = cpu_of(coordinator);
    const std::uint64_t bytes_start = run.bytes;
    BATON_ASSIGN(const JobSummary last, wait_for(client, part_done(0.9)));
    figures.measured_s = seconds_since(start);
    figures.cpu_s = cpu_of(coordinator) - cpu_start;
    figures.measured_bytes = run.bytes - bytes_start;
    figures.measured_tasks = last.tasks_done - first.tasks_done;

    // A new life.
    figures.memory_bytes = memory_of(coordinator, "VmHWM") - memory_before;
    const std::uint32_t epoch = run.newest_epoch;
    run.first_welcome = LoadClock::time_point{};
    coordinator.send_signal(SIGKILL);
    if (!coordinator.wait_for_end(10s)) return Error{ErrorKind::internal, "it cannot be killed"};
    start = LoadClock::now();
    BATON_ASSIGN(coordinator, start_coordinator(options, endpoint, endpoint));
    BATON_ASSIGN(const JobSummary end,
                 wait_for(client, [](const JobSummary& j) { return j.status == JobStatus::done; }));
    const auto since_start = [&](LoadClock::time_point moment) {
      const bool is_set = moment != LoadClock::time_point{};
      return is_set ? std::chrono::duration<double>(moment - start).count() : kNever;
    };
    figures.restart_s = since_start(run.first_welcome);
    figures.granted_s = run.newest_epoch > epoch ? since_start(run.first_grant) : kNever;
    figures.tasks = end.tasks_total;
    figures.restarted_bytes = memory_of(coordinator, "VmHWM") - memory_before;
    return {};
  };
  const Status worked = work();
  run.stop = true;
  for (auto& thread : threads) {
    BATON_ASSIGN(const std::vector<float> waits, thread.get());
    figures.waits.insert(figures.waits.end(), waits.begin(), waits.end());
  }
  BATON_TRY(worked);
  figures.again = run.reports - figures.tasks;
  figures.expired = count_lines(options.work_dir / "coordinator.log", "is silent");
  return figures;
}

void print(const LoadOptions& options, Figures& f) {
  std::sort(f.waits.begin(), f.waits.end());
  const auto wait_ms = [&](double part) {
    const auto at = static_cast<std::size_t>(part * static_cast<double>(f.waits.size()));
    return 1000 * f.waits.at(std::min(at, f.waits.size() - 1));
  };
  const auto tasks = static_cast<double>(f.measured_tasks);
  const auto a_task = [&](std::uint64_t bytes) {
    return static_cast<double>(bytes) / static_cast<double>(f.tasks);
  };
  fmt::print(
      "{} workers, {} tasks ({}, {} ms a tile), {}\n"
      "durable completions     {:.0f} a second (goal 5000), messages of {:.2f} MB/s\n"
      "coordinator             {:.0f} us of CPU a completion, {:.0f} % of one core\n"
      "wait for a grant        median {:.1f} ms, 99th percentile {:.1f} ms\n"
      "coordinator's memory    {:.0f} bytes a task at the most (goal 300), {:.0f} after a restart\n"
      "submission              {:.2f} s\n"
      "restart                 {:.2f} s to the first welcome, {:.2f} s to the first grant (goal "
      "10)\n"
      "workers expired         {} (goal 0)\n"
      "reported more than once {} tasks\n",
      options.workers, f.tasks, options.method, options.tile_ms,
      options.keys ? "encrypted (CURVE)" : "in the clear", tasks / f.measured_s,
      1e-6 * static_cast<double>(f.measured_bytes) / f.measured_s, 1e6 * f.cpu_s / tasks,
      100 * f.cpu_s / f.measured_s, wait_ms(0.5), wait_ms(0.99), a_task(f.memory_bytes),
      a_task(f.restarted_bytes), f.submit_s, f.restart_s, f.granted_s, f.expired, f.again);
}

/// keys: "without", "with" or "both". Returns the exit code.
int run_both(const LoadOptions& options, const std::string& keys) {
  std::vector<double> rates;
  for (const bool encrypted : {false, true}) {
    if (keys == (encrypted ? "without" : "with")) continue;
    LoadOptions run = options;
    run.keys = encrypted;
    run.work_dir /= encrypted ? "encrypted" : "clear";
    run.store /= encrypted ? "encrypted" : "clear";
    Result<Figures> figures = measure(run);
    if (!figures) {
      fmt::print(stderr, "{}\n", figures.error().message);
      return 70;
    }
    print(run, *figures);
    rates.push_back(static_cast<double>(figures->measured_tasks) / figures->measured_s);
  }
  if (rates.size() == 2)
    fmt::print(
        "completions a second: {:.0f} in the clear, {:.0f} encrypted, {:.2f} times as many\n",
        rates[0], rates[1], rates[1] / rates[0]);
  return 0;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  baton::LoadOptions options;
  bool keep = false;
  std::string keys = "both";
  CLI::App app(
      "Loads one coordinator with simulated workers and tiny tiles, and prints what it bears.");
  app.add_option("--workers", options.workers)->check(CLI::Range(1, 4096))->capture_default_str();
  app.add_option("--tiles", options.tiles)->check(CLI::Range(32, 3000000))->capture_default_str();
  app.add_option("--threads", options.threads, "of the simulation")->capture_default_str();
  app.add_option("--tile-ms", options.tile_ms, "that a worker takes for a tile")
      ->capture_default_str();
  app.add_option("--method", options.method)->capture_default_str();
  app.add_option("--work-dir", options.work_dir, "a folder that is not there; removed at the end");
  app.add_option("--store", options.store, "likewise, for the blobs")->capture_default_str();
  app.add_option("--keys", keys, "of the farm")
      ->check(CLI::IsMember({"without", "with", "both"}))
      ->capture_default_str();
  app.add_flag("--keep", keep, "leave the folders");
  CLI11_PARSE(app, argc, argv);
  const int code = baton::run_both(options, keys);
  if (!keep) {
    std::filesystem::remove_all(options.store);
    std::filesystem::remove_all(options.work_dir);
  }
  return code;
}
