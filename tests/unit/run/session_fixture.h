#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "worker/run/session.h"

namespace baton::test {

using namespace std::chrono_literals;

/// A session at a clock that the test turns.
class SessionTest : public testing::Test {
 protected:
  /// Nothing is held: who leaves has packed it at once, unless the test does that itself.
  std::vector<SessionAction> step(const SessionEvent& event) {
    std::vector<SessionAction> actions = session_.step(event, now_);
    const bool leaves =
        std::any_of(actions.begin(), actions.end(), [](const SessionAction& action) {
          const auto* const pack = std::get_if<PackHeld>(&action);
          return pack != nullptr && !pack->request;
        });
    if (!leaves || holds_) return actions;
    const std::vector<SessionAction> more = session_.step(HeldPacked{}, now_);
    actions.insert(actions.end(), more.begin(), more.end());
    return actions;
  }
  std::vector<SessionAction> receive(Message message) {
    return step(MessageArrived{std::move(message)});
  }
  std::vector<SessionAction> welcome() {
    return receive(WorkerWelcome{.epoch = 1, .heartbeat_ms = 1000, .store_directory = "/store"});
  }
  std::vector<SessionAction> grant(const LeaseId& lease) { return receive(LeaseGrant{lease, {}}); }
  std::vector<SessionAction> finish(const LeaseId& lease) {
    return step(TaskEnded{lease, TaskResult{}});
  }
  std::vector<SessionAction> fail(const LeaseId& lease, ErrorKind kind) {
    return step(TaskEnded{lease, Error{kind, "broken"}});
  }
  std::vector<SessionAction> tick_after(std::chrono::milliseconds time) {
    now_ += time;
    return step(Tick{});
  }

  static LeaseId lease(std::int32_t tile) {
    return {.job = {1, 2}, .task = {TaskKind::render, 0, tile}, .attempt = 1, .epoch = 1};
  }

  TimePoint now_{};
  bool holds_ = false;
  Session session_{{.identity = {.worker_id = "w",
                                 .host = {},
                                 .num_threads = 2,
                                 .build = {},
                                 .renderer = {},
                                 .running = {}},
                    .give_up = 60s},
                   now_};
};

/// The sent messages of one type, in order.
template <class M>
std::vector<M> sent(const std::vector<SessionAction>& actions) {
  std::vector<M> messages;
  for (const SessionAction& action : actions) {
    const auto* send = std::get_if<SendMessage>(&action);
    if (send == nullptr) continue;
    if (const auto* message = std::get_if<M>(&send->message)) messages.push_back(*message);
  }
  return messages;
}

template <class A>
const A* find(const std::vector<SessionAction>& actions) {
  for (const SessionAction& action : actions) {
    if (const auto* found = std::get_if<A>(&action)) return found;
  }
  return nullptr;
}

}  // namespace baton::test
