#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/job_id.h"
#include "common/job/job_spec.h"
#include "coordinator/journal/journal.h"
#include "coordinator/service/file_reader.h"
#include "coordinator/service/file_table.h"
#include "coordinator/service/identity_book.h"
#include "coordinator/service/locked_frames.h"

namespace baton {

/// What the journal has of the frames in a job's folder, by whichever job wrote them there. Paths
/// are those of the job (frame_path()). Where several versions of one job have written a frame, it
/// is the newest's, and of several jobs that of the one that has not lost it to another: who puts a
/// former one's back has replaced it.
class FolderRecord {
 public:
  /// document: the job's, which the journal may not have yet; what it has written counts in any
  /// case. id: the job; empty: it is new.
  static Result<FolderRecord> read(Journal& journal, const IdentityBook& jobs,
                                   const ParsedJobDocument& document, const JobId& id);
  /// Of one that the journal has.
  static Result<FolderRecord> read(Journal& journal, const IdentityBook& jobs,
                                   const Digest& version);

  /// What the file of a frame may be, as far as it is recorded.
  std::vector<BlobRef> images_of(const std::filesystem::path& path) const;
  /// Whether a picture in the place of a frame may be replaced: a person has given it up, or it is
  /// a job's of this folder, one that is recorded, or one that was written and never reported: of
  /// the version itself, which will make it again, or of another one of the job, or of the same
  /// picture, where a worker was granted it; by what the job is rendered with here, or else it is
  /// another coordinator's. None that is locked (common/store/frame_locks.h), none while that
  /// cannot be read.
  bool may_replace(const std::filesystem::path& path, const FileVerdict& picture) const {
    return is_recorded(path, picture) || may_be_unreported(path, picture);
  }
  /// The same without those that were never reported.
  bool is_recorded(const std::filesystem::path& path, const FileVerdict& picture) const;
  /// Whether a picture is as a job wrote it that is none of this folder's.
  bool is_foreign(const FileVerdict& picture) const;
  /// The job of this folder that a picture names; nullopt: none.
  std::optional<Digest> writer_of(const FileVerdict& picture) const;
  /// Those of which only the digest must be known for that: at most kMostTold, the newest of them.
  std::vector<Digest> replaceable(const std::filesystem::path& path) const;
  void give_up(const std::filesystem::path& path, const Digest& picture);

 private:
  struct Image {
    Digest job;
    BlobRef image;
    /// Another job, whose picture it was to be, has it not any more.
    bool is_given_away = false;
    /// FrameFile::rendered.
    std::int64_t rendered = 0;
    /// It was rendered, and is to be rendered once more: `image` is nothing.
    bool is_lost = false;
    /// Somebody else has written a picture there since.
    bool is_superseded = false;
  };
  bool is_locked(const std::filesystem::path& path) const {
    return !locked_ || locked_->contains(path.filename().string());
  }

  void mark_superseded();
  bool may_be_unreported(const std::filesystem::path& path, const FileVerdict& picture) const;

  static constexpr std::size_t kMostTold = 256;
  std::map<std::filesystem::path, std::vector<Image>> images_;
  std::map<std::filesystem::path, Digest> given_up_;
  /// By others, by name; nullopt: that cannot be read.
  std::optional<std::map<std::string, std::string>> locked_;
  struct Writer {
    std::set<std::string> renderers;  ///< Journal::renderers
    /// Frames that its workers may have written and not reported; of another job those of the same
    /// picture.
    std::set<std::filesystem::path> granted;
  };
  std::map<Digest, Writer> jobs_;
  Digest version_;              ///< the one that was asked for
  std::vector<Digest> family_;  ///< all versions of its job
};

/// Frames of which only a person can say what becomes of them.
struct FramesInDoubt {
  struct Frame {
    std::string file;
    FrameNumber number{};
    Digest digest = {};                 ///< of a strange one
    bool is_foreign = false;            ///< as a job wrote it that is not known here
    std::optional<Digest> writer = {};  ///< the known job that wrote it
  };
  std::vector<Frame> strange;        ///< files that are pictures of nobody here
  std::vector<Frame> locked_absent;  ///< locked, and not there

  bool empty() const { return strange.empty() && locked_absent.empty(); }
};
/// For people: which they are, and the ways on. job: whose frames they are; empty: it is new, and
/// nothing of it can be locked. known: the job as it is, whose frames can be locked, where that is
/// another document.
std::string doubt_text(const FramesInDoubt& doubt, const JobId& job,
                       const JobSpec* known = nullptr);

/// The files in the places of a job's frames that are not what its folder's jobs have recorded.
struct OddFrames {
  std::vector<FileToRead> unread;  ///< only their bytes can tell
  FramesInDoubt doubt;
  /// Why one of them cannot be read; empty: none is.
  std::string unreadable;
  bool is_locked_unreadable = false;  ///< one that is locked is not
};
/// For people: what is wrong with them; empty: nothing.
std::string fault_text(const OddFrames& odd, const JobId& job, const JobSpec* known = nullptr);
/// restart: all that is not recorded is in doubt.
OddFrames find_odd_frames(const FolderRecord& record, const FileTable& files, const JobSpec& spec,
                          const LockedFrames& locked, bool restart = false);

}  // namespace baton
