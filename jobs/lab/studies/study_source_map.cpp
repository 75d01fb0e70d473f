// Where the samples of each pixel come from while the camera moves [Ghosh, Doucet & Heidrich 2006,
// fig. 6]: PICTURE.png gets some frames above and below them their false colour (green: carried,
// red: started afresh), and the output is a table of how many pixels by frame.
//
// Usage: study_source_map JOB.json PICTURE.png > CSV
#include <array>
#include <string>

#include "common/image/contact_sheet.h"
#include "common/image/image_io.h"
#include "common/scene/settle/settle_motion.h"
#include "jobs/lab/studies/sequential_runs.h"
#include "jobs/study/measured_frame.h"

namespace baton {
namespace {

constexpr std::size_t kShown = 3;  ///< frames in the image, with the last one
constexpr int kGap = 4;

/// Copies an image with its corner at (left, top).
void paste(const RgbImage& from, int left, int top, RgbImage& to) {
  for (int y = 0; y < from.height; ++y) {
    const auto row = from.rgb.begin() + std::ptrdiff_t{3} * y * from.width;
    std::copy_n(row, std::ptrdiff_t{3} * from.width,
                to.rgb.begin() + std::ptrdiff_t{3} * ((top + y) * to.width + left));
  }
}

/// Beauty above, source below, from left to right.
RgbImage sheet_of(const std::vector<const FilmTile*>& films) {
  const RgbImage first = image_of(*films.front(), {"R", "G", "B"});
  const float exposure = auto_exposure(first);
  const auto columns = static_cast<int>(films.size());
  RgbImage sheet{columns * (first.width + kGap) - kGap, 2 * first.height + kGap, {}};
  sheet.rgb.assign(std::size_t{3} * static_cast<std::size_t>(sheet.width * sheet.height), 1.0f);
  int left = 0;
  for (const FilmTile* film : films) {
    paste(tone_map(image_of(*film, {"R", "G", "B"}), exposure), left, 0, sheet);
    paste(image_of(*film, {"source.R", "source.G", "source.B"}), left, first.height + kGap, sheet);
    left += first.width + kGap;
  }
  return sheet;
}

int run(const std::string& path, const std::string& picture) {
  const JobSpec job = value_of(settle_motion(value_of(load_job(path))));
  const std::vector<FrameResult> frames =
      render(job, value_of(load_shared_assets(job)), {Aov::source});

  fmt::print("frame,surface,carried,fresh,refreshed,restarted,resampled\n");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const SamplingStats& s = frames[i].sampling;
    const auto all = static_cast<double>(std::max<std::uint64_t>(s.pixels(), 1));
    const auto share = [&](std::uint64_t count) { return static_cast<double>(count) / all; };
    fmt::print("{},{},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f}\n", job.frames[i], s.pixels(),
               share(s.pixels_carried), share(s.pixels_fresh), share(s.pixels_refreshed),
               share(s.pixels_restarted), share(s.pixels_resampled));
  }

  std::vector<const FilmTile*> shown;
  for (std::size_t k = 1; k <= std::min(kShown, frames.size()); ++k)
    shown.push_back(&frames[k * (frames.size() - 1) / std::min(kShown, frames.size())].film);
  const Status written = write_png(picture, sheet_of(shown));
  if (written) return 0;
  fmt::print(stderr, "{}\n", written.error().message);
  return 74;
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: study_source_map JOB.json PICTURE.png > CSV\n");
    return 64;
  }
  return baton::run(argv[1], argv[2]);
}
