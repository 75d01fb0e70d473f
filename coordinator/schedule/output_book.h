#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "coordinator/schedule/job_graph.h"

namespace baton {

/// What the tasks of a job have made, and who made it.
class OutputBook {
 public:
  /// The sums of what is there now.
  struct Totals {
    std::uint32_t frames = 0;
    std::uint64_t state_bytes = 0;
    std::uint64_t state_pixels = 0;  ///< without those of held states
    std::size_t num_held = 0;        ///< held states, needed or not
  };

  explicit OutputBook(const JobGraph& graph)
      : records_(static_cast<std::size_t>(graph.num_tasks())) {}

  /// Sorted; empty unless the task is done.
  const std::vector<BlobRef>& outputs(TaskIndex task) const { return record(task).outputs; }
  /// What the task made when it was done before it was opened again; sorted, or empty.
  const std::vector<BlobRef>& former_outputs(TaskIndex task) const;
  /// Whether what it counted when it was done before is still in the job's sums.
  bool is_counted(TaskIndex task) const;
  /// The worker that completed the task last; stranger() where that is not known.
  const std::string& maker(TaskIndex task) const { return makers_[record(task).maker]; }
  /// Stands for workers of an earlier coordinator, and for all beyond limits::kMaxWorkers.
  const std::string& stranger() const { return makers_.front(); }
  /// Whether every further worker is known by name.
  bool tells_makers() const;
  /// The state of a done task if it is held; else null.
  const BlobRef* held_state(TaskIndex task) const;
  const Totals& totals() const { return totals_; }

  /// The task is done with these, complete and sorted (JobGraph::check_outputs).
  void enter(const JobGraph& graph, TaskIndex task, std::vector<BlobRef> outputs);
  void set_maker(TaskIndex task, const std::string& worker);
  /// A held state is in the store now.
  void publish_state(const JobGraph& graph, TaskIndex task, const BlobRef& published);
  /// What the task made before this coordinator began, if nothing is known that is newer.
  void remember(TaskIndex task, std::vector<BlobRef> outputs);
  /// The task is not done any more. remember: what it makes must come out alike.
  void remove(const JobGraph& graph, TaskIndex task, bool remember);

 private:
  struct Record {
    std::uint16_t maker = 0;  ///< place in makers_
    std::vector<BlobRef> outputs;
  };
  Record& record(TaskIndex task) { return records_[static_cast<std::size_t>(task)]; }
  const Record& record(TaskIndex task) const { return records_[static_cast<std::size_t>(task)]; }
  void count(const JobGraph& graph, const BlobRef& output, bool made);

  std::vector<Record> records_;
  struct Former {
    std::vector<BlobRef> outputs;
    bool is_counted = true;
  };
  std::map<TaskIndex, Former> former_;
  std::vector<std::string> makers_{"(not known)"};
  std::map<std::string, std::uint16_t> maker_numbers_;
  Totals totals_;
};

}  // namespace baton
