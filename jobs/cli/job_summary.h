#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/base/exit_codes.h"
#include "common/protocol/messages.h"

namespace baton {

/// How a command about a job in this status ends; running and paused are ok.
ExitCode exit_code_of(JobStatus status);
/// The same; io where it has failed since frames are not what it has written.
ExitCode exit_code_of(const JobDetail& detail);

/// The job's line in a list.
std::string job_line(const JobSummary& job);

/// What the job has done so far, several lines.
std::string job_statistics(const JobSummary& job);

/// What is to be known of the frames that are written, several lines; empty: none is.
std::string judgement_text(const JobDetail& detail);

/// The worker's line in a list.
std::string worker_line(const WorkerSummary& worker);
nlohmann::ordered_json worker_json(const WorkerSummary& worker);

nlohmann::ordered_json summary_json(const JobSummary& job);
nlohmann::ordered_json detail_json(const JobDetail& detail);

}  // namespace baton
