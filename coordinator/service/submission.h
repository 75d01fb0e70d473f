#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/job/text/job_json.h"
#include "coordinator/schedule/adoption.h"
#include "coordinator/service/farm_core.h"
#include "coordinator/service/file_table.h"
#include "coordinator/service/job_report.h"

namespace baton {

/// A job is submitted: what becomes of the jobs in its folder, and what they leave to it. Made for
/// one message of `speaker`; no file is read here.
class Submission {
 public:
  Submission(FarmCore& farm, FileTable& files, const Speaker& speaker)
      : farm_(farm), files_(files), speaker_(speaker) {}

  /// The files of the job's frames that jobs of its folder have recorded, as far as only their
  /// bytes can tell whether they are as they were written. They must be known to submit().
  Result<std::vector<std::filesystem::path>> unread_frames(const JobSpec& job);
  /// Starts the job or lets it go on, and answers. The document is one that may be run.
  Status submit(const PeerId& peer, const ParsedJobDocument& document, const SubmitJob& message);
  /// What is not there of a job that the scheduler has.
  Result<LostFiles> lost_files_of(const Digest& job);

 private:
  Result<std::optional<FormerJob>> former_job(const Digest& digest);
  Result<std::vector<std::string>> make_way(const ParsedJobDocument& document, bool restart);
  Status disown(const Digest& job, const std::vector<FrameNumber>& frames);
  Status go_on(const PeerId& peer, const Digest& digest);
  Status begin(const PeerId& peer, const ParsedJobDocument& document, const std::string& text,
               std::vector<std::string> reasons);
  Result<Adoption> find_heritage(const ParsedJobDocument& document, std::vector<Digest>& digests,
                                 std::vector<std::string>& reasons);
  Status take_over(const Adoption& adoption, const std::vector<Digest>& formers,
                   const std::string& text, JobAdded& event);

  FarmCore& farm_;
  FileTable& files_;
  const Speaker& speaker_;
};

}  // namespace baton
