#pragma once

#include <string>

#include "coordinator/service/farm_core.h"

namespace baton {

/// What anybody may ask: of jobs, tasks, workers and events. Nothing changes by it. Errors: the
/// journal's; what is wrong with a question is its answer (Refused).
class Questions {
 public:
  /// farm: outlives the questions.
  explicit Questions(FarmCore& farm) : farm_(farm) {}

  Status answer(const PeerId& peer, const ListJobs& message);
  Status answer(const PeerId& peer, const ShowJob& message);
  Status answer(const PeerId& peer, const AskWhy& message);
  Status answer(const PeerId& peer, const AskPicture& message);
  Status answer(const PeerId& peer, const ListTasks& message);
  Status answer(const PeerId& peer, const ListEvents& message);

  /// Describes a version of a job that is known here or in the archive. plan: of ResumeJob.
  Status answer_detail(const PeerId& peer, const Digest& job, std::string plan = {});
  /// The newest version of the job that a text names. Errors: choose_job's.
  Result<Digest> resolve(const std::string& text);

 private:
  FarmCore& farm_;
};

}  // namespace baton
