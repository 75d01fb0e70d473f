#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "coordinator/schedule/attempt_book.h"
#include "coordinator/schedule/standings.h"
#include "coordinator/schedule/task_book.h"

namespace baton {

/// Who may have what, as pure functions over snapshots: nothing here changes anything, or has ever
/// seen a Scheduler.

/// The workers that are connected and may work on one job, as they stand with it.
struct Crew {
  const std::vector<std::string>& connected;
  const Standings& standings;
  TimePoint now;
};

/// By worker: how it has failed one task.
using TaskBlame = std::map<std::string, Blame>;

/// Whether the worker gets nothing of the job: it does not see its folders, or it has failed much,
/// while others have not.
bool rests(const Crew& crew, const std::string& worker);
/// Whether nobody who is connected sees the job's folders; also where nobody is connected.
bool are_all_blind(const Crew& crew);
/// Whether the worker could succeed, and no other connected one has failed the task less often.
bool may_try(const Crew& crew, const TaskBlame& blame, const std::string& worker);
/// Whether anybody who is connected may try the task now.
bool somebody_may_try(const Crew& crew, const TaskBlame& blame);
/// Whether the task has failed for good: with as many workers as it may have attempts, or with all
/// that are connected, where each can do no more or all attempts are used up.
bool is_exhausted(std::span<const std::string> connected, const TaskBlame& blame,
                  std::int32_t max_retries);
/// The last run of which a task may be granted: nothing is rendered far ahead of the first open
/// step.
Run last_due_run(const JobGraph& graph, const TaskBook& book, std::int32_t max_frames_ahead);

}  // namespace baton
