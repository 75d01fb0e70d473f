#include "jobs/cli/frame_sheet.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/image/contact_sheet.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFrames = 12;
constexpr int kMaxColumns = 6;
constexpr int kMaxThumbWidth = 320;

}  // namespace

Result<RgbImage> read_thumbnail(const fs::path& path) {
  BATON_ASSIGN(const RgbImage image, read_rgb_image(path, ExrWindow::seen));
  return resize(image, std::min(image.width, kMaxThumbWidth));
}

Status write_sheet(const fs::path& path, std::vector<RgbImage> thumbnails,
                   const std::vector<FrameNumber>& numbers, int columns,
                   const DisplayOptions& display) {
  for (RgbImage& thumbnail : thumbnails)
    thumbnail = display_radiance(std::move(thumbnail), display).image;
  std::vector<int> labels;
  for (const FrameNumber number : numbers) labels.push_back(number.value());
  return write_png(path, contact_sheet(thumbnails, columns, thumbnails.front().width, labels));
}

FrameSheet::FrameSheet(const JobSpec& job)
    : output_(job.output), wanted_(pick_frames(job.frames, kMaxFrames)) {}

void FrameSheet::add(const std::vector<FrameNumber>& finished) {
  for (const FrameNumber frame : finished) {
    const bool is_new = read_.ok() && !thumbnails_.contains(frame) &&
                        std::binary_search(wanted_.begin(), wanted_.end(), frame);
    if (!is_new) continue;
    const fs::path path =
        fs::path(output_.directory) / frame_file_name(output_.pattern, frame.value());
    Result<RgbImage> thumbnail = read_thumbnail(path);
    if (!thumbnail) {
      read_ = thumbnail.error();
      return;
    }
    thumbnails_.emplace(frame, std::move(thumbnail).value());
  }
}

Result<std::optional<fs::path>> FrameSheet::write(const DisplayOptions& display) const {
  BATON_TRY(read_);
  if (thumbnails_.empty()) return std::optional<fs::path>();

  std::vector<RgbImage> frames;
  std::vector<FrameNumber> numbers;
  for (const auto& [frame, thumbnail] : thumbnails_) {
    frames.push_back(thumbnail);
    numbers.push_back(frame);
  }
  const auto square = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(frames.size()))));
  const fs::path path = fs::path(output_.directory) / "contact-sheet.png";
  BATON_TRY(write_sheet(path, std::move(frames), numbers, std::min(square, kMaxColumns), display));
  return std::optional(path);
}

}  // namespace baton
