#include "jobs/cli/farm/job_requeue.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <utility>

#include "common/job/text/frame_range.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

struct RequeueOptions {
  CoordinatorLink link;
  std::string job, frames;
  bool dry_run = false, yes = false, json = false;
};

void print_plan(const RequeuePlan& plan) {
  say("{}", plan.plan);
  const std::string cost =
      plan.cpu_seconds > 0 ? ", about " + duration_text(plan.cpu_seconds) + " of CPU time" : "";
  say("{} {} to be done{}\n", plan.num_tasks, plan.num_tasks == 1 ? "task is" : "tasks are", cost);
}

void print_json(const RequeuePlan& plan, bool is_requeued) {
  fmt::print("{}\n", json_text({{"job", plan.identity.id.hex()},
                                {"tasks", plan.num_tasks},
                                {"cpuSeconds", plan.cpu_seconds},
                                {"plan", plan.plan},
                                {"requeued", is_requeued}},
                               2));
}

/// On a terminal a person is asked; elsewhere --yes says so.
Result<bool> is_wanted(const RequeueOptions& options) {
  if (options.yes) return true;
  if (::isatty(STDIN_FILENO) == 0)
    return Error{ErrorKind::usage, "expected --yes, or --dry-run: nobody can be asked here"};
  tell("render them again? [y/N] ");
  const int answer = std::getchar();
  return answer == 'y' || answer == 'Y';
}

/// Submits the job's own document again, with these frames.
Result<ExitCode> requeue(const RequeueOptions& options) {
  Result<std::vector<FrameNumber>> frames = parse_frames(options.frames);
  if (!frames) return Error{ErrorKind::usage, "--frames: " + frames.error().message};
  BATON_ASSIGN(RequestClient client, options.link.connect());
  BATON_ASSIGN(const RequeuePlan plan,
               ask_until_done<RequeuePlan>(client, AskRequeue{options.job, *frames}));
  if (!options.json) print_plan(plan);
  const bool has_tasks = plan.num_tasks > 0;
  if (!has_tasks && !options.json) tell("nothing of these frames is done: nothing changes\n");
  const bool is_asked = has_tasks && !options.dry_run;
  bool goes_on = false;
  if (is_asked) {
    BATON_ASSIGN(goes_on, is_wanted(options));
  }
  if (!goes_on) {
    if (is_asked) tell("nothing is changed\n");
    if (options.json) print_json(plan, false);
    return is_asked ? ExitCode::cancelled : ExitCode::ok;
  }
  const std::string id = plan.identity.id.hex();
  BATON_ASSIGN(const ShownJob job, ask<ShownJob>(client, ShowJob{id}));
  BATON_ASSIGN(JobDocument document,
               ask<JobDocument>(client, JobDocumentRequest{job.detail.summary.version}));
  BATON_ASSIGN(const JobAccepted accepted,
               ask_until_done<JobAccepted>(
                   client, SubmitJob{std::move(document.json), false, /*keep_priority=*/true,
                                     std::move(frames).value()}));
  if (options.json) print_json(plan, true);
  if (job.detail.summary.status == JobStatus::paused)
    tell("the job stays paused: baton job resume {} goes on\n", accepted.identity.id.short_hex());
  return ExitCode::ok;
}

}  // namespace

void add_job_requeue(CLI::App& job, ExitCode& code) {
  auto options = std::make_shared<RequeueOptions>();
  CLI::App* command = job.add_subcommand(
      "requeue", "Renders frames once more, although they are there: says what that takes, asks");
  command->add_option("ID", options->job, kJobHelp)->required();
  command->add_option("--frames", options->frames, "which: 12, 1-48x4, 20,30-32")->required();
  command->add_flag("--dry-run", options->dry_run, "only says what it takes");
  command->add_flag("-y,--yes", options->yes, "does not ask");
  add_coordinator_options(*command, options->link);
  command->add_flag("--json", options->json, "for machines");
  command->footer(
      "Examples:\n"
      "  baton job requeue shot7 --frames 10-20 --dry-run\n"
      "  baton job requeue 3f2a --frames 12 --yes\n"
      "Where a frame comes out otherwise than before, the job is paused and says whose work "
      "differs.");
  command->callback([options, &code] { code = finish_with_coordinator(requeue(*options)); });
}

}  // namespace baton
