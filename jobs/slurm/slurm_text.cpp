#include "jobs/slurm/slurm_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

namespace baton {
namespace {

constexpr std::string_view kWorkerPrefix = "slurm-";
/// Slurm may send the signal of --signal a minute early: only where that is little of the time.
constexpr std::int64_t kSignalBefore_s = 60, kLongEnough_s = 600;

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(at);
    parts.push_back(text.substr(0, end));
    if (end == text.npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::optional<std::int64_t> number_of(std::string_view text) {
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  constexpr std::int64_t kMost = 1'000'000;
  if (!whole || number < 0 || number > kMost) return std::nullopt;
  return number;
}

/// As one word of a shell.
std::string quoted(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

/// As sbatch reads it: in the folder's name a percent sign is none of a pattern.
std::string output_pattern(const std::filesystem::path& log) {
  std::string pattern;
  for (const char c : log.parent_path().string())
    pattern += c == '%' ? std::string("%%") : std::string(1, c);
  return pattern + "/" + log.filename().string();
}

SlurmState state_of(std::string_view state, std::string_view reason) {
  if (state == "PENDING" || state == "CONFIGURING")
    return reason == "BeginTime" ? SlurmState::resting : SlurmState::waiting;
  if (state == "REQUEUED") return SlurmState::resting;
  if (state == "REQUEUE_HOLD" || state == "SPECIAL_EXIT") return SlurmState::waiting;
  if (state == "RUNNING" || state == "RESIZING" || state == "SIGNALING" || state == "STAGE_OUT")
    return SlurmState::running;
  if (state == "SUSPENDED" || state == "STOPPED") return SlurmState::suspended;
  return SlurmState::ending;
}

}  // namespace

Result<std::int64_t> parse_walltime(const std::string& text) {
  const Error fault{
      ErrorKind::usage,
      fmt::format("--time {}: expected a time as sbatch takes it: minutes, "
                  "minutes:seconds, hours:minutes:seconds or days-hours:minutes:seconds",
                  text)};
  const std::size_t dash = text.find('-');
  const bool has_days = dash != text.npos;
  const auto parts = split(std::string_view(text).substr(has_days ? dash + 1 : 0), ':');
  if (parts.size() > 3) return fault;
  // Behind days, or with three parts, hours come first; otherwise minutes.
  std::int64_t unit = has_days || parts.size() == 3 ? 3600 : 60, seconds = 0;
  if (has_days) {
    const auto days = number_of(std::string_view(text).substr(0, dash));
    if (!days) return fault;
    seconds = *days * 86400;
  }
  for (const std::string_view part : parts) {
    const auto number = number_of(part);
    if (!number) return fault;
    seconds += *number * unit;
    unit /= 60;
  }
  if (seconds <= 0) return fault;
  return seconds;
}

Result<NodeRange> parse_node_range(const std::string& text) {
  constexpr std::int64_t kMost = 1000;
  const auto parts = split(text, '-');
  const auto least = number_of(parts.front()), most = number_of(parts.back());
  if (parts.size() > 2 || !least || !most || *most < 1 || *most < *least || *most > kMost) {
    return Error{
        ErrorKind::usage,
        fmt::format("--nodes {}: expected a number or a range, as in 1-8, up to {}", text, kMost)};
  }
  return NodeRange{static_cast<int>(*least), static_cast<int>(*most)};
}

Status check_log(const PilotJob& job) {
  if (job.script_log.find('\\') == job.script_log.npos) return {};
  return Error{ErrorKind::usage,
               fmt::format("{}: expected a folder without a backslash: sbatch takes none in the "
                           "name of a log",
                           std::filesystem::path(job.script_log).parent_path().string())};
}

std::string pilot_script(const PilotJob& job) {
  std::string text =
      "#!/bin/sh\n"
      "# A pilot: works for a coordinator until its time ends or there is nothing to do.\n";
  // Where nobody has said how long, Slurm knows it. SLURM_JOB_ID of the array's last task means the
  // whole array.
  text += "pilot=${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID\n";
  text += job.time_s > 0 ? fmt::format("end=$(($(date +%s) + {}))\n", job.time_s)
                         : std::string(
                               "end=$(date -d \"$(squeue -h -j \"$pilot\" -o %e)\" +%s "
                               "2>/dev/null) || end=0  # NONE: no limit\n");
  text += fmt::format(
      "exec {} --coordinator {}{} \\\n"
      "  --name \"{}$pilot\" \\\n"
      "  --threads \"${{SLURM_CPUS_ON_NODE:-1}}\" --memory \"${{SLURM_MEM_PER_NODE:-0}}\" --end-at "
      "\"$end\"",
      quoted(job.worker), quoted(job.endpoint),
      job.key.empty() ? std::string() : " --key " + quoted(job.key), kWorkerPrefix);
  for (const std::string& argument : job.worker_arguments) text += " " + quoted(argument);
  return text + "\n";
}

std::vector<std::string> sbatch_command(const PilotJob& job, int count, const std::string& script) {
  std::vector<std::string> command{"sbatch",
                                   "--parsable",
                                   fmt::format("--array=1-{}", count),
                                   "--requeue",
                                   "--nodes=1",
                                   "--ntasks=1",
                                   "--exclusive",
                                   "--mem=0",
                                   "--open-mode=append",
                                   "--job-name=" + job.job_name,
                                   "--output=" + output_pattern(job.script_log)};
  if (!job.partition.empty()) command.push_back("--partition=" + job.partition);
  if (!job.time.empty()) command.push_back("--time=" + job.time);
  if (job.time_s == 0 || job.time_s >= kLongEnough_s)
    command.push_back(fmt::format("--signal=B:TERM@{}", kSignalBefore_s));
  command.insert(command.end(), job.sbatch_arguments.begin(), job.sbatch_arguments.end());
  command.push_back(script);
  return command;
}

std::vector<std::string> squeue_command(const std::string& job_name) {
  return {"squeue", "--noheader", "--array", job_name.empty() ? "--me" : "--name=" + job_name,
          "--format=%i|%T|%j|%N|%L|%r"};
}

Result<std::vector<SlurmPilot>> parse_squeue(std::string_view text) {
  std::vector<SlurmPilot> pilots;
  for (const std::string_view line : split(text, '\n')) {
    if (line.empty()) continue;
    const auto fields = split(line, '|');
    if (fields.size() < 6 || fields[0].empty())
      return Error{ErrorKind::corrupt,
                   fmt::format("squeue: \"{}\": expected job|state|name|node|time|reason", line)};
    pilots.push_back({std::string(fields[0]), state_of(fields[1], fields[5]), 0,
                      std::string(fields[1]), std::string(fields[5]), std::string(fields[2]),
                      std::string(fields[3]), std::string(fields[4])});
  }
  return pilots;
}

std::optional<std::string> pilot_of_worker(std::string_view name) {
  if (!name.starts_with(kWorkerPrefix)) return std::nullopt;
  name.remove_prefix(kWorkerPrefix.size());
  return std::string(name.substr(0, name.find('#')));
}

}  // namespace baton
