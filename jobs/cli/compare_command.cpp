#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <thread>

#include "common/base/limits.h"
#include "common/image/contact_sheet.h"
#include "common/job/job_json.h"
#include "common/job/sequence.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/farm_job_runner.h"
#include "jobs/cli/settle_method.h"
#include "jobs/cli/text.h"
#include "jobs/study/picture.h"
#include "worker/scene/settle_motion.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Two more seeds render so many frames, of which the last ones tell the noise: by then what is
/// carried has settled.
constexpr std::size_t kSeedFrames = 12, kNoiseFrames = 4;
/// Pixels of which both see the same: their sites lie elsewhere, and what that changes is no noise
/// of a method.
constexpr float kMaxTurn = 0.05f, kMaxDepthRatio = 0.01f;
constexpr std::size_t kSheetColumns = 6;
constexpr int kThumbWidth = 320;

struct CompareOptions {
  std::vector<std::string> jobs;
  std::string output;  ///< empty: NAME-compared beside the first job
  int workers = 1;
};

/// One of the jobs and what was seen of it.
struct Compared {
  JobSpec job;
  std::array<JobSpec, 2> seeds;  ///< for its noise
  JobSummary summary;
  double noise = 0;  ///< relative standard deviation of a pixel, rms over pixels
};

JobSpec with_seed(JobSpec job, std::uint64_t more, const fs::path& folder) {
  job.seed += more;
  job.frames.resize(std::min(job.frames.size(), kSeedFrames));
  job.name = fmt::format("{} seed {}", job.name.substr(0, limits::kMaxNameLength / 2), job.seed);
  job.output.directory = folder / job.name;
  job.output.background = Background::transparent;
  job.output.aovs = {Aov::normal, Aov::depth};
  job.output.pixel_type = PixelType::full_float;
  return job;
}

Result<Compared> load(const std::string& path, const FarmOptions& farm) {
  BATON_ASSIGN(JobSpec written, load_job(path));
  Compared compared;
  BATON_ASSIGN(compared.job, settle_motion(std::move(written)));
  BATON_TRY(settle_method(compared.job, farm));
  for (std::size_t i = 0; i < compared.seeds.size(); ++i)
    compared.seeds[i] = with_seed(compared.job, i + 1, farm.work_directory);
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
    if (job.image.width != first.image.width || job.image.height != first.image.height)
      return differ("image", "the size of that of");
    for (std::size_t j = 0; j < i; ++j) {
      if (jobs[j].job.output.directory == job.output.directory)
        return differ("output.directory", "another than that of");
      if (jobs[j].job.name == job.name) return differ("name", "another than that of");
    }
  }
  return {};
}

/// A frame's planes by name.
class Planes {
 public:
  explicit Planes(const FilmTile& film) : film_(film) {}
  float at(const char* channel, std::size_t pixel) const {
    const auto found = std::find(film_.channels.begin(), film_.channels.end(), channel);
    return film_.plane(static_cast<std::size_t>(found - film_.channels.begin()))[pixel];
  }
  Vec3 three(const char* x, const char* y, const char* z, std::size_t pixel) const {
    return {at(x, pixel), at(y, pixel), at(z, pixel)};
  }

 private:
  const FilmTile& film_;
};

bool see_the_same(const Planes& a, const Planes& b, std::size_t pixel) {
  if (a.at("A", pixel) < 1 || b.at("A", pixel) < 1) return false;
  const auto normal = [&](const Planes& of) {
    return of.three("normal.X", "normal.Y", "normal.Z", pixel);
  };
  const float depth = a.at("depth", pixel);
  return length(normal(a) - normal(b)) < kMaxTurn &&
         std::abs(b.at("depth", pixel) - depth) < kMaxDepthRatio * depth;
}

/// From the difference of two seeds, which has twice the variance of one.
Result<double> noise_of(const Compared& compared) {
  const auto count = static_cast<std::int32_t>(compared.seeds[0].frames.size());
  double squares = 0, pixels = 0;
  for (std::int32_t f = std::max(count - static_cast<std::int32_t>(kNoiseFrames), 0); f < count;
       ++f) {
    BATON_ASSIGN(const FilmTile first, read_exr(frame_path(compared.seeds[0], f)));
    BATON_ASSIGN(const FilmTile second, read_exr(frame_path(compared.seeds[1], f)));
    const Planes a(first), b(second);
    for (std::size_t i = 0; i < first.num_pixels(); ++i) {
      if (!see_the_same(a, b, i)) continue;
      const Vec3 x = a.three("R", "G", "B", i), y = b.three("R", "G", "B", i);
      const double relative = (mean(x) - mean(y)) / ((mean(x) + mean(y)) / 2 + kRelativeFloor);
      squares += relative * relative / 2;
      pixels += 1;
    }
  }
  return pixels > 0 ? std::sqrt(squares / pixels) : 0.0;
}

