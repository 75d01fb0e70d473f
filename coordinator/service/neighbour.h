#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "coordinator/schedule/adoption.h"
#include "coordinator/service/file_table.h"
#include "coordinator/service/locked_frames.h"

namespace baton {

/// Another job that writes, or has written, into the folder of a new one.
struct Neighbour {
  Digest job;
  JobStatus status = JobStatus::running;
  /// Frames in common that it has written; all of them if it is open.
  std::vector<FrameNumber> written = {};
  /// What makes their pixels others; empty: they are the same.
  std::vector<std::string> differing = {};
  std::optional<FrameNumber> first_differing = {};
  /// They have frames in common, and it is open, or something is in the place of one that it wrote.
  bool has_place = false;
  /// It is open, and no frame says whose picture it is.
  bool busy = false;
  /// If it is open: frames that it has not written and the new one does not have.
  std::vector<FrameNumber> left_out = {};
  /// Frames in common that are locked in it, as a job of its own.
  std::vector<FrameNumber> locked = {};
};

/// Which frames stay as they are: of the former job, where it is another one, and of the new one.
struct Locks {
  LockedFrames theirs, mine;
};

/// The frames of a new job, by the names of their files.
class FramesByFile {
 public:
  /// document: outlives it.
  explicit FramesByFile(const ParsedJobDocument& document);
  const ParsedJobDocument& document() const { return document_; }
  /// The one that has the file of another job's frame; nullopt: none.
  std::optional<FrameIndex> find(const JobSpec& other, FrameIndex frame) const;

 private:
  const ParsedJobDocument& document_;
  std::unordered_map<std::string, FrameIndex> places_;
};

/// What a journalled job has written, beside a new one with these frames. owned: its frames by
/// number, without those that another one has replaced; null: all.
Neighbour look_at(const FormerJob& former, const Digest& job, const FramesByFile& frames,
                  const FileTable& files, const std::vector<FrameNumber>* owned,
                  const Locks& locks = {});

/// Some of what differs, for people.
std::string differing_text(const std::vector<std::string>& differing);
/// Why a job is refused whose frames would replace those of another picture. other_name: short, of
/// that job.
Error another_picture(const JobSpec& job, const Neighbour& other, const JobSpec& other_job,
                      const std::string& other_name);

}  // namespace baton
