#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/text/job_json.h"
#include "common/job/text/roots.h"
#include "common/protocol/router.h"
#include "common/store/blob_store.h"
#include "coordinator/journal/journal.h"
#include "coordinator/schedule/adoption.h"
#include "coordinator/schedule/scheduler.h"
#include "coordinator/service/file_waits.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/peers.h"

namespace baton {

struct ServiceOptions {
  std::string listen = "tcp://127.0.0.1:5570";
  std::filesystem::path work_dir;  ///< holds journal.sqlite and store/
  /// Between signs of life of a worker; without four of them it loses its leases.
  std::chrono::milliseconds heartbeat{1000};
  /// Workers may be of other builds and instruction sets.
  bool mixed_builds = false;
  ServerAccess access = {};  ///< who is let in
  /// Folders that jobs may read from and write to.
  Roots roots = {};
  /// Bytes that blobs may take; 0: as the disk has room.
  std::uint64_t store_limit = 0;
  std::chrono::milliseconds sweep_every =
      BlobStore::kLeftoverAge;  ///< when the store is searched for leftovers
  /// Reads whole files, on a thread of its own; a test may make it slow.
  FileReader::DigestFile digest_file = digest_of_file;
};

/// The coordinator: one thread that turns messages into events, actions into messages. A turn of
/// its loop takes what has arrived, commits the journal once, and only then lets out what follows:
/// nobody learns of anything that a crash could undo, and no blob is removed before what replaces
/// it is durable. No file is read whole on this thread: a message that depends on the bytes of
/// frames or blobs waits (FileWaits) for the thread of a FileReader.
class Service {
 public:
  /// Takes up the jobs of the journal. What is missing of a running job is made again; where that
  /// cannot be told now, the job is paused.
  /// Errors: the work folder, the journal (in use, damaged, newer), the address.
  static Result<Service> open(const ServiceOptions& options);

  /// The concrete endpoint: with the port that was picked.
  const std::string& endpoint() const { return router_.endpoint(); }

  /// Works until `stop`, or a StopCoordinator, which also tells the workers to end. An error (of
  /// the journal) means that nothing can be promised any more: everything committed is safe, start
  /// again.
  Status run(const std::atomic<bool>& stop);

 private:
  Service(const ServiceOptions& options, Router router, Journal journal, BlobStore store,
          std::string token);

  Status restore_jobs();
  Status restore_job(const Digest& job);
  Status sweep();
  Status count_kept();
  Status turn();
  Status archive_ended();
  Status handle(const Incoming& incoming);
  Status step(const Event& event);
  Status let_out();

  // Messages of workers.
  Status receive(const PeerId& peer, const WorkerHello& message);
  std::optional<std::string> other_build(const WorkerHello& hello) const;
  Status receive_from(const std::string& worker, const LeaseRequest& message);
  Status receive_from(const std::string& worker, const Heartbeat& message);
  Status receive_from(const std::string& worker, const TaskDone& message);
  Status receive_from(const std::string& worker, const TaskFailed& message);
  Status receive_from(const std::string& worker, const StatesPublished& message);
  Status receive_from(const std::string& worker, const LeaseReturn& message);
  Status receive_from(const std::string& worker, const BlobsLeft& message);
  Status receive_from(const std::string& worker, const WorkerGoodbye& message);

  // Who may do what (service_access.cpp).
  template <class M>
  Status forbid(const PeerId& peer);
  Status check_own(const Digest& job) const;
  Result<Digest> resolve_own(const std::string& text);
  std::string owner_of(const Digest& job) const;
  void tell_refusals();
  void tell(const std::string& warning);

