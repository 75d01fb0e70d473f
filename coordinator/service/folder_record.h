#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/job/job_spec.h"
#include "coordinator/journal/journal.h"
#include "coordinator/service/file_reader.h"
#include "coordinator/service/file_table.h"

namespace baton {

/// What the journal has of the frames in a folder, by whichever of its jobs.
class FolderRecord {
 public:
  /// folder: folder_of() a job.
  static Result<FolderRecord> read(Journal& journal, const std::string& folder);

  /// The frames of a job by the path of their file, each with what it may be as far as it is
  /// recorded.
  std::map<std::filesystem::path, std::vector<BlobRef>> frames_of(const JobSpec& job) const;
  /// Whether a picture in the place of a frame is a job's of this folder: one that is recorded, or
  /// one that was written and never reported.
  bool has_written(const std::filesystem::path& path, const FileVerdict& picture) const;

 private:
  struct Image {
    Digest job;
    BlobRef image;
  };
  std::map<std::filesystem::path, std::vector<Image>> images_;  ///< by normal path
  std::vector<Digest> jobs_;
};

/// The files in the places of a job's frames that are not what its folder's jobs have recorded.
struct OddFrames {
  std::vector<FileToRead> unread;    ///< only their bytes can tell
  std::vector<std::string> strange;  ///< files that are pictures of nobody here
  /// Why one of them cannot be read; empty: none is.
  std::string unreadable;
};
/// job: the digest of the document of `spec`; what its header names may be written again.
OddFrames find_odd_frames(const FolderRecord& record, const FileTable& files, const Digest& job,
                          const JobSpec& spec);
/// For people: that these are others' frames now; empty: there are none.
std::string strange_text(const std::vector<std::string>& strange);

}  // namespace baton
