// What motion costs: time of the sequential sampler while camera or objects move over the time of
// its own occlusion rays alone (the camera of a still job is sent round it), the cost of several
// sites over one, and what handing samples on costs in bytes and CPU time. All times are CPU
// seconds of one run on one thread, so the ratios hold on a noisy machine; the first frame, which
// starts afresh, is left out. Usage: bench_motion [JOB.json] [FRAMES]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/base/cpu_clock.h"
#include "common/job/motion.h"
#include "common/job/text/job_json.h"
#include "common/scene/settle/settle_motion.h"
#include "tests/bench/orbit.h"
#include "worker/pass/render_context.h"

namespace baton {
namespace {

constexpr double kMovingGoal = 2.6;

/// What the frames after the first cost.
struct Cost {
  RenderStats stats;
  double seconds_encode = 0;
  /// Each state decoded once: a worker keeps what it has decoded.
  double seconds_decode = 0;
  /// All states that each task needs: a worker that keeps nothing.
  double seconds_decode_inputs = 0;
  std::uint64_t state_bytes = 0, state_pixels = 0;

  double ratio() const { return stats.cpu_seconds / stats.seconds_visibility; }
  double ns_per_pixel(double seconds) const {
    return seconds / static_cast<double>(stats.pixels - stats.pixels_background) * 1e9;
  }
};

/// A state on its way through its file form.
Result<StatePtr> hand_on(const SampleState& state, Cost& cost, double& seconds_decode) {
  Bytes bytes;
  {
    const CpuTimer timer(cost.seconds_encode);
    bytes = encode_state(state);
  }
  cost.state_bytes += bytes.size();
  cost.state_pixels += state.num_pixels();
  const CpuTimer timer(seconds_decode);
  BATON_ASSIGN(SampleState decoded, decode_state(bytes, "state"));
  return std::make_shared<const SampleState>(std::move(decoded));
}

Result<Cost> measure(const JobSpec& job) {
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  const auto num_tiles = static_cast<std::size_t>(context->grid.count());
  Cost cost;
  std::vector<StatePtr> states(num_tiles);
  std::vector<double> seconds_of(num_tiles);
  for (Run run; run.value() < num_runs(job); ++run) {
    Cost frame;
    std::vector<StatePtr> next(num_tiles);
    std::vector<double> next_seconds(num_tiles);
    for (std::int32_t tile = 0; tile < context->grid.count(); ++tile) {
      const auto t = static_cast<std::size_t>(tile);
      std::vector<StatePtr> previous;
      for (const std::int32_t near : context->grid.tiles_near(tile, history_reach_px(job))) {
        if (run == Run(0)) continue;
        previous.push_back(states[static_cast<std::size_t>(near)]);
        frame.seconds_decode_inputs += seconds_of[static_cast<std::size_t>(near)];
      }
      const TileRunSink sink{[](Step, const FilmTile&) { return Status(); },
                             [&](const SampleState& state) -> Status {
                               BATON_ASSIGN(next[t], hand_on(state, frame, next_seconds[t]));
                               frame.seconds_decode += next_seconds[t];
                               return {};
                             }};
      BATON_ASSIGN(const RenderStats stats,
                   run_tile(*context, tile_run(job, tile, run), previous, sink, {}));
      frame.stats.merge(stats);
    }
    states = std::move(next);
    seconds_of = std::move(next_seconds);
    if (run == Run(0)) continue;

    // run_tile counts what its sink does.
    frame.stats.cpu_seconds -= frame.seconds_encode + frame.seconds_decode;
    cost.stats.merge(frame.stats);
    cost.seconds_encode += frame.seconds_encode;
    cost.seconds_decode += frame.seconds_decode;
    cost.seconds_decode_inputs += frame.seconds_decode_inputs;
    cost.state_bytes += frame.state_bytes;
    cost.state_pixels += frame.state_pixels;
  }
  return cost;
}

void print_row(int sites, const Cost& cost, double ns_of_one_site) {
  const RenderStats& s = cost.stats;
  const double surface = static_cast<double>(s.pixels - s.pixels_background);
  const double total = s.cpu_seconds + cost.seconds_encode + cost.seconds_decode;
  const auto ns = [&](double seconds) { return cost.ns_per_pixel(seconds); };
  fmt::print(
      "{:>5} {:>6.2f} {:>5.1f} {:>7.2f} {:>7.0f} {:>7.0f} {:>7.0f} {:>7.0f} {:>7.0f} {:>7.3f} "
      "{:>7.3f} {:>7.1f} "
      "{:>7.3f} {:>7.3f} {:>8.3f}\n",
      sites, cost.ratio(), kMovingGoal, ns(s.cpu_seconds) / ns_of_one_site, ns(s.cpu_seconds),
      ns(s.seconds_primary), ns(s.seconds_sample), ns(s.seconds_visibility), ns(s.seconds_shade),
      static_cast<double>(s.sampling.pixels_carried) / surface,
      static_cast<double>(s.sampling.pixels_fresh) / surface,
      static_cast<double>(cost.state_bytes) / static_cast<double>(cost.state_pixels),
      cost.seconds_encode / total, cost.seconds_decode / total, cost.seconds_decode_inputs / total);
}

Status run(const std::string& path, int frames) {
  BATON_ASSIGN(JobSpec written, load_job(path));
  written.frames.resize(std::min(written.frames.size(), static_cast<std::size_t>(frames)));
  written.output.aovs.clear();
  if (!moves(written)) set_in_orbit(written);
  BATON_ASSIGN(JobSpec job, settle_motion(std::move(written)));
#if !defined(NDEBUG) || defined(BATON_CHECKED)
  fmt::print("note: assertions are on, the times are not the product's\n");
#endif
  fmt::print(
      "{}: {} x {}, tiles of {}, {} frames, N = {}, P = {}, history up to {} px, {}; ns per pixel "
      "with a surface\n",
      path, job.image.width, job.image.height, job.image.tile_size, job.frames.size(),
      job.sampling.num_particles, job.sampling.num_distributions, history_reach_px(job),
      instruction_set());
  fmt::print(
      "{:>5} {:>6} {:>5} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8}\n",
      "sites", "ratio", "goal", "over 1", "total", "primary", "sample", "rays", "shade", "carried",
      "fresh", "B/pixel", "encode", "decode", "dec. all");
  double ns_of_one_site = 0;
  for (const int sites : {1, 4, 16}) {
    job.image.sites = sites;
    BATON_ASSIGN(const Cost cost, measure(job));
    if (sites == 1) ns_of_one_site = cost.ns_per_pixel(cost.stats.cpu_seconds);
    print_row(sites, cost, ns_of_one_site);
    std::fflush(stdout);
  }
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  const baton::Status status = baton::run(argc > 1 ? argv[1] : "jobs/examples/orbit.json",
                                          argc > 2 ? std::atoi(argv[2]) : 6);
  if (status) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 65;
}