/// A row of frames for each job, all at one exposure.
Status write_sheet(const std::vector<Compared>& jobs, const fs::path& path) {
  const std::vector<int>& frames = jobs.front().job.frames;
  const std::size_t columns = std::min(frames.size(), kSheetColumns);
  std::vector<RgbImage> cells;
  for (const Compared& compared : jobs) {
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t index = columns > 1 ? c * (frames.size() - 1) / (columns - 1) : 0;
      BATON_ASSIGN(const RgbImage image,
                   read_rgb_image(frame_path(compared.job, static_cast<std::int32_t>(index))));
      cells.push_back(resize(image, std::min(image.width, kThumbWidth)));
    }
  }
  const float exposure = auto_exposure(cells[columns / 2]);
  for (RgbImage& cell : cells) cell = tone_map(cell, exposure);
  return write_png(path, contact_sheet(cells, static_cast<int>(columns), cells.front().width));
}

void print_table(const std::vector<Compared>& jobs, const fs::path& sheet) {
  std::size_t width = 4;
  for (const Compared& compared : jobs) width = std::max(width, compared.job.name.size());
  fmt::print("{:<{}}  {:>9}  {:>7}  {:>11}  {}\n", "job", width, "CPU", "noise", "handed on",
             "frames");
  for (const Compared& compared : jobs) {
    fmt::print("{:<{}}  {:>7.1f} s  {:>7.4f}  {:>11}  {}/{}\n", compared.job.name, width,
               compared.summary.stats.cpu_seconds, compared.noise,
               bytes_text(compared.summary.state_bytes), compared.job.output.directory,
               compared.job.output.pattern);
  }
  fmt::print(
      "noise: relative standard deviation of a pixel, from two more seeds; handed on: from frame "
      "to "
      "frame\n");
  fmt::print("sheet, a row for each job: {}\n", sheet.string());
}

Result<ExitCode> run_compare(const CompareOptions& options) {
  const fs::path first = fs::absolute(options.jobs.front());
  const fs::path output = options.output.empty()
                              ? first.parent_path() / (first.stem().string() + "-compared")
                              : fs::absolute(options.output);
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const FarmOptions farm{.workers = options.workers,
                         .threads_per_worker = std::max(1, processors / options.workers),
                         .work_directory = output / ".baton"};
  std::vector<Compared> jobs;
  for (const std::string& path : options.jobs) {
    BATON_ASSIGN(Compared compared, load(path, farm));
    jobs.push_back(std::move(compared));
  }
  BATON_TRY(check_alike(jobs, options));

  // Render all of them, and each with two more seeds.
  std::vector<JobSpec> all;
  for (const Compared& compared : jobs) all.push_back(compared.job);
  for (const Compared& compared : jobs)
    all.insert(all.end(), compared.seeds.begin(), compared.seeds.end());
  {
    FarmJobRunner runner(farm);
    BATON_TRY(runner.run(all, [&](std::size_t index, const JobSummary& summary) {
      if (index < jobs.size()) jobs[index].summary = summary;
      return Status();
    }));
  }

  for (Compared& compared : jobs) {
    BATON_ASSIGN(compared.noise, noise_of(compared));
  }
  const fs::path sheet = output / "comparison.png";
  BATON_TRY(write_sheet(jobs, sheet));
  print_table(jobs, sheet);
  return ExitCode::ok;
}

}  // namespace

void add_compare_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command =
      app.add_subcommand("compare", "Renders jobs of the same frames and sets them side by side");
  command->add_option("JOBS", options->jobs, "job files with alike frames")
      ->required()
      ->expected(2, 8);
  command->add_option("--output", options->output,
                      "folder of the sheet; default: NAME-compared beside the first job");
  command->add_option("--workers", options->workers, "worker processes; default: 1")
      ->check(CLI::Range(1, 256));
  command->footer(
      "Example:\n"
      "  baton compare papers.json pool.json\n"
      "Ctrl-C stops; the same command goes on where it stopped.");
  command->callback([options, &code] { code = finish_with_coordinator(run_compare(*options)); });
}

}  // namespace baton
