#include <fmt/format.h>

#include <optional>

#include "common/job/text/frame_range.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/display.h"
#include "jobs/cli/look/movie_encoder.h"
#include "jobs/cli/look/numbered_frames.h"
#include "jobs/cli/say.h"
#include "jobs/cli/signals.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct MovieOptions {
  std::string source;  ///< job file or folder of frames
  std::string frames;  ///< empty: all
  std::string aov;     ///< empty: the colours
  /// Movie or folder; empty: preview.mp4 beside the frames.
  std::string out;
  std::optional<double> frames_per_second;
  bool skip_missing = false;
  DisplayOptions display;
};

/// Where the pictures go: into a movie, or one by one into a folder.
class ImageSink {
 public:
  ImageSink(fs::path out, std::string frames_per_second)
      : out_(std::move(out)), frames_per_second_(std::move(frames_per_second)) {}

  Status add(const NumberedFrame& frame, const RgbImage& image) {
    if (!is_movie_name(out_))
      return write_png(out_ / frame.file.filename().replace_extension(".png"), image);
    if (!movie_) {
      BATON_ASSIGN(MovieEncoder started,
                   MovieEncoder::start(out_, image.width, image.height, frames_per_second_));
      movie_.emplace(std::move(started));
    }
    return movie_->add(image);
  }
  Status finish() { return movie_ ? movie_->finish() : Status(); }

 private:
  fs::path out_;
  std::string frames_per_second_;
  std::optional<MovieEncoder> movie_;
};

/// A movie by its ending, else a folder.
Status check_out(const fs::path& path) {
  std::error_code error;
  const bool is_folder = !path.has_extension() || fs::is_directory(path, error);
  if (is_folder || is_movie_name(path)) return {};
  return Error{ErrorKind::usage,
               fmt::format("--out {}: expected a name that ends in .mp4, .webm or .webp, or a "
                           "folder for PNGs",
                           path.string())};
}

Error other_size(const NumberedFrame& frame, const RgbImage& image, const RgbImage& first) {
  return {ErrorKind::bad_input,
          fmt::format("{}: {}x{} pixels, the first frame has {}x{}", frame.file.string(),
                      image.width, image.height, first.width, first.height)};
}

/// nullopt: a signal came.
Result<std::optional<std::string>> show_frames(const FrameFolder& folder, MovieOptions options,
                                               ImageSink& sink) {
  const SignalWait signals;
  std::string how;
  RgbImage first;
  for (const NumberedFrame& frame : folder.frames) {
    if (signals.stop_requested_within(std::chrono::milliseconds(0)))
      return std::optional<std::string>();
    BATON_ASSIGN(const FilmTile pixels, read_exr(frame.file, ExrWindow::seen));
    Result<Display> shown = display_aov(pixels, options.aov, options.display);
    if (!shown)
      return Error{shown.error().kind,
                   fmt::format("{}: {}", frame.file.string(), shown.error().message)};
    if (how.empty()) {
      // What the values of the first frame say holds for all, so that nothing flickers.
      options.display.range = shown->range;
      how = fmt::format("{}x{}, {}", shown->image.width, shown->image.height, shown->how);
      first = {shown->image.width, shown->image.height, {}};
    }
    if (shown->image.width != first.width || shown->image.height != first.height)
      return other_size(frame, shown->image, first);
    BATON_TRY(sink.add(frame, shown->image));
  }
  BATON_TRY(sink.finish());
  return std::optional(how);
}

Result<ExitCode> run_movie(const MovieOptions& options) {
  fs::path out = options.out;
  if (!out.empty()) BATON_TRY(check_out(out));
  BATON_ASSIGN(const FrameFolder folder, find_frames(options.source, options.frames));
  if (out.empty()) out = folder.directory / "preview.mp4";
  if (!folder.missing.empty() && !options.skip_missing) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: frames {} are missing; --skip-missing does without them",
                             folder.directory.string(), format_frames(folder.missing))};
  }
  const std::string rate = options.frames_per_second ? fmt::format("{}", *options.frames_per_second)
                                                     : folder.frames_per_second;
  ImageSink sink(out, rate);
  BATON_ASSIGN(const std::optional<std::string> how, show_frames(folder, options, sink));
  if (!how) return ExitCode::cancelled;
  say("{}  {} frames{}, {}\n", out.string(), folder.frames.size(),
      is_movie_name(out) ? fmt::format(" at {} a second", rate) : "", *how);
  return ExitCode::ok;
}

}  // namespace

void add_movie_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<MovieOptions>();
  CLI::App* command =
      app.add_subcommand("movie", "Makes a movie, or PNGs, of the frames of a sequence");
  command->add_option("JOB", options->source, "job file, or a folder of numbered EXR frames")
      ->required();
  command->add_option("--frames", options->frames, "only these frames: 1-48, 1-48x4, 1,5,9-12");
  command->add_option("--out", options->out,
                      "a movie (.mp4, .webm, .webp; ffmpeg encodes it) or a folder for PNGs; "
                      "default: preview.mp4 beside the frames");
  command
      ->add_option(
          "--fps", options->frames_per_second,
          "frames a second; default: output.framesPerSecond of the job, or as the frames say")
      ->check(CLI::Range(1.0, 1000.0));
  command->add_flag("--skip-missing", options->skip_missing, "leave out frames that are not there");
  add_radiance_options(*command, options->display);
  add_aov_options(*command, options->aov, options->display);
  command->footer(
      "Examples:\n"
      "  baton movie job.json --curve filmic\n"
      "  baton movie frames-look --out look.webp --fps 12\n"
      "  baton movie job.json --aov depth --out depth-pngs");
  command->callback([options, &code] { code = finish(run_movie(*options)); });
}

}  // namespace baton
