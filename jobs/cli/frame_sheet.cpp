#include "jobs/cli/frame_sheet.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/image/contact_sheet.h"
#include "common/job/sequence.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFrames = 12;
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

FrameSheet::FrameSheet(const JobSpec& job)
    : output_(job.output), wanted_(pick_frames(job.frames)) {}

void FrameSheet::add(const std::vector<int>& finished) {
  for (const int frame : finished) {
    const bool is_new = read_.ok() && !thumbnails_.contains(frame) &&
                        std::binary_search(wanted_.begin(), wanted_.end(), frame);
    if (!is_new) continue;
    const fs::path path = fs::path(output_.directory) / frame_file_name(output_.pattern, frame);
    const Result<RgbImage> image = read_rgb_image(path);
    if (!image) {
      read_ = image.error();
      return;
    }
    thumbnails_.emplace(frame, resize(*image, std::min(image->width, kMaxThumbWidth)));
  }
}

Result<std::optional<fs::path>> FrameSheet::write() const {
  BATON_TRY(read_);
  if (thumbnails_.empty()) return std::optional<fs::path>();

  // One exposure for all, or changes of the light would not show.
  const auto middle = std::next(thumbnails_.begin(), std::ssize(thumbnails_) / 2);
  const float exposure = auto_exposure(middle->second);
  std::vector<RgbImage> frames;
  for (const auto& [frame, thumbnail] : thumbnails_)
    frames.push_back(tone_map(thumbnail, exposure));

  const auto square = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(frames.size()))));
  const RgbImage sheet = contact_sheet(frames, std::min(square, kMaxColumns), frames.front().width);
  const fs::path path = fs::path(output_.directory) / "contact-sheet.png";
  BATON_TRY(write_png(path, sheet));
  return std::optional(path);
}

}  // namespace baton
