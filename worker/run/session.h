#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "common/base/exit_codes.h"
#include "common/protocol/messages.h"
#include "worker/run/execute.h"

namespace baton {

using TimePoint = std::chrono::steady_clock::time_point;

/// Who the worker is and how patient.
struct SessionOptions {
  WorkerHello identity;  ///< `running` is filled in by the session
  /// Silence of the coordinator after which the worker ends; 0: never.
  std::chrono::seconds give_up{60};
  std::optional<TimePoint> end_at = {};  ///< when it must be gone
  /// Time without a task after which the worker ends; 0: never.
  std::chrono::seconds idle_exit{0};
  /// Time that the worker goes on with its tasks when told to end; 0: to their end.
  std::chrono::seconds drain{0};
};

// ---- events: what happened to the worker --------------------------------------------------------
struct MessageArrived {
  Message message;
};
/// Its thread is free, its outputs are on their way to the disk: TaskEnded follows.
struct TaskExecuted {
  LeaseId lease;
};
/// A started task belongs to a job that this process has not seen.
struct DocumentMissing {
  Digest job;
};
/// PackHeld is done; what could not be put into the store is left out.
struct HeldPacked {
  std::vector<StatesPublished> messages;
};
/// SIGTERM or the coordinator: finish what is in work, take nothing new.
struct DrainRequested {};
/// A second SIGTERM: finish nothing, others will.
struct GiveBackRequested {};
struct Tick {};  ///< time has passed
using SessionEvent = std::variant<MessageArrived, TaskExecuted, TaskEnded, DocumentMissing,
                                  HeldPacked, DrainRequested, GiveBackRequested, Tick>;

// ---- actions: what the program around the session must do ---------------------------------------
struct SendMessage {
  Message message;
};
struct UseStore {
  std::string directory, token;
};
struct StartTask {
  Grant grant;
};
/// Put states that are held into the store: of one job those that are named, or all of all jobs.
/// HeldPacked is the answer.
struct PackHeld {
  std::optional<RequestStates> request;
};
struct StopTask {
  LeaseId lease;
};
struct DropQueuedTasks {};  ///< forget what no thread has begun
struct TakeDocument {
  JobDocument document;
};
struct Warn {
  std::string message;
};
/// End the connection until there is something to say.
struct HangUp {};
struct Leave {
  ExitCode code = ExitCode::ok;
  std::string reason;
};  ///< abandon everything and end
using SessionAction = std::variant<SendMessage, UseStore, StartTask, PackHeld, StopTask,
                                   DropQueuedTasks, TakeDocument, Warn, HangUp, Leave>;

/// The worker's side of the conversation with the coordinator: events in, actions out. Knows no
/// socket, thread or file; time comes as an argument.
///
/// introducing --WorkerWelcome--> working --DrainRequested--> draining --last report confirmed-->
/// packing --HeldPacked--> (Leave)
/// What it has not finished when its time is up goes back to the coordinator with its goodbye; so
/// does at once what is granted too late to be finished, after which it drains.
/// A HelloAgain, or silence of kSilentHeartbeats, leads back to introducing. A report is said
/// again, after each welcome and when it is not answered, until the coordinator has confirmed it or
/// has revoked its lease. The coordinator fences what it has seen before, so sending twice is safe.
class Session {
 public:
  explicit Session(SessionOptions options, TimePoint now);

  std::vector<SessionAction> step(const SessionEvent& event, TimePoint now);

 private:
  using Actions = std::vector<SessionAction>;
  struct Report {
    LeaseId lease;
    Message message;
    TimePoint sent;
  };

  void on(const MessageArrived& event, TimePoint now, Actions& actions);
  void on(const TaskExecuted& event, TimePoint now, Actions& actions);
  void on(const TaskEnded& event, TimePoint now, Actions& actions);
  void on(const DocumentMissing& event, TimePoint now, Actions& actions);
  void on(const HeldPacked& event, TimePoint now, Actions& actions);
  void on(const DrainRequested& event, TimePoint now, Actions& actions);
  void on(const GiveBackRequested& event, TimePoint now, Actions& actions);
  void on(const Tick& event, TimePoint now, Actions& actions);

  void receive(const WorkerWelcome& welcome, TimePoint now, Actions& actions);
  void receive(const LeaseGrant& grant, TimePoint now, Actions& actions);
  void receive(const LeaseRevoke& revoke, TimePoint now, Actions& actions);
  void receive(const RequestStates& request, TimePoint now, Actions& actions);
  void receive(const NoWork& no_work, TimePoint now, Actions& actions);
  void receive(const ReportReceived& received, TimePoint now, Actions& actions);
  void receive(const HelloAgain& again, TimePoint now, Actions& actions);
  void receive(const JobDocument& document, TimePoint now, Actions& actions);
  void receive(const Drain& drain, TimePoint now, Actions& actions);
  void receive(const Shutdown& shutdown, TimePoint now, Actions& actions);
  void receive(const Refused& refused, TimePoint now, Actions& actions);

  bool fits(const LeaseGrant& grant, TimePoint now) const;
  void leave(std::string reason, Actions& actions);
  void introduce(TimePoint now, Actions& actions);
  void send_report(Report& report, TimePoint now, Actions& actions) const;
  void forget_report(const LeaseId& lease);
  static void tell_left(const LeaseId& lease, const std::vector<BlobRef>& left, Actions& actions);
  void request_leases(TimePoint now, Actions& actions);
  std::vector<LeaseId> leases_in_hand() const;

  SessionOptions options_;
  bool welcomed_ = false;
  bool waits_for_room_ = false;  ///< the farm was full
  bool draining_ = false;
  std::optional<std::string> leaving_;     ///< why; all that is held is being packed
  std::optional<TimePoint> give_back_at_;  ///< what is not finished then goes back
  std::chrono::milliseconds heartbeat_{1000};
  std::set<LeaseId> in_hand_;  ///< granted and not ended
  /// Leases in hand whose tasks have left their thread.
  std::set<LeaseId> executed_;
  std::set<Digest> documents_missing_;  ///< requested, not yet here
  std::deque<Report> reports_;          ///< not confirmed, oldest first
  std::int32_t requested_ = 0;          ///< leases in the last request
  TimePoint last_busy_, last_heard_, next_hello_, next_heartbeat_, next_request_, request_expires_;
};

}  // namespace baton
