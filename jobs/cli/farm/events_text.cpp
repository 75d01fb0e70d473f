#include "jobs/cli/farm/events_text.h"

#include <fmt/format.h>

#include "jobs/cli/job_summary.h"
#include "jobs/cli/text.h"

namespace baton {

using nlohmann::ordered_json;

ordered_json event_json(const FarmEvent& event) {
  ordered_json row = {{"sequence", event.sequence},
                      {"time", utc_iso(event.time_ms)},
                      {"kind", farm_event_name(event.kind)}};
  if (!event.actor.empty()) row["actor"] = event.actor;
  if (!event.job.empty()) row["job"] = event.job.hex();
  if (event.has_task) row.update(place_json(event.task));
  if (!event.worker.empty()) row["worker"] = event.worker;
  if (!event.reason.empty()) row["reason"] = event.reason;
  if (event.seconds > 0) row["seconds"] = event.seconds;
  return row;
}

std::string event_line(const FarmEvent& event) {
  std::string text =
      fmt::format("{}  {:<19}", utc_text(event.time_ms), farm_event_name(event.kind));
  if (!event.job.empty()) text += fmt::format("  job {}", event.job.short_hex());
  if (event.has_task) text += "  " + place_text(event.task);
  if (event.has_task && event.task.attempt > 1)
    text += fmt::format(", attempt {}", event.task.attempt);
  if (!event.worker.empty()) text += "  " + event.worker;
  if (event.seconds > 0) text += fmt::format("  after {:.1f} s", event.seconds);
  if (!event.actor.empty() && event.actor != "worker " + event.worker)
    text += "  by " + event.actor;
  if (!event.reason.empty()) text += ": " + event.reason;
  return text;
}

}  // namespace baton
