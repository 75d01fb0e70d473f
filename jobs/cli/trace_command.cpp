#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "jobs/cli/commands.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/trace/trace_file.h"
#include "jobs/trace/trace_summary.h"

namespace baton {
namespace {

struct TraceOptions {
  std::string file;
  std::vector<std::size_t> threads{1, 2, 4, 8, 16, 64};
  bool json = false;
};

Result<ExitCode> run_trace(const TraceOptions& options) {
  BATON_ASSIGN(const Trace trace, read_trace(options.file));
  const TraceSummary summary = summarize(trace, options.threads);
  if (options.json) {
    fmt::print("{}\n", json_text(summary_json(summary), 2));
  } else {
    say("{}", summary_text(summary));
  }
  return ExitCode::ok;
}

}  // namespace

void add_trace_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<TraceOptions>();
  CLI::App* command = app.add_subcommand(
      "trace", "Where the time of a rendering went, and what more threads would make of it");
  command->add_option("FILE", options->file, "of `baton render --trace` or `baton job trace`")
      ->required();
  command
      ->add_option("--threads", options->threads,
                   "plays the recorded tasks on so many threads of one worker, each as fast as it "
                   "was here")
      ->delimiter(',')
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command->add_flag("--json", options->json, "the same for machines");
  command->footer(
      "Examples:\n"
      "  baton render job.json --trace shot.json\n"
      "  baton trace shot.json --threads 16,64\n"
      "Perfetto (ui.perfetto.dev) and speedscope show the file itself, span by span.");
  command->callback([options, &code] { code = finish(run_trace(*options)); });
}

}  // namespace baton
