#include <fmt/format.h>

#include "common/image/image_io.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/display.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct ViewOptions {
  std::string frame;
  std::string aov;        ///< empty: the colours
  std::string out;        ///< empty: beside the frame
  bool overscan = false;  ///< with the pixels around the picture
  DisplayOptions display;
};

fs::path default_output(const ViewOptions& options) {
  const std::string end = options.aov.empty() ? ".png" : "." + options.aov + ".png";
  return fs::path(options.frame).replace_extension(end);
}

Result<ExitCode> run_view(const ViewOptions& options) {
  BATON_ASSIGN(const FilmTile frame,
               read_exr(options.frame, options.overscan ? ExrWindow::data : ExrWindow::seen));
  const Result<Display> shown = display_aov(frame, options.aov, options.display);
  if (!shown)
    return Error{shown.error().kind, fmt::format("{}: {}", options.frame, shown.error().message)};
  const fs::path path = options.out.empty() ? default_output(options) : fs::path(options.out);
  BATON_TRY(write_png(path, shown->image));
  say("{}  {}x{}, {}\n", path.string(), shown->image.width, shown->image.height, shown->how);
  return ExitCode::ok;
}

}  // namespace

void add_view_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<ViewOptions>();
  CLI::App* command = app.add_subcommand("view", "Writes a frame, or one of its AOVs, as PNG");
  command->add_option("FRAME", options->frame, "EXR file")->required();
  add_radiance_options(*command, options->display);
  add_aov_options(*command, options->aov, options->display);
  command->add_flag("--overscan", options->overscan, "with the pixels around the picture, if any");
  command->add_option("--out", options->out, "default: FRAME.png, FRAME.AOV.png beside it");
  command->footer(
      "Examples:\n"
      "  baton view frame.0012.exr --exposure 2\n"
      "  baton view frame.0012.exr --aov depth --out depth.png");
  command->callback([options, &code] { code = finish(run_view(*options)); });
}

}  // namespace baton
