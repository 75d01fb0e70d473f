#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/file_stamp.h"
#include "common/job/farm_event.h"
#include "common/job/job_id.h"
#include "coordinator/journal/database.h"
#include "coordinator/schedule/events.h"

namespace baton {

/// What the journal holds of a job.
struct JournalledJob {
  Digest job;
  std::string document;
  JobStatus status = JobStatus::running;
  JobPlan plan;
  Completions completions;  ///< in the order in which they were recorded
  std::vector<Failure> failures;
  std::string renderer = {};  ///< of what is done of it; empty: not known
  bool is_mixed = false;      ///< others have made some of it, too
  /// What tasks made that were opened again: it must come out alike.
  std::vector<Completions::Task> former = {};
};

/// How the file of a finished frame stood when its bytes had this digest.
struct FrameFile {
  /// Digest(): a worker may have written it, and nothing else is known.
  Digest digest;
  FileStamp stamp;
  /// When its worker last reported it, in the order in which frames of all jobs were reported,
  /// though that may be forgotten since; 0: never. To be recorded: whether it has.
  std::int64_t rendered = 0;
  /// Whether nothing else is known: what a worker wrote there is not in its place any more.
  bool is_gone = false;
};

/// Which version of which job a document is.
struct JobVersion {
  Digest document;
  JobId id;
  std::int32_t number = 1;
};

/// Events of a kind that are forgotten.
struct EventSum {
  std::int64_t count = 0;
  double seconds = 0;
};

/// A job whose quality lets it grow, since it was submitted last.
struct JobGrowth {
  std::int64_t since_ms = 0;      ///< since 1970, UTC
  std::int32_t first_sweeps = 0;  ///< that it had then; 0: none
  /// What was decided after each number of sweeps, lines.
  std::vector<std::string> said = {};
};

/// A priority that a person has set: it stands in for the one that a job's document says, as long
/// as that says `written`.
struct PriorityChange {
  std::int32_t written = 0, wanted = 0;
};

/// The frames of a job that count as done whatever is in their files.
struct JobLocks {
  std::set<FrameNumber> frames = {};
  /// When one was last locked or unlocked, milliseconds by UTC; 0: not known. It grows with each
  /// change, whatever the clock says.
  std::int64_t changed_ms = 0;
};

/// By what a job is found.
struct JobIndex {
  std::string name;
  std::string folder;  ///< that it writes to
};

/// One of the jobs that a text may mean.
struct FoundJob {
  Digest job;  ///< its newest version
  JobStatus status = JobStatus::running;
  /// By the text; else its ID, or the digest of a version, begins so.
  bool is_named = false;
  JobId id = {};
};

/// What a coordinator must not forget: jobs, completions, failures. A job that has ended is put
/// into the *archive*: its completions become one compressed record, and it is read again only when
/// somebody asks. Records are collected until
/// commit() makes all of them durable at once; a process that is killed before leaves none of them.
/// An error of any call leaves the journal unusable: stop, and start again from what was committed.
class Journal {
 public:
  /// Opens or creates the file and counts this start. Errors: in use by another coordinator,
  /// damaged, not a journal, made by a newer version.
  static Result<Journal> open(const std::filesystem::path& path);

  /// How often the journal was opened, from 1.
  std::uint32_t epoch() const { return epoch_; }

  /// The jobs that are not in the archive, in the order of submission.
  Result<std::vector<Digest>> jobs();
  /// The job must be there.
  Result<JournalledJob> load(const Digest& job);
  /// Who submitted which job, where that is known.
  Result<std::map<Digest, std::string>> owners();
  Status record_owner(const Digest& job, const std::string& owner);
  /// nullopt: no such job.
  Result<std::optional<std::string>> document(const Digest& job);
  /// What the sampler did, for each step of a run and tile that is recorded so far; in no order.
  Result<std::vector<FrameStats>> run_stats(const Digest& job, Run run);
  /// What was seen of a frame when it was put together; nullopt: it is not, or nothing was told.
  Result<std::optional<FrameStats>> frame_stats(const Digest& job, FrameIndex frame);
  /// How frames of a job stand, as far as it is known; all of which an assembly was granted.
  Result<std::map<FrameIndex, FrameFile>> frame_files(const Digest& job);
  /// By which workers know the store; nullopt: not recorded.
  Result<std::optional<std::string>> store_token();
  Status record_store_token(const std::string& token);
  /// The open jobs whose output folders are marked.
  Result<std::set<Digest>> output_marks();
  /// Every completion of a job, in the archive or not, in the order in which they were recorded;
  /// or, in no order, what JournalledJob::former says.
  enum class Which { done, former };
  Status for_each_completion(const Digest& job,
                             const std::function<Status(const Completion&)>& visit,
                             Which which = Which::done);
  /// At most `count` failed attempts, the newest last; below 0: all.
  Result<std::vector<Failure>> recent_failures(const Digest& job, int count);

