// Time of the second pass over the time of its own rays (occlusion rays alone, and with the primary
// rays that it traces again), and its share of both passes. CPU seconds of one run, so the ratios
// hold on a noisy machine. Usage: bench_second_pass [JOB.json] [FRAMES [REPEAT]]; REPEAT: second
// passes for each first one.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "common/job/text/job_json.h"
#include "worker/exchange/second_pass.h"
#include "worker/pass/render_context.h"

namespace baton {
namespace {

/// Highest time over the time of the rays that the project accepts.
constexpr double kGoal = 1.6;

/// Both passes of all frames and tiles; blobs go through their file form, outside the clock of the
/// passes.
Result<RenderStats> measure(const JobSpec& job, std::uint64_t& blob_bytes,
                            double& seconds_primary_again, int repeat) {
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  RenderStats total;
  blob_bytes = 0;
  seconds_primary_again = 0;
  for (Step step; step.index() < job.frames.size(); ++step) {
    std::vector<FilmTile> films;
    std::vector<FirstPassPtr> samples;
    const TileRunSink sink{
        .film =
            [&](Step, const FilmTile& film) {
              films.push_back(film);
              return Status();
            },
        .state = [](const SampleState&) { return Status(); },
        .samples = [&](FirstPassSamples s) -> Status {
          blob_bytes += encode_first_pass_samples(s).size();
          samples.push_back(std::make_shared<const FirstPassSamples>(std::move(s)));
          return {};
        }};
    for (std::int32_t tile = 0; tile < context->grid.count(); ++tile) {
      BATON_ASSIGN(const RenderStats stats,
                   run_tile(*context, {tile, Run(0), {step, step}}, {}, sink, {}));
      total.merge(stats);
    }
    for (std::int32_t tile = 0; tile < context->grid.count(); ++tile) {
      std::vector<FirstPassPtr> near;
      for (const std::int32_t t : context->grid.tiles_near(tile, exchange_reach_px(job.visibility)))
        near.push_back(samples[static_cast<std::size_t>(t)]);
      for (int k = 0; k < repeat; ++k) {
        BATON_ASSIGN(
            const SecondPassOutput second,
            run_second_pass(*context, step, tile, films[static_cast<std::size_t>(tile)], near));
        total.merge(second.stats);
        seconds_primary_again += second.seconds_primary_rays;
      }
    }
  }
  return total;
}

int run(const std::string& path, int frames, int repeat) {
  Result<JobSpec> job = load_job(path);
  if (!job) {
    fmt::print(stderr, "{}\n", job.error().message);
    return 65;
  }
  job->frames.resize(std::min(job->frames.size(), static_cast<std::size_t>(frames)));
  job->output.aovs.clear();
  job->sampling.method = Method::bidirectional;
  job->sampling.num_particles = 16;
  job->sampling.num_candidates = 725;
  job->visibility.correlated = true;
  fmt::print("{}: {} x {}, N = 16, M = 725, C = {}, {} frames, {}; goal: at most {}\n", path,
             job->image.width, job->image.height, job->visibility.partitions, job->frames.size(),
             instruction_set(), kGoal);
  fmt::print("{:<6} {:<14} {:<13} {:>9} {:>9} {:>8} {:>9} {:>9} {:>8} {:>9}\n", "sites", "form",
             "mask", "occlusion", "all rays", "masked", "rays/px", "Mrays/s", "share", "bytes/px");
  for (const int sites : {1, 4}) {
    for (const SecondPassForm form :
         {SecondPassForm::corrected, SecondPassForm::published, SecondPassForm::extra_samples}) {
      for (const MaskPolicy mask : {MaskPolicy::same_samples, MaskPolicy::cross_fold}) {
        job->image.sites = sites;
        job->visibility.form = form;
        job->visibility.mask = mask;
        std::uint64_t blob_bytes = 0;
        double primary_again = 0;
        const Result<RenderStats> s = measure(*job, blob_bytes, primary_again, repeat);
        if (!s) {
          fmt::print(stderr, "{}\n", s.error().message);
          return 65;
        }
        const double masked = static_cast<double>(s->pixels_masked) / repeat;
        const double first = s->cpu_seconds - s->seconds_second_pass;
        const double second = s->seconds_second_pass / repeat;
        fmt::print(
            "{:<6} {:<14} {:<13} {:>9.2f} {:>9.2f} {:>7.1f}% {:>9.1f} {:>9.2f} {:>7.1f}% "
            "{:>9.1f}\n",
            sites,
            form == SecondPassForm::corrected   ? "corrected"
            : form == SecondPassForm::published ? "published"
                                                : "extra-samples",
            mask == MaskPolicy::same_samples ? "same-samples" : "cross-fold",
            s->seconds_second_pass / s->seconds_second_rays,
            s->seconds_second_pass / (s->seconds_second_rays + primary_again),
            100 * masked / static_cast<double>(s->pixels - s->pixels_background),
            static_cast<double>(s->rays_second_pass) / repeat / masked,
            static_cast<double>(s->rays_second_pass) / s->seconds_second_rays * 1e-6,
            100 * second / (first + second),
            static_cast<double>(blob_bytes) / static_cast<double>(s->pixels));
      }
    }
  }
  return 0;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  return baton::run(argc > 1 ? argv[1] : "jobs/examples/demo.json",
                    argc > 2 ? std::atoi(argv[2]) : 2, argc > 3 ? std::atoi(argv[3]) : 1);
}
