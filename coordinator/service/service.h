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

#include "coordinator/service/evidence.h"
#include "coordinator/service/farm_core.h"
#include "coordinator/service/file_waits.h"
#include "coordinator/service/folder_record.h"
#include "coordinator/service/job_report.h"

namespace baton {

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
  const std::string& endpoint() const { return farm_.router.endpoint(); }

  /// Works until `stop`, or a StopCoordinator, which also tells the workers to end. An error (of
  /// the journal) means that nothing can be promised any more: everything committed is safe, start
  /// again.
  Status run(const std::atomic<bool>& stop);
  /// What run() does with a message, and at the end of a turn: for tests without connections.
  Status handle(const Incoming& incoming);
  Status end_turn();

 private:
  explicit Service(std::unique_ptr<FarmCore> farm)
      : owned_farm_(std::move(farm)), farm_(*owned_farm_) {}

  Status restore_jobs();
  Status restore_job(const Digest& job);
  Status clean_up();
  Status turn();
  Status send_home();

  // Messages of workers.
  Status receive(const PeerId& peer, const WorkerHello& message);
  std::optional<std::string> other_build(const WorkerHello& hello) const;
  Status turn_away(const PeerId& peer, const WorkerHello& hello, const std::string& difference);
  Status receive_from(const std::string& worker, const LeaseRequest& message);
  Status receive_from(const std::string& worker, const Heartbeat& message);
  Status receive_from(const std::string& worker, const TaskDone& message);
  Status keep_frame_file(const TaskDone& report, const ReportedFrame& frame);
  Status receive_from(const std::string& worker, const TaskFailed& message);
  Status receive_from(const std::string& worker, const StatesPublished& message);
  Status receive_from(const std::string& worker, const LeaseReturn& message);
  Status receive_from(const std::string& worker, const BlobsLeft& message);
  Status receive_from(const std::string& worker, const WorkerGoodbye& message);

  // Who may do what.
  template <class M>
  Status forbid(const PeerId& peer);
  Result<Digest> resolve_own(const std::string& text);
  void tell(const std::string& warning);

  // What people, and workers, do with jobs (service_jobs.cpp).
  Status receive(const PeerId& peer, const JobDocumentRequest& message);
  Status receive(const PeerId& peer, const CancelJob& message);
  Status receive(const PeerId& peer, const PauseJob& message);
  Status receive(const PeerId& peer, const ResumeJob& message);
  Status receive(const PeerId& peer, const LockFrames& message);
  Status receive(const PeerId& peer, const SetPriority& message);
  Status receive(const PeerId& peer, const DeleteJob& message);
  Status receive(const PeerId& peer, const OrderWorker& message);
  Status receive(const PeerId& peer, const StopCoordinator& message);
  Status end_as_frames_stand(const ParsedJobDocument& document, const JobVersion& version,
                             const std::vector<FrameNumber>& locked,
                             const std::vector<FrameNumber>* unlocked);
  template <class E>
  Status change_job(const PeerId& peer, const std::string& prefix);

  // Whether a job is taken (service_submission.cpp).
  Status receive(const PeerId& peer, const SubmitJob& message);
  Status receive(const PeerId& peer, const AskRequeue& message);
  Result<std::optional<OddFrames>> await_frames(const PeerId& peer, const Message& message,
                                                const ParsedJobDocument& document, const JobId& id,
                                                const LockedFrames& locked);

  // Files that must be read before a message can be handled.
  Status handle_read();
  bool await_inputs(const std::string& worker, const TaskFailed& message);
  bool await_outputs(const TaskDone& message);
  Result<bool> await_documents(const PeerId& peer, const Message& message,
                               NeededDocuments documents);
  Result<bool> await_document_of(const PeerId& peer, const Message& message,
                                 const std::string& job);

  // Frames and their folder, while a job runs and at its end (service_frames.cpp).
  void start_inspections();
  Status end_inspection(const FilesRead& read);
  bool may_pass(const Digest& job);
  void pass(const Digest& job) { unreadable_.erase(job); }
  Status judge_place(const std::string& worker, const LeaseReturn& message);
  Result<bool> watch_folder(const Digest& job);

  std::unique_ptr<FarmCore> owned_farm_;
  FarmCore& farm_;
  OncePerPeer complained_, asked_for_hello_;
  Speaker speaker_;                        ///< who sent the message in hand
  std::map<std::string, TimePoint> told_;  ///< warnings, and when
  TimePoint next_tick_{};
  TimePoint next_clean_up_;
  bool stop_requested_ = false;
  bool has_unread_jobs_ = false;  ///< in the journal
  /// So long a start waits for files that cannot be read.
  TimePoint patient_until_{};
  /// Reports whose files are not there yet, and since when.
  std::map<LeaseId, TimePoint> late_;
  /// Since when a job has had a frame that cannot be read, and when that was seen last.
  struct Unreadable {
    TimePoint since, seen;
  };
  std::map<Digest, Unreadable> unreadable_;
  FileTable files_;  ///< frames, and inputs of failed attempts
  std::unique_ptr<FileWaits> waits_;
};

}  // namespace baton
