#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/base/exit_codes.h"
#include "common/protocol/messages.h"

namespace baton {

/// How a command about a job in this status ends; running and paused are ok.
ExitCode exit_code_of(JobStatus status);
/// How a command ends about a job in this status that nobody follows any more; io where it waits
/// for somebody.
ExitCode exit_code_of_stopped(JobStatus status);
/// How a command about a job ends; io where it has failed since frames are not what it has written.
ExitCode exit_code_of(const JobDetail& detail);

/// "ETA 12m05s (9m10s to 16m40s)", the time left and the interval that holds four times in five;
/// "ETA not known yet" where too few tasks are done.
std::string eta_text(const Eta& eta);
/// The job's line in a list: what it does, how far it is, when it will be done, and for what it
/// waits.
std::string job_line(const ListedJob& job);
/// The job's line in a list with owner, priority and times.
std::string long_job_line(const ListedJob& job);
/// When the job was submitted, started and ended, as far as that is known, a line each.
std::string times_text(const JobTimes& times);

/// What the job has done so far, several lines.
std::string job_statistics(const JobSummary& job);

/// What is to be known of the frames that are written, several lines; empty: none is.
std::string judgement_text(const JobDetail& detail);

/// What a growing job has decided beyond the first `num_told` times, which are all then. A job that
/// was submitted again begins anew.
std::vector<std::string> fresh_growth(const ShownJob& job, std::size_t& num_told);

/// A task's kind, frames, tile and attempt.
nlohmann::ordered_json place_json(const TaskPlace& place);

/// null: it is not known, or has not come.
nlohmann::ordered_json utc_json(std::int64_t time_ms);
nlohmann::ordered_json summary_json(const ListedJob& job);
nlohmann::ordered_json detail_json(const ShownJob& job);

}  // namespace baton
