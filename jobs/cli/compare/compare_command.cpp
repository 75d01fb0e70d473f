#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <thread>

#include "common/image/contact_sheet.h"
#include "common/image/image_io.h"
#include "common/image/noise.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"
#include "common/scene/settle/settle_motion.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/farm_job_runner.h"
#include "jobs/cli/frame_sheet.h"
#include "jobs/cli/job_argument.h"
#include "jobs/cli/say.h"
#include "jobs/cli/settle_method.h"
#include "jobs/cli/text.h"
#include "jobs/study/as_shown.h"
#include "jobs/study/flip.h"
#include "jobs/study/measured_frame.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Two more seeds render so many frames, of which the last ones tell the noise: by then what is
/// carried has settled.
constexpr std::size_t kSeedFrames = 12, kNoiseFrames = 4;
constexpr std::size_t kSheetColumns = 6;

struct CompareOptions {
  std::vector<std::string> jobs;
  JobArgument changes;  ///< of all jobs, without a file
  /// empty: FILE-compared beside the first job, with -look behind it where something is changed.
  std::string output;
  std::string sheet;  ///< empty: comparison.png in the folder
  bool noise = false;
  bool restart = false;
  int workers = 1;
};

/// Of a job's frames, by two seeds.
struct Noise {
  double relative = 0;  ///< FrameNoise::relative(), rms over frames
  /// Of one seed: means over frames; of worst blocks, the largest.
  ErrorAsShown shown{};
  double flip = 0;  ///< mean LDR-FLIP of the two seeds
};

/// One of the jobs and what was seen of it.
struct Compared {
  JobSpec job;
  /// Two for its noise, where that is measured.
  std::vector<JobSpec> seeds{};
  JobSummary summary{};
  Noise noise{};
};

/// The first frames of job `number` with another seed, whose sites are its own.
JobSpec with_seed(JobSpec job, std::size_t number, std::uint64_t more, const fs::path& folder) {
  job.image.site_seed = 0;
  job.seed += more;
  job.frames.resize(std::min(job.frames.size(), kSeedFrames));
  job.name = fmt::format("job {} seed {}", number + 1, job.seed);
  job.output.directory = folder / job.name;
  job.output.background = Background::transparent;
  job.output.aovs.clear();
  job.output.pixel_type = PixelType::full_float;
  job.output.clamp_negative = false;
  job.output.is_look = false;
  return job;
}

/// The job as it is, but for its folder: the frames that somebody has rendered stay.
Result<Compared> load(const CompareOptions& options, std::size_t number, const fs::path& output,
                      const FarmOptions& farm) {
  JobArgument argument = options.changes;
  argument.file = options.jobs[number];
  BATON_ASSIGN(JobSpec written, load_job(argument.file, overrides_of(argument)));
  Compared compared;
  std::vector<std::string> left_out;
  BATON_ASSIGN(compared.job, settle_motion(std::move(written), &left_out));
  for (const std::string& line : left_out) spdlog::warn("{}", line);
  BATON_TRY(settle_method(compared.job, farm));
  compared.job.output.directory = output / compared.job.name;
  compared.job.output.is_look = true;
  for (std::size_t seed = 1; options.noise && seed <= 2; ++seed)
    compared.seeds.push_back(with_seed(compared.job, number, seed, farm.work_directory));
  return compared;
}

/// Frames are compared one by one, and each job has a row of its own.
Status check_alike(const std::vector<Compared>& jobs, const CompareOptions& options) {
  const JobSpec& first = jobs.front().job;
  for (std::size_t i = 1; i < jobs.size(); ++i) {
    const JobSpec& job = jobs[i].job;
    const auto differ = [&](const char* key, const std::string& what) {
      return Error{ErrorKind::bad_input, fmt::format("{}: $.{}: expected {} {}", options.jobs[i],
                                                     key, what, options.jobs.front())};
    };
    if (job.frames != first.frames) return differ("frames", "those of");
    const PixelRect image = job.image.shown(), first_image = first.image.shown();
    if (image.width() != first_image.width() || image.height() != first_image.height())
      return differ("image", "the size of that of");
    for (std::size_t j = 0; j < i; ++j) {
      if (jobs[j].job.name == job.name) return differ("name", "another than that of");
    }
  }
  return {};
}

