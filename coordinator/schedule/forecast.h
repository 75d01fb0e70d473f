#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "common/job/activity.h"
#include "coordinator/schedule/job_graph.h"
#include "coordinator/schedule/task_book.h"
#include "coordinator/schedule/task_times.h"

namespace baton {

/// An open job as a forecast needs it. What is referred to outlives the forecast.
struct ForecastJob {
  const JobGraph& graph;
  const TaskBook& book;
  const TaskTimes& times;
  /// Tasks that the workers have in hand at once that may do it.
  int most_at_once = std::numeric_limits<int>::max();
  /// How long each leased task has been in work.
  std::vector<std::pair<TaskIndex, double>> in_work = {};
};

/// The steps that a task works on: of an assembly the last one of its frame.
StepSpan steps_of(const JobGraph& graph, const TaskKey& task);

/// Plays the open jobs to their end on so many threads, as Scheduler would grant their tasks if all
/// workers were alike and none came or went: jobs in this order, of each the first ready task, of
/// none more than most_at_once. What is in work goes on. With very many tasks only their times are
/// added up. Not known is that of a job with tasks of a kind of which too few are done
/// (TaskTimes::kLeast), and of all behind it; without threads that of all.
std::vector<Eta> forecast(const std::vector<ForecastJob>& jobs, int num_threads);

}  // namespace baton
