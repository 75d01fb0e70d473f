// Time per pixel of every method over the time of its own occlusion rays alone, on a real scene.
// Both times are CPU seconds of one run, so the ratios hold on a noisy machine. Reading the maps
// and tracing the primary rays of a still camera are paid once for all frames. Usage: bench_methods
// [JOB.json] [FRAMES] [METHODS THAT BEGIN SO, or "further site"] [SITES]
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "common/job/text/job_json.h"
#include "worker/pass/render_context.h"

namespace baton {
namespace {

struct Case {
  std::string name;
  SamplingSpec sampling;
  /// Highest ratio that the project accepts; 0: none.
  double goal = 0;
};

std::vector<Case> make_cases() {
  std::vector<Case> cases;
  const auto add = [&](std::string name, Method method, double goal, auto change) {
    SamplingSpec spec;
    spec.method = method;
    spec.num_particles = 16;
    change(spec);
    cases.push_back({std::move(name), spec, goal});
  };
  const auto keep = [](SamplingSpec&) {};
  add("environment", Method::environment, 0, keep);
  add("brdf", Method::brdf, 0, keep);
  add("mis", Method::mis, 0, keep);
  add("bidirectional M=128", Method::bidirectional, 2.2,
      [](SamplingSpec& s) { s.num_candidates = 128; });
  add("bidirectional M=800", Method::bidirectional, 3.5,
      [](SamplingSpec& s) { s.num_candidates = 800; });
  add("pool M=32", Method::pool, 2.2, [](SamplingSpec& s) { s.num_candidates = 32; });
  add("pool M=64", Method::pool, 2.2, [](SamplingSpec& s) { s.num_candidates = 64; });
  add("pool M=128", Method::pool, 2.2, [](SamplingSpec& s) { s.num_candidates = 128; });
  add("pool M=256", Method::pool, 2.2, [](SamplingSpec& s) { s.num_candidates = 256; });
  add("sequential P=1", Method::sequential, 0, [](SamplingSpec& s) { s.num_distributions = 1; });
  add("sequential P=5", Method::sequential, 2.0, [](SamplingSpec& s) { s.num_distributions = 5; });
  add("sequential P=5 path", Method::sequential, 2.0, [](SamplingSpec& s) {
    s.num_distributions = 5;
    s.lns_update = LnsUpdate::path_trapezoid;
  });
  return cases;
}

Result<RenderStats> measure(const JobSpec& job) {
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  RenderStats total;
  const TileRunSink sink{[](Step, const FilmTile&) { return Status(); },
                         [](const SampleState&) { return Status(); }};
  for (std::int32_t tile = 0; tile < context->grid.count(); ++tile) {
    BATON_ASSIGN(const RenderStats stats,
                 run_tile(*context, tile_run(job, tile, Run(0)), {}, sink, {}));
    total.merge(stats);
  }
  return total;
}

void print_row(const Case& c, const RenderStats& s) {
  const double pixels = static_cast<double>(s.pixels - s.pixels_background);
  const double ratio = s.cpu_seconds / s.seconds_visibility;
  const auto proposed =
      static_cast<double>(s.sampling.local_proposed + s.sampling.independent_proposed);
  const auto ns = [&](double seconds) { return seconds / pixels * 1e9; };
  fmt::print(
      "{:<22} {:>6.2f} {:>6} {:>9.0f} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.0f} {:>8.2f} "
      "{:>7.3f}\n",
      c.name, ratio, c.goal > 0 ? fmt::format("{:.1f}", c.goal) : "-", ns(s.cpu_seconds),
      ns(s.seconds_light), ns(s.seconds_primary), ns(s.seconds_sample), ns(s.seconds_visibility),
      ns(s.seconds_shade), static_cast<double>(s.rays_shadow) / s.seconds_visibility * 1e-6,
      proposed > 0
          ? static_cast<double>(s.sampling.local_accepted + s.sampling.independent_accepted) /
                proposed
          : 0.0);
}

/// What each of 16 sites takes that 4 do not, where all rounds have sites of their own; `pool`.
Status print_further_site(JobSpec job) {
  job.frames.resize(1);
  job.state.preroll = 0;
  job.quality.rounds = 16;
  job.sampling = {.method = Method::pool, .num_particles = 16, .num_candidates = 128};
  std::array<RenderStats, 2> stats;
  for (std::size_t i = 0; i < 2; ++i) {
    job.image.sites = i == 0 ? 4 : 16;
    BATON_ASSIGN(stats[i], measure(job));
  }
  const double further =
      12.0 * job.quality.rounds * static_cast<double>(job.image.width) * job.image.height;
  const double rays = stats[1].seconds_primary - stats[0].seconds_primary;
  const double all = stats[1].cpu_seconds - stats[0].cpu_seconds;
  fmt::print("\na further site of a pixel: {:.0f} ns, {:.0f} of them primary rays (goal 70, 50)\n",
             all / further * 1e9, rays / further * 1e9);
  return {};
}

int run(const std::string& path, int frames, const std::string& only, int only_sites) {
  Result<JobSpec> job = load_job(path);
  if (!job) {
    fmt::print(stderr, "{}\n", job.error().message);
    return 65;
  }
  job->frames.resize(std::min(job->frames.size(), static_cast<std::size_t>(frames)));
  job->state.checkpoint_every = frames;
  job->output.aovs.clear();
#if !defined(NDEBUG) || defined(BATON_CHECKED)
  fmt::print("note: assertions are on, the times are not the product's\n");
#endif
  constexpr std::string_view kFurther = "further site";
  for (const int sites : {1, 4, 16}) {
    if ((only_sites > 0 && sites != only_sites) || only == kFurther) continue;
    job->image.sites = sites;
    fmt::print("\n{}: {} x {}, {} site(s), {} frames, {}; ns per pixel with a surface\n", path,
               job->image.width, job->image.height, sites, job->frames.size(), instruction_set());
    fmt::print("{:<22} {:>6} {:>6} {:>9} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7}\n", "method",
               "ratio", "goal", "total", "light", "primary", "sample", "rays", "shade", "Mrays/s",
               "accept");
    for (const Case& c : make_cases()) {
      if (!c.name.starts_with(only)) continue;
      job->sampling = c.sampling;
      const Result<RenderStats> stats = measure(*job);
      if (!stats) {
        fmt::print(stderr, "{}\n", stats.error().message);
        return 65;
      }
      print_row(c, *stats);
    }
  }
  const Status further = kFurther.starts_with(only) ? print_further_site(*job) : Status();
  if (!further) fmt::print(stderr, "{}\n", further.error().message);
  return further ? 0 : 65;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  return baton::run(argc > 1 ? argv[1] : "jobs/examples/demo.json",
                    argc > 2 ? std::atoi(argv[2]) : 16, argc > 3 ? argv[3] : "",
                    argc > 4 ? std::atoi(argv[4]) : 0);
}