  // Questions of anybody (service_jobs.cpp).
  Status receive(const PeerId& peer, const JobDocumentRequest& message);
  Status receive(const PeerId& peer, const SubmitJob& message);
  Status receive(const PeerId& peer, const ListJobs& message);
  Status receive(const PeerId& peer, const ShowJob& message);
  Status receive(const PeerId& peer, const CancelJob& message);
  Status receive(const PeerId& peer, const PauseJob& message);
  Status receive(const PeerId& peer, const ResumeJob& message);
  Status receive(const PeerId& peer, const DeleteJob& message);
  Status receive(const PeerId& peer, const DrainWorker& message);
  Status receive(const PeerId& peer, const StopCoordinator& message);
  Result<LostFiles> lost_files_of(const Digest& job);
  static void tell_lost(const Digest& job, const LostFiles& lost);
  template <class E>
  Status change_job(const PeerId& peer, const std::string& prefix);
  Status answer_detail(const PeerId& peer, const Digest& job, std::string plan = {});
  Result<JobDetail> living_detail(const Digest& job);
  Result<std::optional<JobDetail>> archived_detail(const Digest& job);
  Result<Digest> resolve(const std::string& text);
  Status archive_job(const Digest& job);

  // Files that must be read before a message can be handled (service_files.cpp).
  Status handle_read();
  bool await_inputs(const std::string& worker, const TaskFailed& message);
  Result<bool> await_frames(const PeerId& peer, const Message& message, const Digest& job,
                            const JobSpec& spec);
  Result<std::vector<std::filesystem::path>> unread_frames(const JobSpec& job);

  // Submission (service_submit.cpp).
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

  // Actions of the scheduler.
  Status perform(const RecordCompletion& action);
  Status perform(const RecordOutputs& action);
  Status perform(const RecordFailure& action);
  Status perform(const RecordReopened& action);
  Status perform(const RecordJobStatus& action);
  Status perform(const GrantLease& action);
  Status perform(const AskForStates& action);
  Status perform(const RevokeLease& action);
  Status perform(const ReportNoWork& action);
  Status perform(const ForgetWorker& action);
  Status perform(const ReportConflict& action);
  Status perform(const RemoveBlobs& action);

  std::string mark_output(const Digest& job) const;
  void remove_job_file(const Digest& job, JobStatus status);
  // What is answered waits for the end of the turn; these never fail.
  Status reply(const PeerId& peer, Message message);
  Status reply_to(const std::string& worker, Message message);
  Status refuse(const PeerId& peer, const Error& error);
  const Scheduler::Job* job_of_open_task(const LeaseId& lease) const;
  bool writes_nowhere(const LeaseId& lease) const;
  void keep_notes(const TaskDone& report);
  std::optional<std::string> find_missing_blob(const TaskDone& report) const;
  std::optional<std::string> find_missing_frame(const TaskDone& report) const;
  std::vector<BlobRef> leased_inputs(const LeaseId& lease) const;
  std::optional<std::vector<BlobRef>> find_bad_inputs(const LeaseId& lease);

  ServiceOptions options_;
  std::filesystem::path store_directory_;
  /// By which workers tell the folders that this coordinator sees.
  std::string token_;
  Router router_;
  Journal journal_;
  BlobStore store_;
  Scheduler scheduler_;
  Peers peers_;
  OncePerPeer complained_, asked_for_hello_;
  std::map<Digest, std::string> owners_;
  Speaker speaker_;                        ///< who sent the message in hand
  std::map<std::string, TimePoint> told_;  ///< warnings, and when
  TimePoint next_tick_{};
  TimePoint next_sweep_;
  bool stop_requested_ = false;
  bool has_unread_jobs_ = false;  ///< in the journal
  /// That the archive keeps, as the scheduler was told.
  std::uint64_t kept_bytes_ = 0;

  struct Outgoing {
    PeerId peer;
    Message message;
  };
  std::vector<Outgoing> outbox_;  ///< waits for the commit
  std::vector<Digest> garbage_;   ///< likewise
  /// That the disk would not let go: tried again with each tick.
  std::set<Digest> unremoved_;
  /// Jobs, to be archived at the end of the turn.
  std::vector<Digest> ended_;
  FileTable files_;                   ///< frames, and inputs of failed attempts
  std::unique_ptr<FileWaits> waits_;  ///< made by run()
  /// What workers say of the files of living jobs.
  std::map<Digest, std::vector<std::string>> notes_;
  std::map<Digest, std::vector<std::string>> lost_before_;  ///< what open jobs lacked at the start
};

}  // namespace baton
