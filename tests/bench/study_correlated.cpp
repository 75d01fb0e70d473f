// The experiments of [Ghosh & Heidrich 2006] on one scene: error against time and rays, over the
// image and in the penumbra. The light stands still and each frame has its own random numbers, so
// frames are independent runs of one picture. Usage: study_correlated JOB.json [RUNS]
// [REFERENCE_SAMPLES] [FOLDER for pictures]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/job/job_json.h"
#include "worker/pass/render_context.h"
#include "worker/pass/second_pass.h"

namespace baton {
namespace {

struct Case {
  std::string name;
  Method method = Method::bidirectional;
  int num_particles = 16;
  int num_candidates = 725;
  VisibilitySpec visibility = {};
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
      {"bidirectional N=16 M=725", Method::bidirectional, 16, 725},
      {"bidirectional N=64 M=800", Method::bidirectional, 64, 800},
      {"corrected, same samples", Method::bidirectional, 16, 725,
       second_pass(corrected, same_samples)},
      {"corrected, split", Method::bidirectional, 16, 725, second_pass(corrected, split)},
      {"corrected, cross-fold", Method::bidirectional, 16, 725, second_pass(corrected, cross_fold)},
      {"corrected, dilated 3x3", Method::bidirectional, 16, 725,
       second_pass(corrected, cross_fold, 16, 1)},
      {"published, same samples", Method::bidirectional, 16, 725,
       second_pass(published, same_samples)},
      {"published-kept, same", Method::bidirectional, 16, 725,
       second_pass(published_kept, same_samples)},
      {"corrected after mis N=64", Method::mis, 64, 725, second_pass(corrected, cross_fold, 4)},
  };
  for (const int c : {1, 2, 4, 8}) {
    cases.push_back({fmt::format("corrected C={}", c), Method::bidirectional, 16, 725,
                     second_pass(corrected, cross_fold, c)});
  }
  for (const int c : {1, 2, 4}) {
    cases.push_back({fmt::format("extra-samples C={}", c), Method::bidirectional, 16, 725,
                     second_pass(extra_samples, cross_fold, c)});
  }
  return cases;
}

/// One picture and its cost.
struct Picture {
  FilmTile film;
  RenderStats stats;
};

/// Both passes of one frame, as one tile.
Result<Picture> render(const RenderContext& context, std::int32_t frame) {
  Picture picture;
  FirstPassPtr samples;
  const TileRunSink sink{.film =
                             [&](int, const FilmTile& film) {
                               picture.film = film;
                               return Status();
                             },
                         .samples =
                             [&](FirstPassSamples s) {
                               samples = std::make_shared<const FirstPassSamples>(std::move(s));
                               return Status();
                             }};
  BATON_ASSIGN(picture.stats, run_tile(context, {0, 0, frame, frame}, {}, sink, {}));
  picture.stats.cpu_seconds -= picture.stats.seconds_light;
  if (!context.job.visibility.correlated) return picture;
  BATON_ASSIGN(SecondPassOutput second,
               run_second_pass(context, frame, 0, picture.film, std::span(&samples, 1)));
  picture.film = std::move(second.film);
  picture.stats.merge(second.stats);
  return picture;
}

/// The judge: per pixel the radiance, its squared standard error, and whether the pixel lies in the
/// penumbra.
struct Truth {
  FilmTile film;
  std::vector<double> variance;
  std::vector<bool> surface, penumbra;
};
Result<Truth> judge(JobSpec job, int samples) {
  job.sampling.method = Method::reference;
  job.sampling.reference_samples = samples;
  job.frames = {1};
  job.seed = 99991;
  job.output.aovs = {Aov::visibility, Aov::depth, Aov::variance};
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  BATON_ASSIGN(const Picture picture, render(*context, 0));
  Truth truth{picture.film, {}, {}, {}};
  for (std::size_t i = 0; i < truth.film.num_pixels(); ++i) {
    const float visibility = truth.film.plane(4)[i];
    truth.surface.push_back(truth.film.plane(5)[i] > 0);
    truth.penumbra.push_back(truth.surface.back() && visibility > 0.02f && visibility < 0.98f);
    truth.variance.push_back(truth.film.plane(6)[i]);
  }
  return truth;
}

/// Mean squared error of the mean over RGB, with what the judge itself misses taken off.
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

struct Row {
  Errors mse;
  double bias_error = 0;    ///< standard error of the bias
  double seconds = 0;       ///< CPU, a picture
  double second_share = 0;  ///< of the second pass in it
  double rays =
      0;  ///< shadow rays per penumbra pixel: all of the second pass, the pixel's own of the first
};
Result<Row> measure(const JobSpec& base, const Case& c, const Truth& truth, int runs,
                    const std::string& folder) {
  JobSpec job = base;
  job.sampling.method = c.method;
  job.sampling.num_particles = c.num_particles;
  job.sampling.num_candidates = c.num_candidates;
  job.visibility = c.visibility;
  job.frames.clear();
  for (int run = 1; run <= runs; ++run) job.frames.push_back(run);
  BATON_ASSIGN(const auto context, load_render_context(job, Digest{1, 1}));
  Row row;
  double bias_squares = 0;
  for (int run = 0; run < runs; ++run) {
    BATON_ASSIGN(const Picture picture, render(*context, run));
    const Errors e = compare(picture.film, truth);
    row.mse.image += e.image / runs;
    row.mse.mask += e.mask / runs;
    row.mse.bias_mask += e.bias_mask / runs;
    bias_squares += e.bias_mask * e.bias_mask / runs;
    row.seconds += picture.stats.cpu_seconds / runs;
    row.second_share += picture.stats.seconds_second_pass / picture.stats.cpu_seconds / runs;
    const double masked = std::max<double>(static_cast<double>(picture.stats.pixels_masked), 1);
    row.rays +=
        (static_cast<double>(picture.stats.rays_second_pass) / masked + c.num_particles) / runs;
    if (run == 0 && !folder.empty()) {
      BATON_TRY(write_exr(std::filesystem::path(folder) / (base.name + " " + c.name + ".exr"),
                          picture.film, {}));
    }
  }
  row.bias_error = std::sqrt(std::max(bias_squares - row.mse.bias_mask * row.mse.bias_mask, 0.0) /
                             std::max(runs - 1, 1));
  return row;
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
  fmt::print("{:<26} {:>8} {:>7} {:>7} {:>9} {:>9} {:>16} {:>8} {:>8}\n", "method", "ms", "pass 2",
             "rays", "RMS", "RMS mask", "bias in mask", "eff", "per ray");

  // Efficiencies in the penumbra are relative to bidirectional N = 20, M = 800.
  std::vector<std::pair<Case, Row>> rows;
  double unit_time = 0, unit_rays = 0;
  for (const Case& c : make_cases()) {
    BATON_ASSIGN(const Row row, measure(job, c, truth, runs, folder));
    if (c.num_particles == 20) {
      unit_time = row.mse.mask * row.seconds;
      unit_rays = row.mse.mask * row.rays;
    }
    rows.emplace_back(c, row);
  }
  for (const auto& [c, row] : rows) {
    fmt::print(
        "{:<26} {:>8.1f} {:>6.0f}% {:>7.1f} {:>9.5f} {:>9.5f} {:>+8.2f} ± {:.2f} % {:>8.2f} "
        "{:>8.2f}\n",
        c.name, 1000 * row.seconds, 100 * row.second_share, row.rays,
        std::sqrt(std::max(row.mse.image, 0.0)), std::sqrt(std::max(row.mse.mask, 0.0)),
        100 * row.mse.bias_mask, 196 * row.bias_error, unit_time / (row.mse.mask * row.seconds),
        unit_rays / (row.mse.mask * row.rays));
  }
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  const auto number = [&](int i, int fallback) { return argc > i ? std::atoi(argv[i]) : fallback; };
  const baton::Status done = baton::run(argc > 1 ? argv[1] : "jobs/studies/correlated/fig1.json",
                                        number(2, 16), number(3, 4096), argc > 4 ? argv[4] : "");
  if (done) return 0;
  fmt::print(stderr, "{}\n", done.error().message);
  return 65;
}
