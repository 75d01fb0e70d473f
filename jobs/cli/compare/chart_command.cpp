#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <thread>

#include "common/scene/settle/settle_motion.h"
#include "jobs/auto/auto_pilot.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/farm_job_runner.h"
#include "jobs/cli/say.h"
#include "jobs/study/study_report.h"
#include "jobs/study/verdict.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct ChartOptions {
  std::string study;
  std::string output;          ///< empty: NAME-charts beside the study
  std::string work_directory;  ///< empty: .work in the output folder
  int threads = 0;             ///< 0: every processor
  bool check_only = false;
};

FarmOptions farm_options(const ChartOptions& options, const StudyFolder& folder) {
  // One process: the light of a frame is then prepared, and counted, once a job.
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  FarmOptions farm;
  farm.threads_per_worker = options.threads > 0 ? options.threads : processors;
  farm.work_directory = folder.farm_folder();
  return farm;
}

/// The processor as Linux names it.
std::string machine_name() {
  // A file of /proc says that it has no bytes, so it is read as a stream.
  std::ifstream info("/proc/cpuinfo");
  const std::string text{std::istreambuf_iterator<char>(info), std::istreambuf_iterator<char>()};
  const std::size_t key = text.find("model name");
  const std::size_t colon = text.find(": ", key);
  if (key == std::string::npos || colon == std::string::npos) return "an unknown machine";
  const std::string model = text.substr(colon + 2, text.find('\n', colon) - colon - 2);
  return fmt::format("{} ({} logical processors)", model, std::thread::hardware_concurrency());
}

/// Whether the motion of two jobs is settled alike: it depends on nothing else.
bool move_alike(const JobSpec& a, const JobSpec& b) {
  return a.frames == b.frames && a.image == b.image && a.camera == b.camera && a.scene == b.scene &&
         a.motion == b.motion;
}

/// Settles the motion of every job (common/scene/settle/settle_motion.h), of cells that move alike
/// once.
Status settle_jobs(Study& study) {
  for (StudyScene& scene : study.scenes) {
    for (JobSpec& job : scene.reference) {
      BATON_ASSIGN(job, settle_motion(std::move(job)));
    }
  }
  JobSpec given, settled;
  for (StudyCell& cell : study.cells) {
    if (!move_alike(cell.job, given)) {
      given = cell.job;
      BATON_ASSIGN(settled, settle_motion(given));
    }
    cell.job.camera = settled.camera;
    cell.job.scene = settled.scene;
    cell.job.motion = settled.motion;
  }
  return {};
}

Result<ExitCode> run_chart(const ChartOptions& options) {
  BATON_ASSIGN(Study study, load_study(options.study));
  BATON_TRY(settle_jobs(study));
  tell("study {}: {} scenes, {} methods, {} combinations with {} seeds each\n", study.name,
       study.scenes.size(), study.methods.size(), study.cells.size(), study.num_seeds);
  if (options.check_only) return ExitCode::ok;

  const fs::path output = fs::absolute(
      options.output.empty() ? fs::path(options.study).parent_path() / (study.name + "-charts")
                             : fs::path(options.output));
  const StudyFolder folder(options.work_directory.empty() ? output / ".work"
                                                          : fs::absolute(options.work_directory));
  FarmJobRunner runner(farm_options(options, folder));
  BATON_TRY(settle_study(study, folder, runner));
  BATON_ASSIGN(const StudyResults results, run_study(study, folder, runner));
  BATON_ASSIGN(const fs::path report, write_report(study, results, folder, output, machine_name()));
  const std::vector<CellSummary> rows = summarize_study(study, results);
  for (const Verdict& verdict : verdicts(study, results, rows)) {
    say("{:<24} {}\n", study.scenes[verdict.scene].name + ":", verdict_text(study, verdict));
  }
  say("{}\n", report.string());
  return ExitCode::ok;
}

}  // namespace

void add_chart_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<ChartOptions>();
  CLI::App* command =
      app.add_subcommand("chart", "Measures methods on scenes: error against time, as charts");
  command->add_option("STUDY", options->study, "study file (jobs/study/STUDY.md)")->required();
  command->add_option("--output", options->output,
                      "folder of charts and tables; default: NAME-charts beside the study");
  command->add_option("--work-dir", options->work_directory,
                      "finished runs, journal, logs; default: .work in the output folder");
  command->add_option("--threads", options->threads, "of the worker; default: all processors")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--check", options->check_only, "check every combination, render nothing");
  command->footer(
      "Examples:\n"
      "  baton chart jobs/studies/first-look.json --output charts\n"
      "Ctrl-C stops; the same command goes on where it stopped.");
  command->callback([options, &code] { code = finish_with_coordinator(run_chart(*options)); });
}

}  // namespace baton
