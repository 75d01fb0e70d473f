#pragma once

#include <string>
#include <utility>
#include <vector>

#include "coordinator/schedule/job_tasks.h"

namespace baton {

/// Held states: a worker may keep what it made between checkpoints in memory and out of the store.
/// Then it alone can read it, until it publishes it.

/// Whether the state of a render task may be held: it is neither a checkpoint nor a result, nothing
/// of the job has failed yet, so no task must change its worker, and it is not made again, so that
/// what is lost is lost once.
bool may_hold(const JobTasks& tasks, TaskIndex task);
/// The held inputs of a task that has its inputs, with the workers that hold them.
std::vector<std::pair<std::string, Digest>> held_inputs(const JobTasks& tasks, TaskIndex task);
/// Whether the worker holds whichever of the task's inputs is held at all.
bool can_read(const JobTasks& tasks, TaskIndex task, const std::string& worker);
/// Held states that somebody needs now, by the task that made them.
std::vector<TaskIndex> held_now(const JobTasks& tasks);
/// Those of them that the worker holds; with it they are gone.
std::vector<TaskKey> held_by(const JobTasks& tasks, const std::string& worker);
/// Those of workers of an earlier coordinator, from which nothing can be had.
std::vector<TaskKey> held_by_strangers(const JobTasks& tasks);

}  // namespace baton
