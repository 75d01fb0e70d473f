#pragma once

#include <optional>
#include <string>

#include "jobs/cli/ask_farm.h"
#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/run_count.h"
#include "jobs/study/study_runner.h"

namespace baton {

/// Renders jobs with a local farm that lives as long as the runner and starts with the first job,
/// or with the farm of a coordinator that runs already, which forgets them when they are done. A
/// few jobs are submitted at a time, so that workers never wait for the next; they keep their place
/// in the farm's journal, and go on where they stopped.
class FarmJobRunner final : public JobRunner {
 public:
  explicit FarmJobRunner(FarmOptions options) : options_(std::move(options)) {}
  explicit FarmJobRunner(CoordinatorLink coordinator) : coordinator_(std::move(coordinator)) {}
  ~FarmJobRunner() override;

  /// Counts all that is run from now on in one line, instead of a line for each call of run().
  void count_as_one(std::string label, std::size_t expected_frames);
  void finish_count();
  /// Nothing is counted aloud from now on.
  void be_quiet() { is_quiet_ = true; }
  /// Looks replace whatever is in the places of their frames; other runs do so in any case.
  void restart_looks() { restarts_looks_ = true; }
  void say(const std::string& text) override;

  /// Error: cancelled when the user asked to stop.
  Status run(const std::vector<JobSpec>& jobs,
             const std::function<Status(std::size_t index, const JobSummary&)>& done) override;

 private:
  struct Open {
    std::size_t index = 0;
    JobId job;
    std::string waits = {};  ///< for what, when it was asked last
  };

  Status start();
  Status submit(const JobSpec& wanted, std::size_t index, std::vector<Open>& open);
  /// How far the job is; says once what it waits for. Error: it has failed.
  Result<JobSummary> ask(Open& job, const JobSpec& spec);

  FarmOptions options_;
  std::optional<CoordinatorLink> coordinator_;  ///< none before a local farm is started
  std::optional<RunCount> whole_;
  bool restarts_looks_ = false, is_quiet_ = false;
  SignalWait signals_;
  std::optional<LocalFarm> farm_;
  std::optional<RequestClient> client_;
};

}  // namespace baton
