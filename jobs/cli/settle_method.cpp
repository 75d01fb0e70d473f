#include "jobs/cli/settle_method.h"

#include <fmt/format.h>

#include "jobs/auto/auto_pilot.h"
#include "jobs/cli/farm_job_runner.h"

namespace baton {

Status settle_method(JobSpec& job, const FarmOptions& farm) {
  if (job.sampling.method != Method::automatic) return {};
  const StudyFolder folder(farm.work_directory / "pilot");
  FarmOptions pilot_farm = farm;
  pilot_farm.work_directory = folder.farm_folder();
  pilot_farm.workers = 1;
  pilot_farm.threads_per_worker = farm.workers * farm.threads_per_worker;
  FarmJobRunner runner(pilot_farm);
  BATON_ASSIGN(const std::vector<PilotNumbers> pilot, settle_auto(job, folder, runner));
  for (const PilotNumbers& seen : pilot) {
    fmt::print(stderr, "pilot      {:<26} error {:.4f}  {:.2f} us per pixel and frame\n",
               seen.candidate.name(), seen.error, seen.cost_us);
  }
  fmt::print(stderr, "chosen     {}\nbecause    {}\n", job.metadata["auto.choice"],
             job.metadata["auto.reason"]);
  return {};
}

}  // namespace baton
