// What the farm costs: wall time of a job through coordinator and two workers over the wall time of the same job called
// in this process with two threads, frames written in both. Pairs in one run, so the ratio holds on a noisy machine.
// Usage: bench_farm [JOB.json] [PAIRS]; needs the programs beside it.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "common/base/files.h"
#include "common/job/job_json.h"
#include "worker/run/frame_output.h"
#include "worker/run/local_render.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Result<double> time_in_process(const JobSpec& job) {
  const auto start = std::chrono::steady_clock::now();
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  const FrameSink sink = [&](std::int32_t frame, const FilmTile& image) -> Status {
    BATON_ASSIGN(const BlobRef written, write_frame(job, Digest{1, 1}, frame, image));
    return written.size_bytes > 0 ? Status() : Error{ErrorKind::internal, "empty frame"};
  };
  BATON_ASSIGN(const RenderStats stats, render_locally(*context, job, 2, sink));
  return stats.pixels > 0 ? seconds_since(start) : 0;
}

Result<double> time_farm(const fs::path& bin, const fs::path& job_file) {
  const auto start = std::chrono::steady_clock::now();
  const std::string command = fmt::format("'{}' render '{}' --workers 2 --threads-per-worker 1 > /dev/null 2>&1",
                                          (bin / "baton").string(), job_file.string());
  if (std::system(command.c_str()) != 0) return Error{ErrorKind::internal, command + ": failed"};
  return seconds_since(start);
}

Status run(const fs::path& bin, const std::string& job_path, int pairs) {
  BATON_ASSIGN(JobSpec job, load_job(job_path));
  const fs::path folder = fs::temp_directory_path() / fmt::format("baton-bench-{}", ::getpid());
  std::vector<double> ratios;
  for (int pair = 0; pair < pairs; ++pair) {
    job.output.directory = (folder / fmt::format("local{}", pair)).string();
    BATON_ASSIGN(const double local, time_in_process(job));
    job.output.directory = (folder / fmt::format("farm{}", pair)).string();
    const fs::path job_file = folder / fmt::format("job{}.json", pair);
    const std::string text = to_json(job);
    BATON_TRY(write_file_atomic(job_file, as_bytes_view(text)));
    BATON_ASSIGN(const double farm, time_farm(bin, job_file));
    ratios.push_back(farm / local);
    fmt::print("in process {:.2f} s, farm {:.2f} s, ratio {:.3f}\n", local, farm, ratios.back());
    std::fflush(stdout);
  }
  std::sort(ratios.begin(), ratios.end());
  fmt::print("median ratio {:.3f} (goal: at most 1.1)\n", ratios[ratios.size() / 2]);
  fs::remove_all(folder);
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  const auto bin = std::filesystem::canonical("/proc/self/exe").parent_path();
  const baton::Status status =
      baton::run(bin, argc > 1 ? argv[1] : "jobs/examples/demo.json", argc > 2 ? std::atoi(argv[2]) : 3);
  if (status) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 70;
}
