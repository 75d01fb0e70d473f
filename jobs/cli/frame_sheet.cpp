#include "jobs/cli/frame_sheet.h"

#include <algorithm>
#include <cmath>

#include "common/image/contact_sheet.h"
#include "common/job/sequence.h"

namespace baton {
namespace {

constexpr std::size_t kMaxFrames = 24;
constexpr int kMaxColumns = 6;
constexpr int kMaxThumbWidth = 320;

/// At most kMaxFrames of `frames`, the first and the last among them.
std::vector<int> pick_frames(const std::vector<int>& frames) {
  if (frames.size() <= kMaxFrames) return frames;
  std::vector<int> picked;
  for (std::size_t i = 0; i < kMaxFrames; ++i) {
    picked.push_back(frames[i * (frames.size() - 1) / (kMaxFrames - 1)]);
  }
  return picked;
}

}  // namespace

std::filesystem::path frame_path(const OutputSpec& output, int frame_number) {
  return std::filesystem::path(output.directory) / frame_file_name(output.pattern, frame_number);
}

Result<std::filesystem::path> write_frame_sheet(const OutputSpec& output,
                                                const std::vector<int>& frames) {
  std::vector<RgbImage> images;
  for (const int frame : pick_frames(frames)) {
    BATON_ASSIGN(RgbImage image, read_rgb_image(frame_path(output, frame)));
    images.push_back(std::move(image));
  }

  // One exposure for all, or changes of the light would not show.
  const float exposure = auto_exposure(images[images.size() / 2]);
  for (RgbImage& image : images) image = tone_map(image, exposure);

  const auto square = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(images.size()))));
  const RgbImage sheet = contact_sheet(images, std::min(square, kMaxColumns),
                                       std::min(images.front().width, kMaxThumbWidth));
  const std::filesystem::path path = std::filesystem::path(output.directory) / "contact-sheet.png";
  BATON_TRY(write_png(path, sheet));
  return path;
}

}  // namespace baton
