#include "jobs/cli/settle_method.h"

#include <fmt/format.h>

#include "jobs/auto/unit_costs.h"
#include "jobs/cli/farm_job_runner.h"
#include "jobs/cli/say.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

Status settle(JobSpec& job, const StudyFolder& folder, FarmJobRunner& runner) {
  BATON_ASSIGN(const double ray_factor, ray_cost_factor(job));
  const PilotPlan plan = plan_pilot(job, ray_factor);
  tell("a pilot chooses the method: {}\n", pilot_text(plan));
  runner.count_as_one("trying", plan.frames);
  BATON_ASSIGN(const std::vector<PilotNumbers> pilot, settle_auto(job, folder, runner));
  runner.finish_count();
  for (const PilotNumbers& seen : pilot) {
    tell("pilot      {:<26} error {:.4f}  {:.2f} us per pixel and frame\n", seen.candidate.name(),
         seen.error, seen.cost_us);
  }
  tell("chosen     {}\nbecause    {}\n", job.metadata["auto.choice"], job.metadata["auto.reason"]);
  return {};
}

}  // namespace

std::string pilot_text(const PilotPlan& plan) {
  return fmt::format(
      "{} candidates at {} of the job, some {} frames of {} pixels, about {} of CPU time",
      plan.candidates, plan.windows == 1 ? "the start" : "both ends", plan.frames, plan.pixels,
      duration_text(plan.cpu_seconds));
}

Status settle_method(JobSpec& job, const FarmOptions& farm) {
  if (job.sampling.method != Method::automatic) return {};
  const StudyFolder folder(farm.work_directory / "pilot");
  FarmOptions pilot_farm = farm;
  pilot_farm.work_directory = folder.farm_folder();
  pilot_farm.workers = 1;
  pilot_farm.threads_per_worker = farm.workers * farm.threads_per_worker;
  FarmJobRunner runner(pilot_farm);
  return settle(job, folder, runner);
}

Status settle_method_at(JobSpec& job, const CoordinatorLink& coordinator) {
  if (job.sampling.method != Method::automatic) return {};
  FarmJobRunner runner(coordinator);
  return settle(job, StudyFolder(std::filesystem::path(job.output.directory) / ".baton/pilot"),
                runner);
}

}  // namespace baton
