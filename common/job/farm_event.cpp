#include "common/job/farm_event.h"

#include <fmt/format.h>

#include <array>

namespace baton {

std::string_view farm_event_name(FarmEventKind kind) {
  constexpr std::array<std::string_view, 27> kNames{
      "coordinator started", "coordinator stopped", "job submitted",   "job changed",
      "job resumed",         "job paused",          "job done",        "job failed",
      "job cancelled",       "job deleted",         "task granted",    "task done",
      "task failed",         "task returned",       "task lost",       "task revoked",
      "tasks reopened",      "worker joined",       "worker left",     "worker lost",
      "worker drained",      "frames locked",       "frames unlocked", "priority changed",
      "worker held",         "worker released",     "frames requeued"};
  static_assert(kNames.size() == static_cast<std::size_t>(last_of(FarmEventKind{})) + 1);
  return kNames.at(static_cast<std::size_t>(kind));
}

std::string place_text(const TaskPlace& place) {
  std::string text = place.first == place.last
                         ? fmt::format("frame {}", place.first)
                         : fmt::format("frames {}-{}", place.first, place.last);
  if (place.kind != TaskKind::assemble) text += fmt::format(", tile {}", place.tile);
  if (place.kind == TaskKind::second_pass) text += ", second pass";
  return text;
}

}  // namespace baton
