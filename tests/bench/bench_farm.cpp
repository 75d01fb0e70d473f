// What the farm costs: a job through coordinator and workers over the same tiles called in this
// process with two threads, once with each frame written and verified as a worker does it, once
// with the frames thrown away. All three load the scene; the farm also starts its programs, takes
// the digests of all files, hands films and states over through the blob store, journals, and draws
// the contact sheet. Wall time is the goal; CPU seconds (user and system, of all processes) tell
// what is paid and hold on a busy machine. In one run, one after the other, so the ratios hold on a
// noisy one. Usage: bench_farm [JOB.json] [ROUNDS]; needs the programs beside it.
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <thread>
#include <vector>

#include "common/base/files.h"
#include "common/job/text/job_json.h"
#include "common/scene/settle/settle_motion.h"
#include "tests/bench/bench_program.h"
#include "tests/support/local_frames.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Two render threads each way.
struct Layout {
  int workers = 1, threads = 2;
};
constexpr std::array kLayouts{Layout{1, 2}, Layout{2, 1}};

struct Cost {
  double wall_s = 0, cpu_s = 0;
};

/// User and system time of this process and of all descendants that have ended.
double cpu_seconds() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
  }
  return seconds;
}

Result<Cost> measure(const std::function<Status()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds();
  BATON_TRY(work());
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return Cost{wall.count(), cpu_seconds() - cpu_start};
}

/// All tiles of a frame, by two threads.
Status render_tiles(LocalRender& render, std::int32_t num_tiles, Step step) {
  std::vector<Result<RenderedTile>> rendered(static_cast<std::size_t>(num_tiles), RenderedTile{});
  std::atomic<std::int32_t> next{0};
  const auto work = [&] {
    for (std::int32_t tile = next++; tile < num_tiles; tile = next++)
      rendered[static_cast<std::size_t>(tile)] = render.render(step, tile);
  };
  std::thread other(work);
  work();
  other.join();
  std::map<std::int32_t, RenderedTile> tiles;
  for (std::int32_t tile = 0; tile < num_tiles; ++tile) {
    BATON_ASSIGN(tiles[tile], std::move(rendered[static_cast<std::size_t>(tile)]));
  }
  render.keep(std::move(tiles));
  return {};
}

/// write: frames become files, while the next one is rendered; otherwise they are only rendered.
Status render_in_process(const JobSpec& given, bool write) {
  BATON_ASSIGN(const JobSpec job, settle_motion(given));
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  LocalRender render(*context);
  const Timeline timeline(job);
  std::future<Status> written;
  for (FrameIndex frame; frame.index() < job.frames.size(); ++frame) {
    const Step step = timeline.step_of(frame, Sweep(0));
    BATON_TRY(render_tiles(render, context->grid.count(), step));
    if (written.valid()) BATON_TRY(written.get());
    RenderStats stats;
    BATON_ASSIGN(FilmTile image, test::local_image(render, job, step, stats));
    if (!write) continue;
    written = std::async(std::launch::async, [&job, frame, image = std::move(image)]() -> Status {
      BATON_ASSIGN(const WrittenFrame file, write_frame(job, Digest{1, 1}, frame, image));
      return file.file.size_bytes > 0 ? Status() : Error{ErrorKind::internal, "empty frame"};
    });
  }
  return written.valid() ? written.get() : Status();
}

/// `baton render` as a person starts it.
Status render_on_farm(const fs::path& bin, const fs::path& job_file, const Layout& layout) {
  const std::string command =
      fmt::format("'{}' render '{}' --workers {} --threads-per-worker {} > /dev/null 2>&1",
                  (bin / "baton").string(), job_file.string(), layout.workers, layout.threads);
  return std::system(command.c_str()) == 0 ? Status()
                                           : Error{ErrorKind::internal, command + ": failed"};
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Costs of one layout over those in this process, round by round.
struct Ratios {
  std::vector<double> wall, cpu;

  void add(const Cost& farm, const Cost& local) {
    wall.push_back(farm.wall_s / local.wall_s);
    cpu.push_back(farm.cpu_s / local.cpu_s);
  }
  void print(const Layout& layout, const char* over) const {
    fmt::print("{} x {} over {:<17} wall {:.3f}  CPU {:.3f}   medians of {}\n", layout.workers,
               layout.threads, over, median(wall), median(cpu), wall.size());
  }
};

Status run(const fs::path& bin, const std::string& job_path, int rounds) {
  BATON_ASSIGN(JobSpec job, load_job(job_path));
  const fs::path folder = fs::temp_directory_path() / fmt::format("baton-bench-{}", ::getpid());
  std::array<Ratios, kLayouts.size()> over_frames, over_tiles;
  for (int round = 0; round < rounds; ++round) {
    job.output.directory = (folder / "local").string();
    BATON_ASSIGN(const Cost tiles, measure([&] { return render_in_process(job, false); }));
    BATON_ASSIGN(const Cost frames, measure([&] { return render_in_process(job, true); }));
    fmt::print("in process, 2 threads: {:.2f} s, {:.2f} CPU s; frames written: {:.2f} s, {:.2f}\n",
               tiles.wall_s, tiles.cpu_s, frames.wall_s, frames.cpu_s);
    for (std::size_t i = 0; i < kLayouts.size(); ++i) {
      job.output.directory = (folder / fmt::format("farm{}", i)).string();
      const fs::path job_file = folder / "job.json";
      const std::string text = to_json(job);
      BATON_TRY(write_file_atomic(job_file, as_bytes_view(text)));
      BATON_ASSIGN(const Cost farm,
                   measure([&] { return render_on_farm(bin, job_file, kLayouts[i]); }));
      over_frames[i].add(farm, frames);
      over_tiles[i].add(farm, tiles);
      fmt::print("farm, {} x {}: {:.2f} s, {:.2f} CPU s\n", kLayouts[i].workers,
                 kLayouts[i].threads, farm.wall_s, farm.cpu_s);
    }
    std::fflush(stdout);
    fs::remove_all(folder);
  }
  fmt::print("workers x threads; goal: wall at most 1.1 over frames written\n");
  for (std::size_t i = 0; i < kLayouts.size(); ++i) {
    over_frames[i].print(kLayouts[i], "frames written");
    over_tiles[i].print(kLayouts[i], "tiles alone");
  }
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) { return baton::bench_program(argc, argv, 5, baton::run); }
