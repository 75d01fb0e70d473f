#include "coordinator/service/frame_inspection.h"

#include <map>
#include <optional>

#include "common/job/plan/sequence.h"
#include "coordinator/service/job_report.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Calls visit(task, path, recorded) for each.
template <class Visit>
void for_each_finished_frame(const Scheduler::Job& job, Visit visit) {
  for (TaskIndex frame = 0; frame < job.tasks.graph().num_frames(); ++frame) {
    if (job.tasks.book().status(frame) == TaskStatus::done)
      visit(frame, frame_path(job.spec, FrameIndex(frame)),
            job.tasks.made().outputs(frame).front());
  }
}

/// Whether the file stands as it did when it was read.
bool is_as_read(const FileContent& content) {
  const Result<std::optional<FileStamp>> now = stamp_of(content.path);
  return now ? *now == content.stamp : !content.fault.empty();
}

}  // namespace

std::vector<FileToRead> files_to_inspect(const Scheduler::Job& job, const FileTable& files,
                                         const LockedFrames& locked) {
  std::vector<FileToRead> wanted;
  for_each_finished_frame(job, [&](TaskIndex task, const fs::path& path, const BlobRef& recorded) {
    if (locked.contains(FrameIndex(task))) return;
    wanted.push_back({.path = path,
                      .expected = {recorded.digest},
                      .known = files.stamp_with(path, recorded.digest),
                      .sizes = {recorded.size_bytes}});
  });
  return wanted;
}

Result<InspectedFrames> inspect_frames(const Scheduler::Job& job,
                                       const std::vector<FileContent>& contents,
                                       const LockedFrames& locked, Journal& journal,
                                       const IdentityBook& jobs, const Digest& version) {
  std::map<fs::path, const FileContent*> read;
  for (const FileContent& content : contents) read[content.path] = &content;

  InspectedFrames found;
  const auto number_of = [&](TaskIndex task) {
    return job.spec.frames[static_cast<std::size_t>(task)];
  };
  std::map<fs::path, std::pair<TaskIndex, FileVerdict>> pictures;
  const auto lose = [&](TaskIndex task, const fs::path& path) {
    found.lost.push_back(job.tasks.graph().key(task));
    found.lost_files.push_back(path.string());
  };
  for_each_finished_frame(job, [&](TaskIndex task, const fs::path& path, const BlobRef& recorded) {
    if (locked.contains(FrameIndex(task))) {
      const FileVerdict verdict = judge_locked(path);
      if (verdict.state == FileState::absent)
        found.doubt.locked_absent.push_back({path.string(), number_of(task)});
      if (verdict.state == FileState::unreadable) found.unreadable = verdict.fault;
      return;
    }
    const auto content = read.find(path);
    const FileVerdict verdict =
        judge_content(content == read.end() ? nullptr : content->second, recorded);
    if (verdict.state == FileState::right) return;
    if (verdict.state == FileState::unknown || !is_as_read(*content->second)) {
      found.is_stale = true;
    } else if (verdict.state == FileState::unreadable) {
      found.unreadable = verdict.fault;
    } else if (verdict.state == FileState::strange) {
      pictures[path] = {task, verdict};
    } else {
      lose(task, path);
    }
  });
  if (pictures.empty()) return found;

  // A worker of a former job may have written late.
  BATON_ASSIGN(const FolderRecord record, FolderRecord::read(journal, jobs, version));
  for (const auto& [path, picture] : pictures) {
    if (record.may_replace(path, picture.second)) {
      lose(picture.first, path);
    } else {
      found.doubt.strange.push_back({path.string(), number_of(picture.first), picture.second.digest,
                                     record.is_foreign(picture.second)});
    }
  }
  return found;
}

}  // namespace baton
