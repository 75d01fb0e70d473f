#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/text/job_json.h"
#include "coordinator/schedule/adoption.h"
#include "coordinator/service/farm_core.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/file_table.h"
#include "coordinator/service/folder_record.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/neighbour.h"

namespace baton {

/// A job is submitted: what becomes of the jobs in its folder, and what they leave to it. Made for
/// one message of `speaker`; no file is read here.
class Submission {
 public:
  Submission(FarmCore& farm, FileTable& files, const Speaker& speaker)
      : farm_(farm), files_(files), speaker_(speaker) {}

  /// Starts the job or lets it go on, and answers. The document is one that may be run, and its
  /// frames are known, as far as jobs of its folder have recorded them (find_odd_frames). strange:
  /// pictures of others in their places; there are some only where message.restart gives them up.
  Status submit(const PeerId& peer, const ParsedJobDocument& document, const SubmitJob& message,
                const std::vector<FramesInDoubt::Frame>& strange);
  /// Errors (bad_input, usage): why the document would be refused without --restart beside the jobs
  /// of its folder.
  Status expect_free_folder(const ParsedJobDocument& document);
  /// The newest of a job's documents; null: it is new, deleted, or cannot be read.
  SharedDocument newest_document(const JobId& job);
  /// The job that the document is a version of, or becomes one; empty: a new one.
  Result<JobId> known_job(const ParsedJobDocument& document);
  /// A document of a job that may grow gets the sweeps that jobs of its picture have written in its
  /// folder, unless it is begun again; others stay as they are. Returns its text.
  Result<std::string> with_written_sweeps(const ParsedJobDocument& document,
                                          const std::string& text, bool restart);
  /// All frames of a running job are there: it is done, or gets more sweeps (common/job/plan/
  /// next_sweeps.h) as a new version.
  Status finish(const Digest& version);
  /// What is not there of a job that the scheduler has. A folder without its mark that has all
  /// frames is the folder, and is marked again. restart: see find_lost_files.
  Result<LostFiles> lost_files_of(const Digest& job, bool restart = false);

 private:
  /// A job of a folder, and what the journal has of it.
  struct InFolder {
    Digest job;
    FormerJob former;
  };
  Result<std::vector<InFolder>*> jobs_in(const std::string& folder);
  Result<std::vector<Neighbour>> find_neighbours(const ParsedJobDocument& document,
                                                 const JobId& job, bool restart);
  Result<std::vector<std::string>> make_way(const ParsedJobDocument& document,
                                            const std::vector<Neighbour>& others);
  /// Sweeps that frames of the document have in its folder, by jobs of its picture.
  struct WrittenSweeps {
    int most = 0;    ///< of some frame; 0: none is there
    int common = 0;  ///< that all frames have
  };
  Result<WrittenSweeps> written_sweeps(const ParsedJobDocument& document);
  Result<bool> grow(const Digest& version);
  std::set<FrameIndex> frames_of_others(const ParsedJobDocument& document,
                                        const std::vector<InFolder>& jobs) const;
  static std::string newest_renderer(const std::vector<InFolder>& jobs,
                                     const ParsedJobDocument& document);
  Status expect_by_one(const ParsedJobDocument& document, const LockedFrames& locked);
  KeptFiles kept_files(const JobSpec& job, const LockedFrames& locked);
  std::string changes_text(const ParsedJobDocument& document, const JobId& job, bool keep_priority);
  Status take_priority(const ParsedJobDocument& document);
  Status begin_growth(const ParsedJobDocument& document, bool restart);
  Status add_sweeps(const Digest& version, int sweeps, const std::string& reason);
  Status disown(const Digest& job, const std::vector<FrameNumber>& frames, const std::string& by);
  Status tell_requeue(const ParsedJobDocument& document);
  Status requeue(const Digest& version);
  Status go_on(const PeerId& peer, const Digest& digest, bool restart);
  Status begin(const PeerId& peer, const ParsedJobDocument& document, const SubmitJob& message,
               std::vector<std::string> reasons);
  /// What former jobs leave to a new one, and by what it was rendered.
  struct Heritage {
    std::vector<Digest> formers;
    Adoption adoption;
    std::string renderer;
    bool is_mixed = false;  ///< others have made some of it, too
  };
  Result<Heritage> find_heritage(const ParsedJobDocument& document, bool restart,
                                 const LockedFrames& locked, std::vector<std::string>& reasons);
  Status take_over(const Heritage& heritage, const std::string& text, JobAdded& event);

  FarmCore& farm_;
  FileTable& files_;
  const Speaker& speaker_;
  std::set<FrameIndex> again_;  ///< SubmitJob::again
  /// Read once: a submission changes nothing of what former jobs have done.
  std::map<std::string, std::vector<InFolder>> folders_;
};

}  // namespace baton
