#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/protocol/messages.h"

namespace baton {

/// The worker's line in a list, one for each task that it has, and one for each folder that it does
/// not see.
std::string worker_lines(const WorkerSummary& worker);
nlohmann::ordered_json worker_json(const WorkerSummary& worker);
/// The line of a worker that was lost, or turned away.
std::string absent_line(const AbsentWorker& worker);
nlohmann::ordered_json absent_json(const AbsentWorker& worker);
nlohmann::ordered_json absent_json(const std::vector<AbsentWorker>& workers);
/// ", 1 turned away, 2 lost in a day"; empty: none.
std::string absent_counts(const JobList& list);

/// "0.3s", "41s", "3m05s".
std::string task_time_text(double seconds);
/// " (usual 38s)"; empty: nothing is known.
std::string usual_text(const UsualTime& usual);
/// Adds the median, its spread and the number of tasks to an object; nothing where none is known.
void add_usual(const UsualTime& usual, nlohmann::ordered_json& object);

/// A link of a chain of reasons with its numbers.
std::string reason_line(const Reason& reason);
nlohmann::ordered_json reason_json(const Reason& reason);

}  // namespace baton
