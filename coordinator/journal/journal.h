#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/journal/database.h"
#include "coordinator/schedule/events.h"

namespace baton {

/// What the journal holds of a job.
struct JournalledJob {
  Digest job;
  std::string document;
  JobStatus status = JobStatus::running;
  Completions completions;  ///< in the order in which they were recorded
  std::vector<Failure> failures;
};

/// What a coordinator must not forget: jobs, completions, failures. Records are collected until
/// commit() makes all of them durable at once; a process that is killed before leaves none of them.
/// An error of any call leaves the journal unusable: stop, and start again from what was committed.
class Journal {
 public:
  /// Opens or creates the file and counts this start. Errors: in use by another coordinator,
  /// damaged, not a journal, made by a newer version.
  static Result<Journal> open(const std::filesystem::path& path);

  /// How often the journal was opened, from 1.
  std::uint32_t epoch() const { return epoch_; }

  /// All jobs, in the order of submission.
  Result<std::vector<Digest>> jobs();
  /// The job must be there.
  Result<JournalledJob> load(const Digest& job);
  /// Who submitted which job, where that is known.
  Result<std::map<Digest, std::string>> owners();
  Status record_owner(const Digest& job, const std::string& owner);
  /// nullopt: no such job.
  Result<std::optional<std::string>> document(const Digest& job);
  /// What the tasks of one kind and step recorded of frames so far, in no order: those of a run for
  /// each frame and tile what the sampler did, an assembly what was seen of its frame.
  Result<std::vector<FrameStats>> frame_stats(const Digest& job, TaskKind kind, std::int32_t step);
  /// At most `count` failed attempts, the newest last.
  Result<std::vector<Failure>> recent_failures(const Digest& job, int count);

  Status add_job(const Digest& job, const std::string& document);
  /// Forgets the failures of a job and lets it run again.
  Status restart_job(const Digest& job);
  /// Forgets all of a job.
  Status delete_job(const Digest& job);
  Status record_status(const Digest& job, JobStatus status);
  Status record_completion(const Digest& job, const Completion& completion);
  Status record_failure(const Failure& failure);
  /// Forgets that these tasks were done.
  Status record_reopened(const Digest& job, const std::vector<TaskKey>& tasks);

  /// Makes durable what was recorded since the last commit; nothing to do is a success.
  Status commit();

 private:
  explicit Journal(SqlDatabase database) : database_(std::move(database)) {}
  Status prepare_schema();
  Status count_start();
  Result<Failure> read_failure(const SqlStatement& row) const;
  Result<SqlStatement*> write(std::string_view sql);

  SqlDatabase database_;
  std::map<std::string_view, SqlStatement> writers_;  ///< prepared once, by their text
  std::uint32_t epoch_ = 0;
  bool in_transaction_ = false;
};

}  // namespace baton
