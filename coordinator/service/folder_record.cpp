#include "coordinator/service/folder_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <span>

#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"

namespace baton {

namespace fs = std::filesystem;

Result<FolderRecord> FolderRecord::read(Journal& journal, const std::string& folder) {
  FolderRecord record;
  BATON_ASSIGN(const std::vector<Digest> jobs, journal.jobs_in(folder));
  for (const Digest& job : jobs) {
    BATON_ASSIGN(const std::optional<std::string> text, journal.document(job));
    const Result<ParsedJobDocument> document = parse_job_document(text.value_or(""));
    if (!document) continue;
    record.jobs_.push_back(job);
    BATON_TRY(journal.for_each_completion(job, [&](const Completion& done) -> Status {
      if (done.task.kind != TaskKind::assemble || done.made.outputs.size() != 1) return {};
      const fs::path path = frame_path(document->job, done.task.frame()).lexically_normal();
      record.images_[path].push_back({job, done.made.outputs.front()});
      return {};
    }));
  }
  return record;
}

std::map<fs::path, std::vector<BlobRef>> FolderRecord::frames_of(const JobSpec& job) const {
  std::map<fs::path, std::vector<BlobRef>> frames;
  for (std::size_t i = 0; i < job.frames.size(); ++i) {
    const fs::path path =
        frame_path(job, FrameIndex(static_cast<std::int32_t>(i))).lexically_normal();
    std::vector<BlobRef>& recorded = frames[path];
    const auto found = images_.find(path);
    if (found == images_.end()) continue;
    for (const Image& image : found->second) recorded.push_back(image.image);
  }
  return frames;
}

bool FolderRecord::has_written(const fs::path& path, const FileVerdict& picture) const {
  const auto found = images_.find(path.lexically_normal());
  const std::span<const Image> images =
      found == images_.end() ? std::span<const Image>() : std::span(found->second);
  if (std::ranges::any_of(images,
                          [&](const Image& image) { return image.image.digest == picture.digest; }))
    return true;
  const auto writer =
      std::ranges::find_if(jobs_, [&](const Digest& job) { return job.hex() == picture.writer; });
  return writer != jobs_.end() &&
         std::ranges::none_of(images, [&](const Image& image) { return image.job == *writer; });
}

OddFrames find_odd_frames(const FolderRecord& record, const FileTable& files, const Digest& job,
                          const JobSpec& spec) {
  OddFrames odd;
  BlobRef nothing;
  nothing.kind = BlobKind::image;
  for (const auto& [path, images] : record.frames_of(spec)) {
    FileVerdict verdict = files.judge(path, images.empty() ? nothing : images.front());
    for (const BlobRef& image : images) {
      if (verdict.state != FileState::right && files.is_right(path, image))
        verdict.state = FileState::right;
    }
    if (verdict.state == FileState::unknown) {
      FileToRead file{path};
      file.is_frame = true;
      for (const BlobRef& image : images) file.expected.push_back(image.digest);
      odd.unread.push_back(std::move(file));
    } else if (verdict.state == FileState::unreadable) {
      odd.unreadable = verdict.fault;
    } else if (verdict.state == FileState::strange && verdict.writer != job.hex() &&
               !record.has_written(path, verdict)) {
      odd.strange.push_back(path.string());
    }
  }
  return odd;
}

std::string strange_text(const std::vector<std::string>& strange) {
  if (strange.empty()) return {};
  constexpr std::size_t kMost = 8;
  const auto shown = std::span(strange).first(std::min(kMost, strange.size()));
  const std::size_t more = strange.size() - shown.size();
  return fmt::format(
      "{}{} {} not what a job has written here: another picture, changed or replaced, which is "
      "kept; --restart renders {} again",
      fmt::join(shown, ", "), more > 0 ? fmt::format(" and {} more", more) : "",
      strange.size() == 1 ? "is" : "are", strange.size() == 1 ? "it" : "them");
}

}  // namespace baton
