#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "jobs/slurm/pilots.h"

namespace baton {

/// What is said to Slurm's commands, and what they answer.

/// "2:00:00", "90", "1-12:00": a time as sbatch takes it (minutes, minutes:seconds,
/// hours:minutes:seconds, days-hours[:minutes[:seconds]]) in seconds. usage: another text, or 0.
Result<std::int64_t> parse_walltime(const std::string& text);

struct NodeRange {
  int least = 1, most = 1;
};
/// "4" or "1-8". usage: another text; not 0 <= least <= most <= 1000, 1 <= most.
Result<NodeRange> parse_node_range(const std::string& text);

/// The names of all farms begin with it.
inline constexpr std::string_view kJobNamePrefix = "baton-";

/// What a pilot is started with.
struct PilotJob {
  std::string worker;    ///< path of baton-worker
  std::string endpoint;  ///< the coordinator, as nodes reach it
  std::string key;       ///< file; empty: none
  /// Absolute; %A and %a in its name, not in that of its folder, are array and task.
  std::string script_log;
  /// Name by which squeue finds the pilots of this farm.
  std::string job_name;
  std::string partition;  ///< empty: Slurm's default
  std::string time;       ///< empty: the partition's default
  std::int64_t time_s = 0;
  std::vector<std::string> worker_arguments, sbatch_arguments;  ///< those of the user, as they are
};

/// Error usage: a folder of logs that sbatch cannot write into.
Status check_log(const PilotJob& job);

/// A shell script in which a pilot becomes a worker that has the pilot's name, all processors of
/// its allocation, and its end.
std::string pilot_script(const PilotJob& job);

/// The command that submits `count` pilots; the path of the script comes last.
std::vector<std::string> sbatch_command(const PilotJob& job, int count, const std::string& script);

/// job_name: empty: all that the user has in Slurm.
std::vector<std::string> squeue_command(const std::string& job_name);
/// Its answer. corrupt: a line that is not understood.
Result<std::vector<SlurmPilot>> parse_squeue(std::string_view text);

/// The pilot of a worker: "slurm-17_3" or, of two with that name, "slurm-17_3#1f00a3c2" is "17_3".
/// nullopt: it is none.
std::optional<std::string> pilot_of_worker(std::string_view name);

}  // namespace baton
