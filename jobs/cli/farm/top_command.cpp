#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>

#include "common/base/utc.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/worker_text.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/signals.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

using nlohmann::ordered_json;

constexpr const char* kHome = "\x1b[H";
constexpr const char* kClearLine = "\x1b[K";
constexpr const char* kClearBelow = "\x1b[J";
constexpr int kForEver = 0;

struct TopOptions {
  CoordinatorLink link;
  double interval_s = 2;
  int count = kForEver;  ///< of screens
  bool json = false;
};

struct ScreenSize {
  std::size_t lines = std::numeric_limits<std::size_t>::max(), columns = lines;
};

/// Of the terminal; no limits where there is none.
ScreenSize screen_size() {
  winsize size{};
  if (::isatty(STDOUT_FILENO) == 0 || ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 ||
      size.ws_row == 0)
    return {};
  return {size.ws_row, size.ws_col};
}

/// A screen: what the farm is, its jobs in the order of their turn, its workers.
std::vector<std::string> screen_lines(const CoordinatorLink& link, JobList list) {
  std::array<std::size_t, static_cast<std::size_t>(last_of(JobActivity{})) + 1> counts{};
  for (const ListedJob& job : list.jobs) ++counts.at(static_cast<std::size_t>(job.now.activity));
  std::string summary;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] > 0)
      summary += fmt::format(", {} {}", counts[i], job_activity_name(static_cast<JobActivity>(i)));
  }
  std::vector<std::string> lines;
  lines.push_back(fmt::format("{}  {}", link.endpoint, utc_text(now_ms())));
  lines.push_back(fmt::format("{} jobs{}; {} tasks are ready; {} workers{}", list.jobs.size(),
                              summary, list.tasks_ready, list.workers.size(), absent_counts(list)));
  lines.emplace_back();
  std::ranges::stable_sort(list.jobs, [](const ListedJob& a, const ListedJob& b) {
    return a.summary.priority > b.summary.priority;
  });
  for (const ListedJob& job : list.jobs) lines.push_back(job_line(job));
  lines.emplace_back();
  for (const WorkerSummary& worker : list.workers) {
    const std::string text = worker_lines(worker);
    for (std::size_t begin = 0; begin != std::string::npos;) {
      const std::size_t end = text.find('\n', begin);
      lines.push_back(text.substr(begin, end - begin));
      begin = end == std::string::npos ? end : end + 1;
    }
  }
  return lines;
}

/// Over what is on the terminal, as much of it as there is room for.
void show(std::vector<std::string> lines, bool is_terminal) {
  const ScreenSize size = screen_size();
  const std::size_t room = std::max<std::size_t>(size.lines, 3) - 2;
  if (lines.size() > room + 1) {
    const std::size_t left_out = lines.size() - room;
    lines.resize(room);
    lines.push_back(fmt::format("and {} lines more", left_out));
  }
  if (is_terminal) fmt::print("{}", kHome);
  for (std::string& line : lines) {
    if (line.size() > size.columns) line.resize(size.columns);
    fmt::print("{}{}\n", line, is_terminal ? kClearLine : "");
  }
  if (is_terminal) fmt::print("{}", kClearBelow);
  std::fflush(stdout);
}

std::string screen_json(const JobList& list) {
  ordered_json result = {{"time", utc_iso(now_ms())},
                         {"tasksReady", list.tasks_ready},
                         {"jobs", ordered_json::array()},
                         {"workers", ordered_json::array()},
                         {"turnedAway", absent_json(list.turned_away)},
                         {"lost", absent_json(list.lost)}};
  for (const ListedJob& job : list.jobs) result["jobs"].push_back(summary_json(job));
  for (const WorkerSummary& worker : list.workers) result["workers"].push_back(worker_json(worker));
  return json_text(result);
}

/// Until Ctrl-C, or so many screens; where there is no terminal, one.
Result<ExitCode> top(const TopOptions& options) {
  const SignalWait signals;
  BATON_ASSIGN(RequestClient client, options.link.connect());
  const bool is_terminal = ::isatty(STDOUT_FILENO) == 1 && !options.json;
  const int count = options.count == kForEver && !is_terminal ? 1 : options.count;
  const auto pause =
      std::chrono::milliseconds(static_cast<std::int64_t>(1000 * options.interval_s));
  for (int shown = 1;; ++shown) {
    BATON_ASSIGN(JobList list, ask<JobList>(client, ListJobs{}));
    if (options.json) {
      fmt::print("{}\n", screen_json(list));
      std::fflush(stdout);
    } else {
      show(screen_lines(options.link, std::move(list)), is_terminal);
    }
    if (shown == count || signals.stop_requested_within(pause)) return ExitCode::ok;
  }
}

}  // namespace

void add_top_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<TopOptions>();
  CLI::App* command =
      app.add_subcommand("top", "Jobs and workers of a farm, shown anew until Ctrl-C");
  add_coordinator_options(*command, options->link);
  command->add_option("--interval", options->interval_s, "seconds between two screens")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command
      ->add_option("--count", options->count,
                   "so many screens; default: until Ctrl-C, without a terminal one")
      ->check(CLI::Range(1, 1000000));
  command->add_flag("--json", options->json, "an object a line, for machines");
  command->footer(
      "Examples:\n"
      "  baton top --coordinator tcp://farm:5570\n"
      "  baton top --json --count 10 --interval 60");
  command->callback([options, &code] { code = finish_with_coordinator(top(*options)); });
}

}  // namespace baton