  Status add_job(const Digest& job, const std::string& document, const JobIndex& index = {});
  /// Lets a job run again, in the archive or not, and forgets its failures, completions and former
  /// outputs: those that still hold are to be recorded anew.
  Status restart_job(const Digest& job);
  Status record_plan(const Digest& job, const JobPlan& plan);
  /// Forgets all of a job.
  Status delete_job(const Digest& job);
  Status record_status(const Digest& job, JobStatus status);
  Status record_completion(const Digest& job, const Completion& completion);
  /// Replaces the outputs of a task that is recorded as done; else nothing happens.
  Status record_outputs(const Digest& job, const TaskKey& task,
                        const std::vector<BlobRef>& outputs);
  Status record_failure(const Failure& failure);
  Status record_renderer(const Digest& job, const std::string& renderer, bool is_mixed);
  /// By what this coordinator has had a document rendered, also before it began again; an empty one
  /// among them: by any. None: nothing of it is rendered yet.
  Result<std::set<std::string>> renderers(const Digest& job);
  /// nullopt: the job's file of the frame is not in its place any more. That one was rendered is
  /// remembered as long as the job is.
  Status record_frame_file(const Digest& job, FrameIndex frame,
                           const std::optional<FrameFile>& file);
  /// folder: that is marked now; nullopt: the mark goes.
  Status record_output_mark(const Digest& job, const std::optional<std::string>& folder);
  /// What a job's output folder was, without links, when it was marked or a frame locked in it.
  Result<std::vector<std::string>> marked_folders(const Digest& job);
  Status record_marked_folder(const Digest& job, const std::string& folder);
  /// Forgets that these tasks were done, and remembers what some of them made.
  Status record_reopened(const Digest& job, const std::vector<TaskKey>& tasks,
                         const std::vector<Completions::Task>& former = {});

  // ---- the archive (journal_archive.cpp)
  /// Puts a job that has ended into the archive. summary, detail: for people, as the caller likes.
  /// kept: the blobs that it leaves in the store, none of them held.
  Status archive_job(const Digest& job, const Bytes& summary, const Bytes& detail,
                     const std::vector<BlobRef>& kept);
  /// Replaces what people are told of a job of the archive.
  Status describe_archived(const Digest& job, JobStatus status, const Bytes& summary,
                           const Bytes& detail);
  /// nullopt: the job is not in the archive.
  Result<std::optional<Bytes>> archived_detail(const Digest& job);
  /// Summaries of the newest `count` jobs in the archive, the oldest first.
  Result<std::vector<Bytes>> archived_summaries(int count);
  /// The jobs, in the archive or not, or those of this name, that know a folder by a name of which
  /// is_it(name) is true, or have marked one that had it; in the order of submission.
  Result<std::vector<Digest>> jobs_in(const std::function<bool(const std::string&)>& is_it,
                                      const std::optional<std::string>& name = {});
  /// The jobs of this name, or whose ID begins so, or the digest of a version; a few of them.
  Result<std::vector<FoundJob>> find_jobs(const std::string& text);
  /// Whether a job of the archive keeps the blob.
  Result<bool> is_kept(const Digest& blob);
  Result<std::vector<Digest>> kept_blobs(const Digest& job);
  /// What the blobs take that jobs of the archive keep, each counted once.
  Result<std::uint64_t> kept_bytes();
  /// The job keeps the blob no more.
  Status let_go(const Digest& job, const Digest& blob);

  // ---- who jobs are, and what happened (journal_events.cpp)
  /// The versions of all jobs, those of each in their order.
  Result<std::vector<JobVersion>> versions();
  Result<std::map<JobId, JobTimes>> times();
  /// The document is a job's newest version from now on, whatever it was before. Returns its
  /// number.
  Result<std::int32_t> record_version(const Digest& document, const JobId& id);
  Status record_times(const JobId& id, const JobTimes& times);
  Result<std::map<JobId, JobLocks>> locks();
  /// changed_ms: as in JobLocks.
  Status record_lock(const JobId& id, FrameNumber frame, bool is_locked, std::int64_t changed_ms);
  /// Of the jobs of which somebody has set it.
  Result<std::map<JobId, PriorityChange>> priorities();
  Status record_priority(const JobId& id, const PriorityChange& priority);
  /// Pictures in the places of a job's frames, by name in its folder, that a person has given up,
  /// and that are not replaced yet.
  Result<std::map<std::string, Digest>> given_up(const JobId& id);
  /// nullopt: it is replaced, or nobody says so any more.
  Status record_given_up(const JobId& id, const std::string& file,
                         const std::optional<Digest>& picture);
  /// An empty one: the job does not grow.
  Result<JobGrowth> growth(const JobId& id);
  /// Likewise.
  Status record_growth(const JobId& id, const JobGrowth& growth);
  /// Appends an event; its sequence number is given here.
  Status record_event(const FarmEvent& event);
  /// In the order of time.
  Result<std::vector<FarmEvent>> events(const EventQuery& query);
  /// Grants and arrivals of workers since the newest start of a coordinator that have no end.
  Result<std::vector<FarmEvent>> events_without_end();
  /// What forgotten events of a job counted, by kind.
  Result<std::map<FarmEventKind, EventSum>> event_sums(const JobId& job);
  /// Forgets events but the newest `most` and those before `until_ms`; what they counted is kept as
  /// sums for each job.
  Status forget_events(std::int64_t most, std::int64_t until_ms);

  /// Makes durable what was recorded since the last commit; nothing to do is a success.
  Status commit();

 private:
  explicit Journal(SqlDatabase database) : database_(std::move(database)) {}
  Status count_start();
  Status visit_recorded(const Digest& job, const std::function<Status(const Completion&)>& visit);
  Status visit_archived(const Digest& job, const std::function<Status(const Completion&)>& visit);
  Result<std::vector<FrameStats>> stats_of(const Digest& job, TaskKind kind, std::int32_t position);
  Result<SqlStatement*> read(std::string_view sql);
  Result<SqlStatement*> write(std::string_view sql);
  /// Runs a statement within a transaction, bound to these values.
  template <class... V>
  Status change(std::string_view sql, const V&... values) {
    BATON_ASSIGN(SqlStatement * statement, write(sql));
    (statement->bind(values), ...);
    return statement->run();
  }

  SqlDatabase database_;
  std::map<std::string_view, SqlStatement> statements_;  ///< prepared once, by their text
  std::uint32_t epoch_ = 0;
  bool in_transaction_ = false;
};

}  // namespace baton
