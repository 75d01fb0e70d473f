// The experiments of [Ghosh & Heidrich 2006] on one scene: error against time and rays, over the
// image and in the penumbra. The light stands still and each frame has its own random numbers, so
// frames are independent renderings of one image. Intervals are 95 % over renderings.
//
// Usage: study_correlated JOB.json [RUNS] [REFERENCE_SAMPLES] [FOLDER]
// FOLDER gets the table as CSV, charts of the error in the penumbra against rays and time, and the
// images of the first rendering.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/files.h"
#include "common/image/image_io.h"
#include "common/job/text/job_json.h"
#include "jobs/study/intervals.h"
#include "jobs/study/svg_chart.h"
#include "worker/exchange/second_pass.h"
#include "worker/pass/render_context.h"
#include "worker/pass/shared_assets.h"

namespace baton {
namespace {

struct Case {
  std::string name;
  Method method = Method::bidirectional;
  int num_particles = 16;
  int num_candidates = 725;
  VisibilitySpec visibility = {};
  std::string curve = {};  ///< name in the charts; none: table only
};

VisibilitySpec second_pass(SecondPassForm form, MaskPolicy mask, int partitions = 16,
                           int dilate = 0) {
  return {.correlated = true,
          .form = form,
          .mask = mask,
          .tile_size = 5,
          .partitions = partitions,
          .dilate = dilate};
}

std::vector<Case> make_cases() {
  using enum SecondPassForm;
  using enum MaskPolicy;
  std::vector<Case> cases{
      {"environment N=64", Method::environment, 64, 725},
      {"mis N=64", Method::mis, 64, 725},
      {"bidirectional N=20 M=800", Method::bidirectional, 20, 800},
      {"bidirectional N=64 M=800", Method::bidirectional, 64, 800},
      {"corrected, split", Method::bidirectional, 16, 725, second_pass(corrected, split)},
      {"corrected, dilated 3x3", Method::bidirectional, 16, 725,
       second_pass(corrected, cross_fold, 16, 1)},
      {"published, same samples", Method::bidirectional, 16, 725,
       second_pass(published, same_samples)},
      {"published-kept, same", Method::bidirectional, 16, 725,
       second_pass(published_kept, same_samples)},
      {"corrected after mis N=64", Method::mis, 64, 725, second_pass(corrected, cross_fold, 4)},
  };
  for (const int n : {8, 12, 16, 24, 32, 48, 64}) {
    cases.push_back({fmt::format("bidirectional N={} M=725", n),
                     Method::bidirectional,
                     n,
                     725,
                     {},
                     "no second pass"});
  }
  for (const int c : {1, 2, 4, 8, 16, 25}) {
    cases.push_back({fmt::format("corrected C={}", c), Method::bidirectional, 16, 725,
                     second_pass(corrected, cross_fold, c), "corrected"});
    cases.push_back({fmt::format("corrected C={}, same", c), Method::bidirectional, 16, 725,
                     second_pass(corrected, same_samples, c), "same-samples mask"});
  }
  for (const int c : {1, 2, 4, 6}) {
    cases.push_back({fmt::format("extra-samples C={}", c), Method::bidirectional, 16, 725,
                     second_pass(extra_samples, cross_fold, c), "extra-samples"});
  }
  return cases;
}

/// One image and its cost.
struct RenderedFrame {
  FilmTile film;
  RenderStats stats;
};

/// Both passes of one frame, as one tile.
Result<RenderedFrame> render(const RenderContext& context, Step step) {
  RenderedFrame rendered;
  FirstPassPtr samples;
  const TileRunSink sink{.film =
                             [&](Step, const FilmTile& film) {
                               rendered.film = film;
                               return Status();
                             },
                         .samples =
                             [&](FirstPassSamples s) {
                               samples = std::make_shared<const FirstPassSamples>(std::move(s));
                               return Status();
                             }};
  BATON_ASSIGN(rendered.stats, run_tile(context, {0, {}, {step, step}}, {}, sink, {}));
  if (!context.job.visibility.correlated) return rendered;
  BATON_ASSIGN(SecondPassOutput second,
               run_second_pass(context, step, 0, rendered.film, std::span(&samples, 1)));
  rendered.film = std::move(second.film);
  rendered.stats.merge(second.stats);
  return rendered;
}

/// The reference: per pixel the radiance, its squared standard error, and whether the pixel lies in
/// the penumbra.
struct Truth {
  FilmTile film;
  std::vector<double> variance;
  std::vector<bool> surface, penumbra;
};
Result<Truth> judge(JobSpec job, int samples) {
  job.sampling.method = Method::reference;
  job.sampling.reference_samples = samples;
  job.frames = {FrameNumber(1)};
  job.seed = 99991;
  job.output.aovs = {Aov::visibility, Aov::depth, Aov::variance};
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  BATON_ASSIGN(const RenderedFrame rendered, render(*context, Step(0)));
  Truth truth{rendered.film, {}, {}, {}};
  for (std::size_t i = 0; i < truth.film.num_pixels(); ++i) {
    const float visibility = truth.film.plane(4)[i];
    truth.surface.push_back(truth.film.plane(5)[i] > 0);
    truth.penumbra.push_back(truth.surface.back() && visibility > 0.02f && visibility < 0.98f);
    truth.variance.push_back(truth.film.plane(6)[i]);
  }
  return truth;
}

/// Mean squared error of the mean over RGB, less the variance of the reference.
struct Errors {
  double image = 0, mask = 0, bias_mask = 0;  ///< bias: relative to the light in the mask
};
Errors compare(const FilmTile& film, const Truth& truth) {
  Errors e;
  double num_surface = 0, num_mask = 0, light = 0, difference = 0;
  for (std::size_t i = 0; i < truth.film.num_pixels(); ++i) {
    if (!truth.surface[i]) continue;
    double got = 0, want = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      got += double{film.plane(c)[i]} / 3;
      want += double{truth.film.plane(c)[i]} / 3;
    }
    const double squared = (got - want) * (got - want) - truth.variance[i];
    e.image += squared;
    ++num_surface;
    if (!truth.penumbra[i]) continue;
    e.mask += squared;
    light += want;
    difference += got - want;
    ++num_mask;
  }
  return {e.image / num_surface, e.mask / num_mask, difference / light};
}

/// What the renderings of a case say. Errors are relative to bidirectional N = 20, M = 800 where
/// they are ratios.
struct Row {
  Case of;
  std::shared_ptr<const RenderContext> context;
  std::vector<double> image, mask, bias, seconds;  ///< (renderings)
  double second_share = 0;                         ///< second pass over all time
  /// Shadow rays per penumbra pixel: all of the second pass, its own of the first.
  double rays = 0;
};
Result<Row> prepare(const JobSpec& base, const Case& c, int runs,
                    const std::shared_ptr<const SharedAssets>& assets) {
  JobSpec job = base;
  job.sampling.method = c.method;
  job.sampling.num_particles = c.num_particles;
  job.sampling.num_candidates = c.num_candidates;
  job.visibility = c.visibility;
  job.frames.clear();
  for (int run = 1; run <= runs; ++run) job.frames.emplace_back(run);
  Row row{.of = c, .context = {}, .image = {}, .mask = {}, .bias = {}, .seconds = {}};
  BATON_ASSIGN(row.context, make_render_context(job, Digest{1, 1}, assets));
  return row;
}

/// One more rendering of a case; the image of the first goes to the folder.
Status add_run(Row& row, const Truth& truth, const std::string& folder) {
  const Step run(static_cast<std::int32_t>(row.image.size()));
  const auto runs = static_cast<double>(row.context->job.frames.size());
  BATON_ASSIGN(const RenderedFrame rendered, render(*row.context, run));
  const Errors e = compare(rendered.film, truth);
  const RenderStats& stats = rendered.stats;
  const double seconds = stats.cpu_seconds - stats.seconds_light;
  row.image.push_back(e.image);
  row.mask.push_back(e.mask);
  row.bias.push_back(e.bias_mask);
  row.seconds.push_back(seconds);
  row.second_share += stats.seconds_second_pass / seconds / runs;
  const double masked = std::max<double>(static_cast<double>(stats.pixels_masked), 1);
  row.rays += (static_cast<double>(stats.rays_second_pass) / masked + row.of.num_particles) / runs;
  if (run > Step(0) || folder.empty()) return {};
  return write_exr(
      std::filesystem::path(folder) / (row.context->job.name + " " + row.of.name + ".exr"),
      rendered.film, {});
}

double root(double squared) { return std::sqrt(std::max(squared, 0.0)); }

/// Mean squared error in the penumbra times cost, `base` over `row`: above 1, `row` is better.
Interval efficiency(const Row& base, const Row& row, double base_cost, double row_cost) {
  const Interval ratio = ratio_interval(base.mask, row.mask);
  const double factor = base_cost / row_cost;
  return {ratio.low * factor, ratio.value * factor, ratio.high * factor};
}

std::string table_line(const Row& base, const Row& row) {
  const Interval mask = mean_interval(row.mask);
  const Interval bias = mean_interval(row.bias);
  const double ms = 1000 * median(row.seconds);
  const Interval by_time = efficiency(base, row, 1000 * median(base.seconds), ms);
  const Interval by_rays = efficiency(base, row, base.rays, row.rays);
  return fmt::format(
      "{:<26} {:>6.1f} {:>4.0f}% {:>6.1f} {:>8.5f} {:>8.5f} [{:.5f}, {:.5f}] {:>+6.2f} [{:+.2f}, "
      "{:+.2f}] {:>5.2f} [{:.2f}, {:.2f}] {:>5.2f} [{:.2f}, {:.2f}]\n",
      row.of.name, ms, 100 * row.second_share, row.rays, root(mean_interval(row.image).value),
      root(mask.value), root(mask.low), root(mask.high), 100 * bias.value, 100 * bias.low,
      100 * bias.high, by_time.value, by_time.low, by_time.high, by_rays.value, by_rays.low,
      by_rays.high);
}

/// The mean squared error in the penumbra against rays or time, one curve a way to spend them.
Chart cost_chart(const std::string& name, const std::vector<Row>& rows, bool against_rays) {
  Chart chart;
  chart.title = name + ": mean squared error in the penumbra";
  chart.x_label = against_rays ? "shadow rays of a penumbra pixel, both passes"
                               : "CPU milliseconds of the picture, both passes";
  chart.y_label = "mean squared error";
  for (const Row& row : rows) {
    if (row.of.curve.empty()) continue;
    const auto same = [&](const ChartSeries& s) { return s.name == row.of.curve; };
    auto at = std::find_if(chart.series.begin(), chart.series.end(), same);
    if (at == chart.series.end()) {
      chart.series.push_back({row.of.curve, static_cast<int>(chart.series.size()), {}});
      at = chart.series.end() - 1;
    }
    const Interval mask = mean_interval(row.mask);
    at->points.push_back({.x = against_rays ? row.rays : 1000 * median(row.seconds),
                          .y = mask.value,
                          .low = mask.low,
                          .high = mask.high,
                          .label = row.of.name});
  }
  return chart;
}

Status write_text(const std::filesystem::path& path, const std::string& text) {
  return write_file_unsynced(path, as_bytes_view(text));
}

Status write_files(const std::filesystem::path& folder, const std::string& name,
                   const std::vector<Row>& rows) {
  std::string csv =
      "case,curve,milliseconds,shareOfSecondPass,rays,mseImage,mseMask,mseMaskLow,"
      "mseMaskHigh,biasMask,biasMaskLow,biasMaskHigh\n";
  for (const Row& row : rows) {
    const Interval mask = mean_interval(row.mask);
    const Interval bias = mean_interval(row.bias);
    csv += fmt::format(
        "\"{}\",\"{}\",{:.2f},{:.3f},{:.1f},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n",
        row.of.name, row.of.curve, 1000 * median(row.seconds), row.second_share, row.rays,
        mean_interval(row.image).value, mask.value, mask.low, mask.high, bias.value, bias.low,
        bias.high);
  }
  BATON_TRY(write_text(folder / (name + ".csv"), csv));
  BATON_TRY(write_text(folder / (name + "-rays.svg"), svg_chart(cost_chart(name, rows, true))));
  return write_text(folder / (name + "-time.svg"), svg_chart(cost_chart(name, rows, false)));
}

Status run(const std::string& path, int runs, int reference_samples, const std::string& folder) {
  BATON_ASSIGN(JobSpec job, load_job(path));
  job.image.tile_size = limits::kMaxTileSize;
  job.state.carry = false;
  job.output.background = Background::transparent;
  job.output.aovs = {Aov::mask};
  BATON_ASSIGN(const Truth truth, judge(job, reference_samples));
  if (!folder.empty()) {
    std::filesystem::create_directories(folder);
    BATON_TRY(
        write_exr(std::filesystem::path(folder) / (job.name + " reference.exr"), truth.film, {}));
  }
  const auto count = [](const std::vector<bool>& of) {
    return static_cast<double>(std::count(of.begin(), of.end(), true));
  };
  fmt::print("{}: {} x {}, penumbra {:.0f} % of the surfaces, {} runs, reference of {} pairs, {}\n",
             job.name, job.image.width, job.image.height,
             100 * count(truth.penumbra) / count(truth.surface), runs, reference_samples,
             instruction_set());
  fmt::print("{:<26} {:>6} {:>5} {:>6} {:>8} {:>8} {:>18} {:>21} {:>18} {:>18}\n", "method", "ms",
             "2nd", "rays", "RMS", "RMS mask", "", "bias in mask, %", "efficiency", "per ray");

  // The cases take turns: what else the machine does meets all of them.
  BATON_ASSIGN(const auto assets, load_shared_assets(job));
  std::vector<Row> rows;
  for (const Case& c : make_cases()) {
    BATON_ASSIGN(Row row, prepare(job, c, runs, assets));
    rows.push_back(std::move(row));
  }
  for (int run = 0; run < runs; ++run) {
    for (Row& row : rows) BATON_TRY(add_run(row, truth, folder));
  }

  // Efficiencies in the penumbra are relative to the paper's single pass.
  const auto base = std::find_if(rows.begin(), rows.end(),
                                 [](const Row& row) { return row.of.num_particles == 20; });
  for (const Row& row : rows) fmt::print("{}", table_line(*base, row));
  return folder.empty() ? Status() : write_files(folder, job.name, rows);
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) {
    return argc > i ? std::atoi(argv[i]) : otherwise;
  };
  const baton::Status status = baton::run(argc > 1 ? argv[1] : "jobs/studies/correlated/fig1.json",
                                          number(2, 20), number(3, 2048), argc > 4 ? argv[4] : "");
  if (status.ok()) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 65;
}
