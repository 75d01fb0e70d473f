#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/text/roots.h"
#include "common/protocol/router.h"
#include "common/store/blob_store.h"
#include "coordinator/journal/journal.h"
#include "coordinator/schedule/scheduler.h"
#include "coordinator/service/file_reader.h"
#include "coordinator/service/file_table.h"
#include "coordinator/service/folder_record.h"
#include "coordinator/service/garbage.h"
#include "coordinator/service/history.h"
#include "coordinator/service/locked_frames.h"
#include "coordinator/service/peers.h"

namespace baton {

struct ServiceOptions {
  std::string listen = "tcp://127.0.0.1:5570";
  std::filesystem::path work_dir;             ///< holds journal.sqlite and store/
  std::chrono::milliseconds heartbeat{1000};  ///< between signs of life of a worker
  /// Without one for so long it loses its leases.
  std::chrono::milliseconds silence_limit() const { return 4 * heartbeat; }
  /// Workers may be of other builds and instruction sets.
  bool mixed_builds = false;
  ServerAccess access = {};  ///< who is let in
  /// Folders that jobs may read from and write to.
  Roots roots = {};
  /// The highest that a user's key may give; an admin's may give any.
  std::int32_t user_priority = limits::kMaxUserPriority;
  /// Bytes that blobs may take; 0: as the disk has room.
  std::uint64_t store_limit = 0;
  std::chrono::milliseconds clean_up_every =
      BlobStore::kLeftoverAge;  ///< when the store is searched for leftovers
  /// How long a file that a worker reports may be missing here, or a frame be unreadable: a disk of
  /// another machine may be late, or away for a moment.
  std::chrono::milliseconds file_patience{5000};
  /// Reads whole files, on a thread of its own.
  Disk disk = {};
};

/// What the parts of a coordinator work on together: scheduler, journal, store and workers. It
/// carries out what the scheduler decides. What others learn of it, and blobs that go, wait for
/// let_out(), which follows the commit of the journal.
class FarmCore {
 public:
  FarmCore(const ServiceOptions& options, Router router, Journal journal, BlobStore store,
           std::string token);

  const ServiceOptions options;
  const std::filesystem::path store_directory;
  /// By which workers tell the folders that this coordinator sees.
  const std::string token;
  Router router;
  Journal journal;
  BlobStore store;
  Scheduler scheduler;
  Peers peers;
  History history;
  std::map<Digest, std::string> owners;  ///< who submitted which job
  /// What workers say of the files of living jobs.
  std::map<Digest, std::vector<std::string>> notes;
  std::map<Digest, std::vector<std::string>> lost_before;  ///< what open jobs lacked at the start
  Garbage garbage;
  /// Jobs whose frames are to be compared with the record, and when.
  std::map<Digest, TimePoint> to_inspect;

  /// Frames of a version that count as done.
  LockedFrames locked(const Digest& version, const JobSpec& spec) const {
    return {spec, history.jobs().locked(history.jobs().of(version).id)};
  }
  /// Something happens; what follows is journalled, sent or noted for the end of the turn.
  Status step(const Event& event);
  /// Sends what waited for the commit, and removes blobs that nobody needs.
  Status let_out();

  // What is answered waits for the end of the turn; these never fail.
  Status reply(const PeerId& peer, Message message);
  Status reply_to(const std::string& worker, Message message);
  Status refuse(const PeerId& peer, const Error& error);
  /// How many answers wait, and an answer that goes out before all after so many.
  std::size_t num_replies() const { return outbox_.size(); }
  void reply_at(std::size_t place, const PeerId& peer, Message message);

