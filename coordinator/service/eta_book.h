#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/job/activity.h"
#include "common/job/farm_event.h"
#include "coordinator/schedule/forecast.h"
#include "coordinator/schedule/scheduler.h"
#include "coordinator/schedule/task_times.h"

namespace baton {

/// How long the tasks of open jobs take, and when the jobs will be done (forecast.h).
class EtaBook {
 public:
  /// A lease of the job has ended.
  void add(const Scheduler::Job& job, const TellLeaseEnd& end, TimePoint now);
  /// What an earlier coordinator has told of the job's tasks that are done, in the order of time.
  void take_up(const Digest& version, const Scheduler::Job& job,
               const std::vector<FarmEvent>& done);
  /// A version of a job has ended.
  void forget(const Digest& version);

  /// Tasks that each worker that takes some has in hand at once.
  using Slots = std::vector<std::pair<std::string, int>>;

  /// Of a job that runs. slots: of whom is here. What was found is
  /// told for some seconds, less what has passed, since a forecast of many tasks takes its time.
  Eta of(const Digest& version, const Scheduler& scheduler, const Slots& slots,
         TimePoint now) const;

 private:
  struct Found {
    std::map<Digest, Eta> etas;
    TimePoint at{}, again{};
  };
  void note(const Digest& version, const JobGraph& graph, const TaskKey& task,
            const std::string& worker, double seconds);
  Found find(const Scheduler& scheduler, const Slots& slots, TimePoint now) const;

  std::map<Digest, TaskTimes> times_;
  std::set<std::pair<Digest, std::string>> begun_;  ///< workers that have done a task of a job
  mutable Found found_;
};

}  // namespace baton
