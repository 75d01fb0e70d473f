#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "common/base/limits.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/farm/job_list.h"
#include "jobs/cli/farm/job_log.h"
#include "jobs/cli/farm/job_picture.h"
#include "jobs/cli/farm/job_questions.h"
#include "jobs/cli/farm/job_requeue.h"
#include "jobs/cli/farm/job_trace.h"
#include "jobs/cli/job_argument.h"
#include "jobs/cli/job_summary.h"
#include "jobs/cli/json_text.h"
#include "jobs/cli/say.h"
#include "jobs/cli/settle_method.h"

namespace baton {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr std::chrono::milliseconds kPollInterval{500};
constexpr std::chrono::minutes kWaitPatience{5};

struct JobOptions {
  CoordinatorLink link;
  std::string job;                        ///< name, ID or its beginning
  JobArgument wanted;                     ///< submit
  double timeout_s = 0;                   ///< wait; 0: none
  bool restart = false;                   ///< submit
  std::optional<FrameNumber> from_frame;  ///< submit
  int rounds = 0;                         ///< refine; 0: as many as a sweep has
  bool all_ended = false;                 ///< delete
  std::string frames;                     ///< lock
  bool off = false;                       ///< lock
  bool json = false;
};

/// What became of a job that was handed in.
void print_accepted(const JobAccepted& accepted, bool json) {
  if (json)
    return fmt::print("{}\n", json_text({{"id", accepted.identity.id.hex()},
                                         {"version", accepted.identity.version},
                                         {"alreadyThere", accepted.already_there},
                                         {"plan", accepted.plan}},
                                        2));
  say("{}\n", accepted.identity.id.hex());
  if (accepted.already_there) tell("an equal job is there already: it goes on\n");
  tell("{}", accepted.plan);
}

Result<ExitCode> submit(const JobOptions& options, RequestClient& client) {
  BATON_ASSIGN(JobSpec job, load_settled(options.wanted));
  BATON_TRY(begin_at(job, options.from_frame));
  // A pilot takes its time: first see that there is somebody to submit to.
  if (job.sampling.method == Method::automatic) BATON_TRY(ask<JobList>(client, ListJobs{}));
  BATON_TRY(settle_method_at(job, options.link));
  const bool restart = options.restart || options.from_frame;
  BATON_ASSIGN(std::string document, make_job_document(job));
  BATON_ASSIGN(const JobAccepted accepted,
               ask_until_done<JobAccepted>(client, SubmitJob{std::move(document), restart}));
  print_accepted(accepted, options.json);
  if (options.json) return ExitCode::ok;
  if (job.output.is_look) tell("a look: frames go to {}\n", job.output.directory);
  if (job.quality.may_grow())
    tell("rounds are added until quality.{} ends it\n", job.quality.noise_threshold
                                                            ? "noiseThreshold"
                                                        : job.quality.time_limit ? "timeLimit"
                                                                                 : "maxRounds");
  return ExitCode::ok;
}

void print_detail(const ShownJob& job, bool json) {
  const JobDetail& detail = job.detail;
  if (json) return fmt::print("{}\n", json_text(detail_json(job), 2));
  say("{}\n", job_line({job.identity, detail.summary, job.now}));
  say("output     {}\n", detail.summary.output_directory);
  if (!detail.summary.owner.empty()) say("owner      {}\n", detail.summary.owner);
  say("{}", times_text(job.identity.times));
  if (job.identity.version > 1) say("version    {}\n", job.identity.version);
  if (!detail.frames_done.empty()) say("frames     {}\n", format_frames(detail.frames_done));
  if (!job.locked.empty()) say("locked     {}\n", format_frames(job.locked));
  say("{}{}", job_statistics(detail.summary), judgement_text(detail));
  if (!detail.waits.empty()) say("waits      {}\n", detail.waits);
  if (!job.now.reason.empty() && detail.waits.empty()) say("because    {}\n", job.now.reason);
  for (const std::string& note : detail.notes) say("warning    {}\n", note);
  for (const std::string& failure : detail.failures) say("failure    {}\n", failure);
}

Result<ExitCode> show(const JobOptions& options, RequestClient& client) {
  BATON_ASSIGN(const ShownJob job, ask<ShownJob>(client, ShowJob{options.job}));
  print_detail(job, options.json);
  return ExitCode::ok;
}

/// A coordinator that has answered once may be away for a while: it is started again.
Result<ExitCode> wait(const JobOptions& options, RequestClient& client) {
  const Clock::time_point start = Clock::now();
  std::optional<Clock::time_point> last_answer;
  std::string job = options.job;  // once it is found, its ID: others may take its name
  std::set<std::string> told;     // lines, each once: two faults may alternate
  const auto say = [&](const std::string& line) {
    if (told.insert(line).second) tell("{}\n", line);
  };
  std::size_t num_grown = 0;  // decisions that were printed
  for (;;) {
    const Result<ShownJob> answer = ask<ShownJob>(client, ShowJob{job});
    const std::chrono::duration<double> waited = Clock::now() - start;
    if (!answer) {
      const bool away = answer.error().kind == ErrorKind::timeout && last_answer &&
                        Clock::now() - *last_answer < kWaitPatience;
      if (!away) return answer.error();
      say(fmt::format("the coordinator does not answer: waits {} minutes for it",
                      kWaitPatience.count()));
      if (options.timeout_s > 0 && waited.count() >= options.timeout_s) return ExitCode::timeout;
      std::this_thread::sleep_for(kPollInterval);
      continue;
    }

    // The newest decision is enough of what was decided before.
    if (!last_answer && answer->growth.size() > 1) num_grown = answer->growth.size() - 1;
    for (const std::string& line : fresh_growth(*answer, num_grown)) tell("{}\n", line);
    last_answer = Clock::now();
    job = answer->identity.id.hex();
    const JobDetail& detail = answer->detail;
    const bool expired = options.timeout_s > 0 && waited.count() >= options.timeout_s;
    if (!is_open(detail.summary.status) || expired) {
      print_detail(*answer, options.json);
      return is_open(detail.summary.status) ? ExitCode::timeout : exit_code_of(detail);
    }
    const bool is_paused = detail.summary.status == JobStatus::paused;
    if (detail.waits.empty() && !is_paused) told.clear();
    if (!detail.waits.empty()) {
      say("waits for " + detail.waits);
    } else if (is_paused) {
      say(fmt::format("is paused: `baton job resume {}` goes on", answer->identity.id.short_hex()));
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

/// What became of a job, and a word where nothing did: one that is done cannot be paused.
void print_change(const ShownJob& before, const ShownJob& after, bool json) {
  print_detail(after, json);
  const JobStatus status = before.detail.summary.status;
  if (status != after.detail.summary.status) return;
  tell("nothing changed: the job was {} before\n", job_status_name(status));
}

/// M: CancelJob, PauseJob or ResumeJob.
template <class M>
Result<ExitCode> change(const JobOptions& options, RequestClient& client) {
  BATON_ASSIGN(const ShownJob before, ask<ShownJob>(client, ShowJob{options.job}));
  BATON_ASSIGN(const ShownJob after, ask_until_done<ShownJob>(client, M{before.identity.id.hex()}));
  tell("{}", after.detail.plan);
  print_change(before, after, options.json);
  return ExitCode::ok;
}

Result<ExitCode> lock(const JobOptions& options, RequestClient& client) {
  Result<std::vector<FrameNumber>> frames = parse_frames(options.frames);
  if (!frames) return Error{ErrorKind::usage, "--frames: " + frames.error().message};
  const std::string which = format_frames(*frames);
  BATON_ASSIGN(const ShownJob after,
               ask_until_done<ShownJob>(
                   client, LockFrames{options.job, std::move(frames).value(), options.off}));
  tell("frames {} are {}\n", which,
       options.off ? "not locked any more" : "locked: they stay and count as done");
  print_detail(after, options.json);
  const JobStatus status = after.detail.summary.status;
  const bool may_go_on =
      status == JobStatus::cancelled || (status == JobStatus::failed && after.detail.waits.empty());
  if (may_go_on)
    tell("the job is {}: baton job retry {} goes on with it\n", job_status_name(status),
         after.identity.id.short_hex());
  return ExitCode::ok;
}

/// Submits the job's own document again: what is done stays done, failures are forgotten.
Result<ExitCode> retry(const JobOptions& options, RequestClient& client) {
  BATON_ASSIGN(const ShownJob before, ask<ShownJob>(client, ShowJob{options.job}));
  BATON_ASSIGN(JobDocument document,
               ask<JobDocument>(client, JobDocumentRequest{before.detail.summary.version}));
  BATON_ASSIGN(const JobAccepted accepted,
               ask_until_done<JobAccepted>(
                   client, SubmitJob{std::move(document.json), false, /*keep_priority=*/true}));
  tell("{}", accepted.plan);
  BATON_ASSIGN(const ShownJob after, ask<ShownJob>(client, ShowJob{before.identity.id.hex()}));
  print_change(before, after, options.json);
  return ExitCode::ok;
}

/// Submits the job with more sweeps: those that it has stay, and frames become the mean of all.
Result<ExitCode> refine(const JobOptions& options, RequestClient& client) {
  BATON_ASSIGN(const ShownJob before, ask<ShownJob>(client, ShowJob{options.job}));
  BATON_ASSIGN(const JobDocument document,
               ask<JobDocument>(client, JobDocumentRequest{before.detail.summary.version}));
  BATON_ASSIGN(ParsedJobDocument parsed, parse_job_document(document.json));
  QualitySpec& quality = parsed.job.quality;
  const int rounds = options.rounds > 0 ? options.rounds : quality.rounds;
  if (rounds % quality.rounds != 0) {
    return Error{
        ErrorKind::usage,
        fmt::format("--rounds: expected a multiple of the job's quality.rounds, {}, got {}",
                    quality.rounds, rounds)};
  }
  const std::int64_t sweeps = std::int64_t{quality.sweeps} + rounds / quality.rounds;
  if (sweeps * quality.rounds > limits::kMaxRounds) {
    return Error{ErrorKind::usage, fmt::format("--rounds: expected at most {} in all, got {}",
                                               limits::kMaxRounds, sweeps * quality.rounds)};
  }
  quality.sweeps = static_cast<int>(sweeps);
  quality.refinable = true;
  BATON_ASSIGN(std::string wanted, make_job_document(parsed.job));
  BATON_ASSIGN(const JobAccepted accepted,
               ask_until_done<JobAccepted>(
                   client, SubmitJob{std::move(wanted), false, /*keep_priority=*/true}));
  print_accepted(accepted, options.json);
  return ExitCode::ok;
}

Result<ExitCode> delete_jobs(const JobOptions& options, RequestClient& client) {
  if (options.job.empty() != options.all_ended)
    return Error{ErrorKind::usage, "name one job, or say --ended"};
  std::vector<std::string> jobs{options.job};
  if (options.all_ended) {
    jobs.clear();
    BATON_ASSIGN(const JobList found, ask<JobList>(client, ListJobs{true}));
    for (const ListedJob& job : found.jobs) {
      if (!is_open(job.summary.status)) jobs.push_back(job.identity.id.hex());
    }
  }
  // Of all that have ended, those of others stay, and those whose locks would go with them.
  std::size_t num_deleted = 0, num_others = 0, num_locked = 0;
  for (const std::string& job : jobs) {
    BATON_ASSIGN(const ShownJob shown, ask<ShownJob>(client, ShowJob{job}));
    if (options.all_ended && !shown.locked.empty()) {
      ++num_locked;
      continue;
    }
    const Result<JobList> deleted =
        ask_until_done<JobList>(client, DeleteJob{shown.identity.id.hex()});
    const bool is_others = !deleted && deleted.error().kind == ErrorKind::usage;
    if (!deleted && !(is_others && options.all_ended)) return deleted.error();
    ++(is_others ? num_others : num_deleted);
    if (!shown.locked.empty())
      tell("frames {} are not locked any more\n", format_frames(shown.locked));
  }
  if (options.json) {
    fmt::print(
        "{}\n",
        json_text({{"deleted", num_deleted}, {"others", num_others}, {"locked", num_locked}}, 2));
    return ExitCode::ok;
  }
  say("{} jobs are deleted; their frames stay\n", num_deleted);
  if (num_others > 0) say("{} jobs of others stay\n", num_others);
  if (num_locked > 0)
    say("{} jobs with locked frames stay: each is deleted by its ID\n", num_locked);
  return ExitCode::ok;
}

using Action = Result<ExitCode> (*)(const JobOptions&, RequestClient&);

Result<ExitCode> run_job(const JobOptions& options, Action action) {
  BATON_ASSIGN(RequestClient client, options.link.connect());
  return action(options, client);
}

}  // namespace

void add_job_command(CLI::App& app, ExitCode& code) {
  CLI::App* job = app.add_subcommand("job", "Submits jobs to a coordinator and looks after them");
  job->require_subcommand(1);
  job->footer(
      "Examples:\n"
      "  baton job submit job.json --coordinator tcp://farm:5570\n"
      "  baton job wait 3f2a --timeout 600 && echo done\n"
      "An ID is what submit prints, its beginning, or the name of a job. It stays while the job "
      "is\n"
      "changed: the same name in the same folder, by the same user, is the same job.");

  // No two commands share an option: CLI11 reads the environment for those that were not called,
  // too.
  const auto add = [&](const char* name, const char* what, const char* argument,
                       Action action) -> std::pair<CLI::App*, JobOptions*> {
    CLI::App* command = job->add_subcommand(name, what);
    const bool is_file = argument == std::string("JOB");
    command->footer(fmt::format("Example: baton job {} {}", name, is_file ? "job.json" : "shot7"));
    auto options = std::make_shared<JobOptions>();
    if (is_file) {
      add_job_argument(*command, options->wanted);
    } else if (!std::string(argument).empty()) {
      command->add_option(argument, options->job, kJobHelp)->required();
    }
    add_coordinator_options(*command, options->link);
    command->add_flag("--json", options->json, "for machines");
    command->callback(
        [options, action, &code] { code = finish_with_coordinator(run_job(*options, action)); });
    return {command, options.get()};
  };
  const auto [hand_in, submission] =
      add("submit", "Hands a job over; prints its ID", "JOB", submit);
  hand_in->add_flag("--restart", submission->restart,
                    "replace the frames of another picture in the output folder");
  add_from_frame_option(*hand_in, submission->from_frame);
  add_list_command(*job, code);
  add("show", "One job: progress, statistics, failures", "ID", show);
  for (const auto add_reader : {add_job_questions, add_job_log, add_job_trace, add_job_picture})
    add_reader(*job, code);
  add("pause", "Hands out no more of a job's tasks; those that run are finished", "ID",
      change<PauseJob>);
  add("resume", "Goes on with a paused job", "ID", change<ResumeJob>);
  add("cancel", "Ends a job; finished frames stay", "ID", change<CancelJob>);
  add("retry", "Goes on with a failed or cancelled job where it stopped", "ID", retry);
  add_job_requeue(*job, code);
  const auto [refines, refinement] =
      add("refine",
          "Adds rounds to a job: its frames become the mean of those and of the new ones; prints "
          "its ID",
          "ID", refine);
  refines
      ->add_option("--rounds", refinement->rounds,
                   "a multiple of the job's quality.rounds; default: as many")
      ->check(CLI::Range(1, limits::kMaxRounds));
  const auto [locks, choice] = add(
      "lock", "Frames count as done from now on and stay as they are, whatever is in their files",
      "ID", lock);
  locks->add_option("--frames", choice->frames, "which: 12, 1-48x4, 20,30-32")->required();
  locks->add_flag("--off", choice->off, "they are the job's again");
  locks->footer("Example: baton job lock 3f2a --frames 20,30-32");
  const auto [removes, removal] =
      add("delete", "Forgets a job that has ended, and removes the states that it left", "",
          delete_jobs);
  removes->add_option("ID", removal->job, kJobHelp);
  removes->add_flag("--ended", removal->all_ended, "every job that has ended");
  const auto [waits, patience] = add(
      "wait",
      "Returns when the job has ended, with its exit code; outlasts a restart of the coordinator",
      "ID", wait);
  waits->add_option("--timeout", patience->timeout_s, "seconds; default: as long as it takes")
      ->check(CLI::Range(0.0, 1e9));
}

}  // namespace baton
