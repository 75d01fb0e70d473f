#pragma once

#include <fmt/format.h>

#include <cstdint>

#include "common/protocol/keys.h"
#include "common/protocol/messages.h"

namespace baton {

/// own: of jobs that the same name submitted.
enum class May : std::uint8_t { no, own, yes };

/// What each role may say to a coordinator: the table.
struct Rights {
  const char* what;
  May worker, viewer, user, admin;
};
template <class M>
inline constexpr Rights kRights{"say this", May::yes, May::yes, May::yes,
                                May::yes};  // refused as not for a coordinator

// clang-format off
//                                                                              worker    viewer    user      admin
template <> inline constexpr Rights kRights<WorkerHello>        {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<LeaseRequest>       {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<Heartbeat>          {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<TaskDone>           {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<TaskFailed>         {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<StatesPublished>    {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<BlobsLeft>          {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<LeaseReturn>        {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<WorkerGoodbye>      {"work",          May::yes, May::no,  May::no,  May::no};
template <> inline constexpr Rights kRights<JobDocumentRequest> {"read jobs",     May::yes, May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<SubmitJob>          {"submit jobs",   May::no,  May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<ListJobs>           {"list jobs",     May::no,  May::yes, May::yes, May::yes};
template <> inline constexpr Rights kRights<ShowJob>            {"look at jobs",  May::no,  May::yes, May::yes, May::yes};
template <> inline constexpr Rights kRights<ListEvents>         {"list events",   May::no,  May::yes, May::yes, May::yes};
template <> inline constexpr Rights kRights<PauseJob>           {"pause jobs",    May::no,  May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<ResumeJob>          {"resume jobs",   May::no,  May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<CancelJob>          {"cancel jobs",   May::no,  May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<LockFrames>         {"lock frames",   May::no,  May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<SetPriority>        {"set priorities", May::no, May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<AskWhy>             {"ask why",       May::no,  May::yes, May::yes, May::yes};
template <> inline constexpr Rights kRights<AskRequeue>         {"render frames again", May::no, May::no, May::own, May::yes};
template <> inline constexpr Rights kRights<AskPicture>         {"ask for pictures", May::no, May::yes, May::yes, May::yes};
template <> inline constexpr Rights kRights<ListTasks>          {"list tasks",    May::no,  May::yes, May::yes, May::yes};
template <> inline constexpr Rights kRights<DeleteJob>          {"delete jobs",   May::no,  May::no,  May::own, May::yes};
template <> inline constexpr Rights kRights<OrderWorker>        {"drain or hold workers", May::no,  May::no,  May::no,  May::yes};
template <> inline constexpr Rights kRights<StopCoordinator>    {"stop the farm", May::no,  May::no,  May::no,  May::yes};
// clang-format on

/// What the speaker may do with a message of type M. Who has no name has no key: where there are no
/// keys, everybody is everything.
template <class M>
May may_say(const Speaker& speaker) {
  if (speaker.name.empty()) return May::yes;
  constexpr Rights rights = kRights<M>;
  switch (speaker.role) {
    case Role::worker:
      return rights.worker;
    case Role::viewer:
      return rights.viewer;
    case Role::user:
      return rights.user;
    case Role::admin:
      break;
  }
  return rights.admin;
}

/// Error (usage): a user's key that may not give a job this priority. most: ServiceOptions.
inline Status check_priority(const Speaker& speaker, std::int32_t priority, std::int32_t most) {
  if (speaker.name.empty() || speaker.role != Role::user || priority <= most) return {};
  return Error{ErrorKind::usage,
               fmt::format("priority: user '{}' may give at most {} (--user-priority of the "
                           "coordinator), got {}",
                           speaker.name, most, priority)};
}

/// Error (usage): a user's key that may not replace files that no job known here has written.
inline Status check_replace_unknown(const Speaker& speaker) {
  if (speaker.name.empty() || speaker.role != Role::user) return {};
  return Error{
      ErrorKind::usage,
      fmt::format("no job that is known here has written it: user '{}' may not replace it, "
                  "an admin may; or move it away",
                  speaker.name)};
}

}  // namespace baton
