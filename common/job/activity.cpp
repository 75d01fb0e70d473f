#include "common/job/activity.h"

#include <array>

namespace baton {
namespace {

template <class E, std::size_t N>
std::string_view name_of(const std::array<std::string_view, N>& names, E value) {
  static_assert(N == static_cast<std::size_t>(last_of(E{})) + 1);
  return names.at(static_cast<std::size_t>(value));
}

}  // namespace

std::string_view job_activity_name(JobActivity activity) {
  constexpr std::array<std::string_view, 7> kNames{"queued", "rendering", "waiting",  "paused",
                                                   "done",   "failed",    "cancelled"};
  return name_of(kNames, activity);
}

std::string_view worker_activity_name(WorkerActivity activity) {
  constexpr std::array<std::string_view, 5> kNames{"idle", "rendering", "draining", "silent",
                                                   "held"};
  return name_of(kNames, activity);
}

std::string_view absence_name(Absence absence) {
  constexpr std::array<std::string_view, 3> kNames{"lost", "turned away", "left"};
  return name_of(kNames, absence);
}

std::string_view reason_kind_name(ReasonKind kind) {
  constexpr std::array<std::string_view, 22> kNames{
      "input",    "order",      "busy",   "held",  "skipped", "left out",   "running", "no worker",
      "renderer", "blind",      "tried",  "store", "disk",    "paused",     "ended",   "draining",
      "asking",   "inspecting", "no job", "gone",  "silent",  "turned away"};
  return name_of(kNames, kind);
}

}  // namespace baton
