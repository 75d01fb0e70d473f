#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "coordinator/service/job_report.h"
#include "coordinator/service/permissions.h"
#include "coordinator/service/service.h"

namespace baton {
namespace {

/// What comes again is told so often.
constexpr std::chrono::minutes kTellInterval{1};
constexpr std::size_t kMaxTold = 100;

}  // namespace

/// Refuses, and logs, what the speaker may not say.
template <class M>
Status Service::forbid(const PeerId& peer) {
  const std::string text =
      fmt::format("{} '{}' may not {}", role_name(speaker_.role), speaker_.name, kRights<M>.what);
  if (complained_.first(peer)) spdlog::warn("refused: {}", text);
  return refuse(peer, {ErrorKind::usage, text});
}

Status Service::handle(const Incoming& incoming) {
  const PeerId& peer = incoming.peer;
  if (!incoming.message) {
    if (complained_.first(peer)) spdlog::warn("bad message: {}", incoming.message.error().message);
    return refuse(peer, incoming.message.error());
  }
  const std::string worker = peers_.worker_of(peer);
  speaker_ = incoming.speaker;
  return std::visit(
      [&](const auto& message) -> Status {
        using M = std::decay_t<decltype(message)>;
        if (may_say<M>(speaker_) == May::no) return forbid<M>(peer);
        if constexpr (requires { this->receive(peer, message); }) {
          return receive(peer, message);
        } else if constexpr (requires { this->receive_from(worker, message); }) {
          if (!worker.empty()) return receive_from(worker, message);
          return asked_for_hello_.first(peer) ? reply(peer, HelloAgain{}) : Status();
        } else {
          return refuse(peer, {ErrorKind::bad_input, "this message is not for a coordinator"});
        }
      },
      *incoming.message);
}

std::string Service::owner_of(const Digest& job) const {
  const auto found = owners_.find(job);
  return found == owners_.end() ? std::string() : found->second;
}

/// usage: the speaker is a user, and the job somebody else's.
Status Service::check_own(const Digest& job) const {
  if (speaker_.name.empty() || speaker_.role != Role::user) return {};
  const std::string owner = owner_of(job);
  if (owner == speaker_.name) return {};
  return Error{ErrorKind::usage,
               fmt::format("job {} belongs to {}: user '{}' may not change it", job.short_hex(),
                           owner.empty() ? "nobody" : fmt::format("'{}'", owner), speaker_.name)};
}

/// The job that is meant, if the speaker may change it.
Result<Digest> Service::resolve_own(const std::string& text) {
  BATON_ASSIGN(const Digest job, resolve(text));
  if (const Status own = check_own(job); !own) {
    spdlog::warn("refused: {}", own.error().message);
    return own.error();
  }
  return job;
}

/// Logs which connections were refused.
void Service::tell_refusals() {
  const std::optional<Error> refusal = router_.take_refusal();
  if (refusal) tell("refused: " + refusal->message);
}

/// Logs what may come again and again, as when a stranger tries.
void Service::tell(const std::string& warning) {
  const TimePoint now = std::chrono::steady_clock::now();
  if (told_.size() >= kMaxTold) told_.clear();
  const auto [told, is_new] = told_.try_emplace(warning, now);
  if (!is_new && now - told->second < kTellInterval) return;
  told->second = now;
  spdlog::warn("{}", warning);
}

}  // namespace baton
