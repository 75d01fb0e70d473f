// What pictures of the sizes that people render take: `baton render` with one worker of two
// threads, one row for each size, method, and at rest or in motion. Times are CPU seconds of all
// processes, so shares hold on a noisy machine. Usage: bench_sizes [JOB.json] [FRAMES]; needs the
// programs beside it.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/job/motion.h"
#include "common/job/text/job_json.h"
#include "tests/bench/bench_program.h"
#include "tests/bench/orbit.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<int, int>, 2> kSizes{{{1920, 1080}, {3840, 2160}}};
constexpr std::array kMethods{Method::pool, Method::sequential, Method::bidirectional};

double seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

/// Bytes of the files that were waited for, by themselves or with their file system. `record` is
/// that of sync_witness.cpp.
Result<double> bytes_synced(const fs::path& record) {
  std::ifstream lines(record);
  if (!lines) return Error{ErrorKind::io, record.string() + ": nothing was waited for"};
  double synced = 0;
  std::map<std::string, double> waiting;  // published, by name
  std::set<std::string> alone;            // files that were waited for by themselves
  for (std::string line, what, file, name; std::getline(lines, line);) {
    std::istringstream words(line);
    double bytes = 0;
    words >> what >> file;
    if (what == "sync" && words >> bytes) {
      if (alone.insert(file).second) synced += bytes;
    } else if (what == "rename" && words >> name >> bytes) {
      if (!alone.contains(file)) waiting[name] = bytes;
    } else if (what == "remove") {
      waiting.erase(file);
    } else if (what == "syncfs") {
      for (const auto& [unused, size] : waiting) synced += size;
      waiting.clear();
    }
  }
  return synced;
}

/// Runs `baton render` with its report in `report`; returns what it and all that it started took.
Result<rusage> render(const fs::path& bin, const fs::path& job_file, const fs::path& report) {
  const std::string command = fmt::format(
      "LD_PRELOAD='{}' BATON_SYNC_RECORD='{}' exec '{}' render '{}' --workers 1 "
      "--threads-per-worker 2 --json > '{}' 2> '{}'",
      (bin / "libsync_witness.so").string(), report.string() + ".syncs", (bin / "baton").string(),
      job_file.string(), report.string(), report.string() + ".log");
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  rusage used{};
  if (child < 0 || ::wait4(child, &status, 0, &used) != child || status != 0)
    return Error{ErrorKind::internal, command + ": failed"};
  return used;
}

Status measure(const fs::path& bin, const fs::path& folder, const JobSpec& job) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  const std::string text = to_json(job);
  BATON_TRY(write_file_atomic(folder / "job.json", as_bytes_view(text)));
  BATON_ASSIGN(const rusage used, render(bin, folder / "job.json", folder / "report.json"));
  BATON_ASSIGN(const double synced, bytes_synced(folder / "report.json.syncs"));
  BATON_ASSIGN(const Bytes report, read_file(folder / "report.json", limits::kMaxJobFileBytes));
  const auto* const begin = reinterpret_cast<const char*>(report.data());
  const auto told = nlohmann::json::parse(begin, begin + report.size());
  const auto& stats = told.at("stats");

  const auto frames = static_cast<double>(job.frames.size());
  const double system = seconds(used.ru_stime), cpu = seconds(used.ru_utime) + system;
  const double rays = stats.at("raysPrimary").get<double>() + stats.at("raysShadow").get<double>();
  const double state_bytes = told.at("stateBytes").get<double>();
  constexpr double kBlock = 512, kMiB = 1 << 20;
  fmt::print(
      "{:4} x {:<4} {:<13} {:<6} {:7.2f} {:8.2f} {:7.1f} {:7.1f} {:9.0f} {:9.0f} {:8.0f} {:8.1f}\n",
      job.image.width, job.image.height, traits(job.sampling.method).name,
      moves(job) ? "motion" : "rest", cpu / frames, rays / cpu / 1e6,
      100 * stats.at("stateSeconds").get<double>() / cpu, 100 * system / cpu,
      static_cast<double>(used.ru_maxrss) / 1024,
      static_cast<double>(used.ru_oublock) * kBlock / kMiB / frames, synced / kMiB / frames,
      state_bytes / std::max(told.at("statePixels").get<double>(), 1.0));
  std::fflush(stdout);
  return {};
}

Status run(const fs::path& bin, const std::string& path, int frames) {
  BATON_ASSIGN(JobSpec written, load_job(path));
  written.frames.resize(std::min(written.frames.size(), static_cast<std::size_t>(frames)));
  const fs::path folder = fs::temp_directory_path() / fmt::format("baton-sizes-{}", ::getpid());
  written.output.directory = (folder / "frames").string();
  fmt::print("{} frames, {} sites, one worker of two threads; the first frame starts afresh\n",
             frames, written.image.sites);
  fmt::print(
      "size        method        camera  CPU s/f  Mrays/s  state%  system%  peak MiB  MiB/f: "
      "written  synced  B/pixel\n");
  for (const auto& [width, height] : kSizes) {
    for (const Method method : kMethods) {
      for (const bool in_motion : {false, true}) {
        JobSpec job = written;
        job.image.width = width;
        job.image.height = height;
        job.sampling.method = method;
        if (in_motion) set_in_orbit(job);
        BATON_TRY(measure(bin, folder, job));
      }
    }
  }
  fs::remove_all(folder);
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) { return baton::bench_program(argc, argv, 3, baton::run); }
