#include "jobs/cli/farm/job_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>

#include "common/base/limits.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/job_log.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/trace/trace_file.h"
#include "jobs/trace/trace_summary.h"

namespace baton {
namespace {

struct TraceOptions {
  CoordinatorLink link;
  std::string job;
  std::string folder;  ///< empty: as the coordinator has it
  std::string out;     ///< empty: by the job's ID
  bool json = false;
};

Result<ExitCode> write_job_trace(const TraceOptions& options) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const ShownJob job, ask<ShownJob>(client, ShowJob{options.job}));
  std::string folder = options.folder;
  if (folder.empty()) {
    const ListEvents question{job.identity.id.hex(), {.count = 1}};
    BATON_ASSIGN(const EventList found, ask<EventList>(client, question));
    folder = found.logs;
  }
  Trace trace = read_worker_traces(folder);
  keep_job(trace, job.identity.id.hex());
  if (trace.spans.empty()) {
    return Error{ErrorKind::io,
                 fmt::format("{}: no task of job {} is in the traces there, as seen from here; "
                             "--logs FOLDER says where the coordinator has them",
                             folder, job.identity.id.short_hex())};
  }
  const std::uint64_t num_done = job.detail.summary.tasks_done;
  const auto num_here =
      static_cast<std::uint64_t>(std::ranges::count_if(trace.spans, [](const TracedSpan& span) {
        return span.kind == SpanKind::task && !span.task.kind.empty();
      }));
  if (num_here < num_done)
    tell(
        "{} of {} tasks are in the traces: workers keep the last, and those of earlier builds had "
        "none\n",
        num_here, num_done);
  const std::string file =
      options.out.empty() ? job.identity.id.short_hex() + ".trace.json" : options.out;
  BATON_TRY(write_trace(file, trace));
  const TraceSummary summary = summarize(trace, {});
  if (options.json) {
    fmt::print("{}\n", json_text({{"file", file}, {"summary", summary_json(summary)}}, 2));
  } else {
    say("{}: {} spans of {} threads in {:.1f} s; baton trace says more, Perfetto shows it\n", file,
        trace.spans.size(), summary.threads, summary.seconds);
  }
  return ExitCode::ok;
}

}  // namespace

void add_job_trace(CLI::App& job, ExitCode& code) {
  auto options = std::make_shared<TraceOptions>();
  CLI::App* command = job.add_subcommand(
      "trace", "What each thread of each worker did for a job, as a file for Perfetto");
  command->add_option("ID", options->job, kJobHelp)->required();
  command->add_option("--out", options->out, "the file; default: ID.trace.json");
  add_logs_option(*command, options->folder);
  add_coordinator_options(*command, options->link);
  command->add_flag("--json", options->json, "what it says, for machines");
  command->footer(
      "Examples:\n"
      "  baton job trace shot7 --out shot7.json\n"
      "  baton trace shot7.json\n"
      "Workers keep some hundred thousand spans each; of a long job these are the last.");
  command->callback(
      [options, &code] { code = finish_with_coordinator(write_job_trace(*options)); });
}

}  // namespace baton
