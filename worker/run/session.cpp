#include "worker/run/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/limits.h"

namespace baton {
namespace {

using namespace std::chrono_literals;

/// Silence of so many heartbeats means "introduce yourself again".
constexpr int kSilentHeartbeats = 3;
constexpr auto kHelloInterval = 1000ms;
/// A farm that is full is asked again after this.
constexpr std::chrono::seconds kFullInterval{15};
/// A report that is not confirmed after so many heartbeats is sent again.
constexpr int kUnconfirmedHeartbeats = 2;
/// So long before it must be gone the worker gives back what it has not finished.
constexpr auto kFarewell = 2000ms;
/// Tasks take longer than the longest of late, and on other processors.
constexpr double kCaution = 1.5;

/// True for errors that every attempt on every worker would repeat.
bool is_permanent(ErrorKind kind) {
  return kind == ErrorKind::bad_input || kind == ErrorKind::version || kind == ErrorKind::usage;
}

}  // namespace

Session::Session(SessionOptions options, TimePoint now)
    : options_(std::move(options)),
      last_busy_(now),
      last_heard_(now),
      next_hello_(now),
      next_heartbeat_(now),
      next_request_(now),
      request_expires_(now) {
  if (options_.end_at) give_back_at_ = *options_.end_at - kFarewell;
}

std::vector<SessionAction> Session::step(const SessionEvent& event, TimePoint now) {
  Actions actions;
  std::visit([&](const auto& e) { on(e, now, actions); }, event);
  if (draining_ && in_hand_.empty() && reports_.empty())
    leave("all running tasks are finished", actions);
  return actions;
}

// ---- events -------------------------------------------------------------------------------------

void Session::on(const MessageArrived& event, TimePoint now, Actions& actions) {
  last_heard_ = now;
  std::visit(
      [&](const auto& message) {
        // A message that no coordinator sends to a worker is ignored.
        if constexpr (requires { this->receive(message, now, actions); }) {
          receive(message, now, actions);
        }
      },
      event.message);
}

void Session::on(const TaskExecuted& event, TimePoint now, Actions& actions) {
  if (!in_hand_.contains(event.lease)) return;
  executed_.insert(event.lease);
  request_leases(now, actions);
}

void Session::on(const TaskEnded& event, TimePoint now, Actions& actions) {
  executed_.erase(event.lease);
  if (in_hand_.erase(event.lease) == 0) {  // its end was told before
    tell_left(event.lease, event.result ? event.result->made.outputs : event.left, actions);
    return;
  }
  next_request_ = now;  // what ended may have made work

  // Report, unless the task was given up.
  const bool is_undone =
      event.result &&
      (!event.result->unseen.empty() || !event.result->not_held.empty() || event.result->in_place);
  if (is_undone) {
    const PictureInPlace picture = event.result->in_place.value_or(PictureInPlace());
    actions.push_back(
        SendMessage{LeaseReturn{event.lease, event.result->unseen, event.result->not_held,
                                picture.digest, picture.writer}});
  } else if (event.result) {
    reports_.push_back(
        {event.lease,
         TaskDone{event.lease, event.result->made, event.result->frame, event.result->notes}, now});
    send_report(reports_.back(), now, actions);
  } else if (event.result.error().kind != ErrorKind::cancelled) {
    const Error& error = event.result.error();
    reports_.push_back({event.lease,
                        TaskFailed{event.lease, error.message, is_permanent(error.kind),
                                   error.kind == ErrorKind::no_space},
                        now});
    send_report(reports_.back(), now, actions);
  } else if (draining_) {
    actions.push_back(SendMessage{LeaseReturn{event.lease}});  // nobody had begun it
  }
  tell_left(event.lease, event.left, actions);
  request_leases(now, actions);
}

void Session::on(const DocumentMissing& event, TimePoint, Actions& actions) {
  if (!documents_missing_.insert(event.job).second) return;
  actions.push_back(SendMessage{JobDocumentRequest{event.job}});
}

void Session::on(const HeldPacked& event, TimePoint, Actions& actions) {
  for (const StatesPublished& message : event.messages) actions.push_back(SendMessage{message});
  if (!leaving_) return;
  actions.push_back(SendMessage{WorkerGoodbye{}});
  actions.push_back(Leave{ExitCode::ok, *leaving_});
}

void Session::on(const DrainRequested&, TimePoint now, Actions& actions) {
  draining_ = true;
  next_heartbeat_ = now;  // which says so
  if (options_.drain > 0s) {
    const TimePoint end = now + options_.drain;
    give_back_at_ = std::min(give_back_at_.value_or(end), end);
  }
  actions.push_back(DropQueuedTasks{});
}

void Session::on(const GiveBackRequested&, TimePoint, Actions& actions) {
  leave("what is not finished goes to others", actions);
}

void Session::on(const Tick&, TimePoint now, Actions& actions) {
  if (give_back_at_ && now >= *give_back_at_) {
    leave(in_hand_.empty() ? "its time is up"
                           : fmt::format("its time is up: {} tasks go to others", in_hand_.size()),
          actions);
    return;
  }
  const bool idle = (welcomed_ || waits_for_room_) && in_hand_.empty() && reports_.empty();
  if (!idle) last_busy_ = now;
  if (options_.idle_exit > 0s && now - last_busy_ >= options_.idle_exit) {
    leave(fmt::format("there was nothing to do for {} s", options_.idle_exit.count()), actions);
    return;
  }
  const auto silence = now - last_heard_;
  if (options_.give_up > 0s && silence > options_.give_up) {
    actions.push_back(
        Leave{ExitCode::unavailable,
              fmt::format("no coordinator has answered for {} s", options_.give_up.count())});
    return;
  }
  if (silence > kSilentHeartbeats * heartbeat_) welcomed_ = false;
  if (!welcomed_) {
    if (now >= next_hello_) introduce(now, actions);
    return;
  }

  // A heartbeat names the leases in hand and repeats the questions that were not answered.
  if (now >= next_heartbeat_) {
    next_heartbeat_ = now + heartbeat_;
    for (Report& report : reports_) {
      if (now - report.sent >= kUnconfirmedHeartbeats * heartbeat_)
        send_report(report, now, actions);
    }
    actions.push_back(SendMessage{Heartbeat{leases_in_hand(), draining_}});
    for (const Digest& job : documents_missing_) {
      actions.push_back(SendMessage{JobDocumentRequest{job}});
    }
  }
  if (now >= request_expires_) requested_ = 0;
  request_leases(now, actions);
}

// ---- messages -----------------------------------------------------------------------------------

void Session::receive(const WorkerWelcome& welcome, TimePoint now, Actions& actions) {
  welcomed_ = true;
  waits_for_room_ = false;
  heartbeat_ = std::chrono::milliseconds(std::max(1, welcome.heartbeat_ms));
  next_heartbeat_ = now + heartbeat_;
  actions.push_back(UseStore{welcome.store_directory, welcome.token});

  // What was reported to a coordinator that died may be lost: report it again, in order, before
  // requesting more.
  for (Report& report : reports_) send_report(report, now, actions);
  requested_ = 0;
  next_request_ = now;
  request_leases(now, actions);
}

void Session::receive(const LeaseGrant& grant, TimePoint now, Actions& actions) {
  requested_ = std::max(0, requested_ - 1);
  if (in_hand_.contains(grant.lease)) return;
  const bool late = !fits(grant, now);
  if (draining_ || late) actions.push_back(SendMessage{LeaseReturn{grant.lease}});
  if (late && !draining_) {
    actions.push_back(Warn{fmt::format("it has no time for a task of about {:.0f} s: takes no more",
                                       grant.expected_seconds)});
    draining_ = true;  // what it has begun it can finish
  }
  if (draining_) return;
  in_hand_.insert(grant.lease);
  actions.push_back(StartTask{grant});
  request_leases(now, actions);
}

void Session::receive(const LeaseRevoke& revoke, TimePoint, Actions& actions) {
  if (in_hand_.contains(revoke.lease)) actions.push_back(StopTask{revoke.lease});
  for (const Report& report : reports_) {
    const auto* const done = std::get_if<TaskDone>(&report.message);
    if (done && report.lease == revoke.lease) tell_left(report.lease, done->made.outputs, actions);
  }
  forget_report(revoke.lease);
}

void Session::receive(const ReportReceived& received, TimePoint now, Actions& actions) {
  forget_report(received.lease);
  request_leases(now, actions);
}

void Session::receive(const RequestStates& request, TimePoint, Actions& actions) {
  actions.push_back(PackHeld{request});
}

void Session::receive(const NoWork& no_work, TimePoint now, Actions&) {
  requested_ = 0;
  next_request_ = now + std::chrono::milliseconds(no_work.retry_ms);
}

void Session::receive(const HelloAgain&, TimePoint now, Actions& actions) {
  // One hello is enough, however many messages the coordinator did not understand.
  if (welcomed_ || now >= next_hello_) introduce(now, actions);
}

void Session::receive(const JobDocument& document, TimePoint, Actions& actions) {
  documents_missing_.erase(document.job);
  actions.push_back(TakeDocument{document});
}

void Session::receive(const Drain&, TimePoint now, Actions& actions) {
  on(DrainRequested{}, now, actions);
}

void Session::receive(const Shutdown&, TimePoint, Actions& actions) {
  actions.push_back(Leave{ExitCode::ok, "the coordinator shuts down"});
}

void Session::receive(const Refused& refused, TimePoint now, Actions& actions) {
  // Another version, or a key that is not that of a worker, will not change its mind; anything else
  // is worth a line in the log.
  const auto kind = static_cast<ErrorKind>(refused.kind);
  if (kind == ErrorKind::version || kind == ErrorKind::usage) {
    actions.push_back(Leave{exit_code_of(kind), refused.message});
    return;
  }
  actions.push_back(Warn{"the coordinator says: " + refused.message});
  // A farm that is full needs the connection, and may have room later.
  if (kind != ErrorKind::timeout || welcomed_) return;
  const bool is_hasty = options_.give_up > 0s && options_.give_up < 2 * kFullInterval;
  next_hello_ = now + (is_hasty ? options_.give_up / 2 : kFullInterval);
  waits_for_room_ = true;
  actions.push_back(HangUp{});
}

// ---- helpers ------------------------------------------------------------------------------------

/// Whether a task is finished before the worker must be gone, as far as anybody can say. Where all
/// threads are busy it begins when one of them ends.
bool Session::fits(const LeaseGrant& grant, TimePoint now) const {
  if (!give_back_at_) return true;
  const bool waits = std::ssize(in_hand_) >= options_.identity.num_threads;
  const std::chrono::duration<double> expected(kCaution * grant.expected_seconds * (waits ? 2 : 1));
  return now + expected <= *give_back_at_;
}

/// The goodbye gives back whatever is in hand.
void Session::leave(std::string reason, Actions& actions) {
  if (leaving_) return;
  leaving_ = std::move(reason);
  actions.push_back(PackHeld{});
}

void Session::introduce(TimePoint now, Actions& actions) {
  welcomed_ = false;
  next_hello_ = now + kHelloInterval;
  WorkerHello hello = options_.identity;
  hello.running = leases_in_hand();
  actions.push_back(SendMessage{std::move(hello)});
}

void Session::request_leases(TimePoint now, Actions& actions) {
  if (!welcomed_ || draining_ || now < next_request_) return;
  if (reports_.size() >= limits::kMaxUnconfirmedReports) return;  // first some must be confirmed

  // One task more than threads, so that the next one is here when one ends. What waits for the disk
  // needs no thread; when it is one for each thread, the disk is what is short. A request replaces
  // the one before.
  const std::int32_t threads = options_.identity.num_threads;
  const auto waiting = static_cast<std::int32_t>(executed_.size());
  const std::int32_t wanted =
      threads + 1 + std::min(waiting, threads) - static_cast<std::int32_t>(in_hand_.size());
  if (wanted <= requested_) return;
  requested_ = wanted;
  request_expires_ = now + 2 * heartbeat_;
  actions.push_back(SendMessage{LeaseRequest{wanted}});
}

void Session::send_report(Report& report, TimePoint now, Actions& actions) const {
  report.sent = now;
  if (welcomed_) actions.push_back(SendMessage{report.message});
}

void Session::forget_report(const LeaseId& lease) {
  std::erase_if(reports_, [&](const Report& report) { return report.lease == lease; });
}

/// Names what an attempt without a result has put into the store, so that it need not wait there
/// until leftovers are cleaned up.
void Session::tell_left(const LeaseId& lease, const std::vector<BlobRef>& left, Actions& actions) {
  BlobsLeft message{lease, stored_blobs(left)};
  if (!message.blobs.empty()) actions.push_back(SendMessage{std::move(message)});
}

/// A report that is not confirmed counts: a coordinator that lost it must keep or adopt the lease
/// until the report comes again.
std::vector<LeaseId> Session::leases_in_hand() const {
  std::set<LeaseId> leases = in_hand_;
  for (const Report& report : reports_) leases.insert(report.lease);
  return {leases.begin(), leases.end()};
}

}  // namespace baton