  /// Empty: nobody is known.
  std::string owner_of(const Digest& job) const;
  /// usage: the speaker is a user, and the job somebody else's.
  Status check_own(const Speaker& speaker, const Digest& job) const;
  /// Writes the store's token again where it is gone: without it no worker believes to see the
  /// store.
  void keep_token() const;
  /// Marks the output folder of an open job, once, for workers and for lost_mark(). Returns the
  /// token; empty: it cannot be marked, or the job has ended.
  Result<std::string> mark_output(const Digest& job);
  /// Marks it again: it has turned out to be the folder.
  Status mark_output_again(const Digest& job);
  /// Why the output folder of an open job is not the one that was marked, with its name; nullopt:
  /// it is, none was, or the disk does not say now.
  std::optional<std::string> lost_mark(const Digest& job, const JobSpec& spec) const;
  /// Whether an open job may replace a picture that was found in the place of a frame. Then leases
  /// of it say so from now on.
  Result<bool> may_replace(const Digest& job, const std::filesystem::path& path,
                           const FileVerdict& picture);
  /// A person has said that the job may replace these.
  Status give_up(const Digest& job, const std::vector<FramesInDoubt::Frame>& frames);
  /// It may not any more: files of these names.
  Status take_back(const JobId& id, const std::function<bool(const std::string& file)>& which);
  /// Takes up the marks of a coordinator before this one.
  Status take_up_marks();
  /// The document for replays outlives its job only if that has failed.
  void remove_job_file(const Digest& job, JobStatus status);

  /// The job has ended: it leaves the memory at the end of the turn.
  void note_ended(const Digest& job) { ended_.push_back(job); }
  /// Jobs that have ended leave the memory. files: of frames that were to be made once more, and
  /// were not, those that stand as before are the job's.
  Status archive_ended(const FileTable& files);
  /// A job that has ended leaves the memory; what people may ask of it, and its blobs that a later
  /// job may go on from, stand in the archive. One that is there, or runs again, stays as it is.
  /// stand: frames that count as done, as before they were to be made once more.
  Status archive_job(const Digest& job, const std::set<FrameIndex>& stand = {});
  /// Tells the scheduler what ended jobs leave in the store. Where an open job has no room, what
  /// earlier versions of jobs left goes before: nobody can ask for it by name; and what those left
  /// for which the store was too small.
  Status count_kept();
  /// Describes a job that the scheduler has.
  Result<JobDetail> living_detail(const Digest& job);
  /// Describes a job of the archive; nullopt: it is not there.
  Result<std::optional<JobDetail>> archived_detail(const Digest& job);
  /// Whether a job has failed for its frames alone, or was done and still has those that are
  /// `unlocked` (null: one that was done does not count). One that is has failed for this reason
  /// from now on; empty: it stays as it is.
  Result<bool> ended_by_frames(const Digest& job, const std::string& reason,
                               const std::vector<FrameNumber>* unlocked);

 private:
  // Actions of the scheduler.
  Status perform(const RecordCompletion& action);
  Status perform(const RecordOutputs& action);
  Status perform(const RecordFailure& action);
  Status perform(const RecordReopened& action);
  Status perform(const RecordJobStatus& action);
  Status perform(const RecordRenderer& action);
  Status perform(const InspectFrames& action);
  Status perform(const GrantLease& action);
  Status perform(const TellLeaseEnd& action);
  Status perform(const TellLeaseTaken& action);
  Status perform(const AskForStates& action);
  Status perform(const RevokeLease& action);
  Status perform(const ReportNoWork& action);
  Status perform(const ForgetWorker& action);
  Status perform(const ReportConflict& action);
  Status perform(const RemoveBlobs& action);

  Status let_superseded_go();

  Result<FolderRecord*> record_of(const Digest& job);
  Result<std::vector<Digest>> replaceable(const LeaseId& lease);

  struct Outgoing {
    PeerId peer;
    Message message;
  };
  std::vector<Outgoing> outbox_;                      ///< waits for the commit
  std::vector<Digest> ended_;                         ///< jobs to be archived
  std::set<Digest> marked_;                           ///< open jobs whose output folder is marked
  std::map<Digest, std::filesystem::path> unmarked_;  ///< marks that go after the commit
  std::map<Digest, FolderRecord> records_;            ///< of folders of open jobs, once asked for
  /// That the archive keeps, as the scheduler was told.
  std::uint64_t kept_bytes_ = 0;
  bool superseded_keep_ = true;  ///< versions that are not the newest may
  /// Jobs that have ended since the store was too small for them.
  std::set<Digest> hopeless_;
};

}  // namespace baton