/// The mean difference that a person sees between two pictures, where the first has a surface.
double flip_of(const FilmTile& first, const FilmTile& second) {
  const RgbImage image = image_of(first);
  const float exposure = auto_exposure(image);
  const std::vector<float> flip =
      flip_difference(tone_map(image, exposure), tone_map(image_of(second), exposure));
  const float* const coverage = first.find("A");
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < flip.size(); ++i) {
    if (!(coverage[i] > 0)) continue;
    sum += flip[i];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

/// All that two pictures of one frame tell; `relative` is squared.
Noise noise_of(const FilmTile& first, const FilmTile& second) {
  const double relative = noise_of_seeds(first, second).relative();
  const float* const coverage = first.find("A");
  const ReferenceAsShown both(image_of(first), image_of(second),
                              {coverage, coverage + first.num_pixels()});
  return {relative * relative, both.noise_of_half(), flip_of(first, second)};
}

Result<Noise> noise_of(const Compared& compared) {
  const FrameIndex end(static_cast<std::int32_t>(compared.seeds[0].frames.size()));
  const FrameIndex begin = std::max(end - static_cast<std::int32_t>(kNoiseFrames), FrameIndex());
  const double share = 1.0 / (end - begin);
  Noise all;
  for (FrameIndex f = begin; f < end; ++f) {
    BATON_ASSIGN(const FilmTile first, read_exr(frame_path(compared.seeds[0], f)));
    BATON_ASSIGN(const FilmTile second, read_exr(frame_path(compared.seeds[1], f)));
    const Noise noise = noise_of(first, second);
    all.relative += share * noise.relative;
    all.flip += share * noise.flip;
    all.shown.mse += share * noise.shown.mse;
    all.shown.darkest_mse += share * noise.shown.darkest_mse;
    all.shown.worst_block_mse = std::max(all.shown.worst_block_mse, noise.shown.worst_block_mse);
    all.shown.percentile_99_9 += share * noise.shown.percentile_99_9;
    all.shown.black += share * noise.shown.black;
  }
  all.relative = std::sqrt(all.relative);
  return all;
}

/// A row of frames for each job.
Status write_rows(const std::vector<Compared>& jobs, const fs::path& path) {
  const std::vector<FrameNumber> frames = pick_frames(jobs.front().job.frames, kSheetColumns);
  std::vector<RgbImage> thumbnails;
  std::vector<FrameNumber> numbers;
  for (const Compared& compared : jobs) {
    const OutputSpec& out = compared.job.output;
    for (const FrameNumber frame : frames) {
      BATON_ASSIGN(RgbImage thumbnail, read_thumbnail(fs::path(out.directory) /
                                                      frame_file_name(out.pattern, frame.value())));
      thumbnails.push_back(std::move(thumbnail));
      numbers.push_back(frame);
    }
  }
  return write_sheet(path, std::move(thumbnails), numbers, static_cast<int>(frames.size()), {});
}

/// As people see it, in steps of 255.
void print_noise(const std::vector<Compared>& jobs, std::size_t width) {
  constexpr double kSteps = 255;
  say("{:<{}}  {:>7}  {:>8}  {:>8}  {:>11}  {:>8}  {:>9}  {:>6}\n", "noise", width, "linear",
      "as shown", "darkest", "worst block", "99.9 %", "black", "FLIP");
  for (const Compared& compared : jobs) {
    const Noise& noise = compared.noise;
    say("{:<{}}  {:>5.3g} %  {:>8.2f}  {:>8.2f}  {:>11.2f}  {:>8.1f}  {:>7.2g} %  {:>6.3f}\n",
        compared.job.name, width, 100 * noise.relative, kSteps * std::sqrt(noise.shown.mse),
        kSteps * std::sqrt(noise.shown.darkest_mse),
        kSteps * std::sqrt(noise.shown.worst_block_mse), kSteps * noise.shown.percentile_99_9,
        100 * noise.shown.black, noise.flip);
  }
  say("By two more seeds and their sites. linear: a pixel's standard deviation, rms, over the mean "
      "radiance.\n"
      "As shown, in steps of 255: after exposure and sRGB, rms over all pixels, the darkest "
      "quarter, the worst\n"
      "16 x 16 pixels; the deviation that one pixel in 1,000 exceeds; pixels that are black in one "
      "seed alone;\n"
      "FLIP between the seeds\n");
}

std::string bounces_text(int bounces) {
  return bounces == 0
             ? std::string("direct light alone")
             : fmt::format("light by up to {} surfaces beside the one that is seen", bounces);
}

void print_table(const std::vector<Compared>& jobs, bool with_noise, const fs::path& sheet) {
  std::size_t width = 5;
  for (const Compared& compared : jobs) width = std::max(width, compared.job.name.size());
  say("{:<{}}  {:>9}  {:>11}  {}\n", "job", width, "CPU", "handed on", "frames");
  for (const Compared& compared : jobs) {
    say("{:<{}}  {:>7.1f} s  {:>11}  {}/{}\n", compared.job.name, width,
        compared.summary.stats.cpu_seconds, bytes_text(compared.summary.state_bytes),
        compared.job.output.directory, compared.job.output.pattern);
  }
  say("handed on: sample state, packed, from frame to frame\n");
  std::set<int> bounces;
  for (const Compared& compared : jobs) bounces.insert(compared.job.light.bounces);
  for (const Compared& compared : jobs) {
    if (bounces.size() > 1)
      say("{:<{}}  {}\n", compared.job.name, width, bounces_text(compared.job.light.bounces));
  }
  if (with_noise) print_noise(jobs, width);
  say("sheet, a row for each job: {}\n", sheet.string());
}

fs::path output_folder(const CompareOptions& options) {
  if (!options.output.empty()) return fs::absolute(options.output);
  const fs::path first = fs::absolute(options.jobs.front());
  const char* const look = overrides_of(options.changes).empty() ? "" : "-look";
  return first.parent_path() / (first.stem().string() + "-compared" + look);
}

Result<ExitCode> run_compare(const CompareOptions& options) {
  const fs::path output = output_folder(options);
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const FarmOptions farm{.workers = options.workers,
                         .threads_per_worker = std::max(1, processors / options.workers),
                         .work_directory = output / ".baton"};
  std::vector<Compared> jobs;
  for (std::size_t number = 0; number < options.jobs.size(); ++number) {
    BATON_ASSIGN(Compared compared, load(options, number, output, farm));
    jobs.push_back(std::move(compared));
  }
  BATON_TRY(check_alike(jobs, options));

  // Render all of them, and with their other seeds.
  std::vector<JobSpec> all;
  for (const Compared& compared : jobs) all.push_back(compared.job);
  for (const Compared& compared : jobs)
    all.insert(all.end(), compared.seeds.begin(), compared.seeds.end());
  {
    FarmJobRunner runner(farm);
    if (options.restart) runner.restart_looks();
    const Status rendered = runner.run(all, [&](std::size_t index, const JobSummary& summary) {
      if (index < jobs.size()) jobs[index].summary = summary;
      return Status();
    });
    if (!rendered) {
      if (rendered.error().kind == ErrorKind::cancelled)
        spdlog::info("stopped; finished work is kept, the same command goes on");
      return rendered.error();
    }
  }

  for (Compared& compared : jobs) {
    if (!options.noise) continue;
    BATON_ASSIGN(compared.noise, noise_of(compared));
  }
  const fs::path sheet =
      options.sheet.empty() ? output / "comparison.png" : fs::path(options.sheet);
  BATON_TRY(write_rows(jobs, sheet));
  print_table(jobs, options.noise, sheet);
  return ExitCode::ok;
}

}  // namespace

void add_compare_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command = app.add_subcommand(
      "compare", "Renders jobs of the same frames into one folder and sets them side by side");
  command->add_option("JOBS", options->jobs, "two to eight job files, of the same frames and size")
      ->required()
      ->expected(2, 8);
  add_override_options(*command, options->changes);
  command->add_flag("--noise", options->noise,
                    "also measures noise, by two more seeds of the first twelve frames");
  command->add_option("--out", options->sheet,
                      "the sheet as PNG; default: comparison.png in the folder of --output");
  command->add_option("--output", options->output,
                      "folder of frames and sheet; default: FILE-compared beside the first job, "
                      "with -look behind it where options change the jobs");
  command->add_flag("--restart", options->restart,
                    "replace pictures in the folder that no comparison has made");
  command->add_option("--workers", options->workers, "worker processes; default: 1")
      ->check(CLI::Range(1, 256));
  command->footer(
      "Example:\n"
      "  baton compare papers.json pool.json --noise\n"
      "  baton compare papers.json pool.json --frames 12 --scale .25 --out look.png\n"
      "Ctrl-C stops; the same command goes on where it stopped.");
  command->callback([options, &code] { code = finish_with_coordinator(run_compare(*options)); });
}

}  // namespace baton
