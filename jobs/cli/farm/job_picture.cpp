#include "jobs/cli/farm/job_picture.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>
#include <string>

#include "common/image/image_io.h"
#include "common/store/blob_store.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/display.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// A frame may be written, and its films be gone, between question and look.
constexpr int kMostTries = 5;

struct PictureOptions {
  CoordinatorLink link;
  std::string job;
  std::optional<int> frame;
  std::string aov, out;  ///< empty: the colours; a name of its own
  DisplayOptions display;
  bool partial = false, json = false;
};

/// The finished tiles, black between them; without channels: all are gone, since the frame was
/// written meanwhile. Errors: the store is not seen from here; films that cannot be read.
Result<FilmTile> joined_tiles(const PictureSource& source, std::size_t& num_tiles) {
  std::error_code error;
  if (!fs::is_directory(source.store_directory, error))
    return Error{ErrorKind::io,
                 source.store_directory + ": the store is not seen from here, only whole frames"};
  BATON_ASSIGN(const BlobStore store, BlobStore::open(source.store_directory));
  FilmTile image;
  for (const BlobRef& ref : source.films) {
    const std::string name = store.path(ref.digest).string();
    const Result<Bytes> bytes = store.get(ref.digest);
    if (!bytes && !store.contains(ref.digest)) continue;
    if (!bytes) return bytes.error();
    BATON_ASSIGN(const StoredFilm film, decode_film_tile(*bytes, name));
    if (image.channels.empty()) image = blank_image(source.rendered, film.film.channels);
    BATON_TRY(paste_tile(film.film, image));
    ++num_tiles;
  }
  return num_tiles == 0 ? image : framed(image, source.shown);
}

Result<ExitCode> picture(const PictureOptions& options) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  const AskPicture question{options.job, options.frame.has_value(),
                            FrameNumber(options.frame.value_or(0)), options.partial};
  PictureSource source;
  std::size_t num_tiles = 0;
  FilmTile image;
  for (int tries = 0; image.channels.empty(); ++tries) {
    if (tries == kMostTries)
      return Error{ErrorKind::io, fmt::format("frame {}: its tiles are not in {}", source.frame,
                                              source.store_directory)};
    BATON_ASSIGN(source, ask_until_done<PictureSource>(client, question));
    BATON_ASSIGN(image, source.is_written ? read_exr(source.file, ExrWindow::seen)
                                          : joined_tiles(source, num_tiles));
  }
  BATON_ASSIGN(const Display shown, display_aov(image, options.aov, options.display));
  const std::string what = options.aov.empty() ? "" : "." + options.aov;
  const fs::path out = options.out.empty()
                           ? fs::path(fmt::format("{}.{:04}{}.png", source.identity.id.short_hex(),
                                                  source.frame, what))
                           : fs::path(options.out);
  BATON_TRY(write_png(out, shown.image));
  if (options.json) {
    nlohmann::ordered_json row = {{"job", source.identity.id.hex()},
                                  {"frame", source.frame.value()},
                                  {"picture", out.string()},
                                  {"written", source.is_written}};
    if (source.is_written) row["file"] = source.file;
    if (!source.is_written) row.update({{"tiles", num_tiles}, {"tilesTotal", source.num_tiles}});
    fmt::print("{}\n", json_text(row, 2));
    return ExitCode::ok;
  }
  const std::string part =
      source.is_written ? source.file : fmt::format("{} of {} tiles", num_tiles, source.num_tiles);
  say("{}  frame {}, {}{}; {}\n", out.string(), source.frame, part, source.note, shown.how);
  return ExitCode::ok;
}

}  // namespace

void add_job_picture(CLI::App& job, ExitCode& code) {
  auto options = std::make_shared<PictureOptions>();
  CLI::App* command =
      job.add_subcommand("picture", "Writes the last finished frame of a job, or another, as PNG");
  command->add_option("ID", options->job, kJobHelp)->required();
  command->add_option("--frame", options->frame, "which; default: the last that is written");
  command->add_flag("--partial", options->partial,
                    "the finished tiles of a frame that is not written, without --frame of the "
                    "first such; the store must be seen from here");
  add_radiance_options(*command, options->display);
  add_aov_options(*command, options->aov, options->display);
  command->add_option("--out", options->out, "default: ID.FRAME.png in this folder");
  add_coordinator_options(*command, options->link);
  command->add_flag("--json", options->json, "for machines");
  command->footer(
      "Examples:\n"
      "  baton job picture shot7 --exposure 1 --out last.png\n"
      "  baton job picture 3f2a --partial");
  command->callback([options, &code] { code = finish_with_coordinator(picture(*options)); });
}

}  // namespace baton
