#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/job/task.h"

namespace baton {

/// How long the tasks of one job have taken of late, and what that says of the next: what a tile
/// takes is what it took before, times how the job's cost has grown since, as of a camera that
/// comes closer. Times are of one thread, from the grant to the report.
class TaskTimes {
 public:
  /// Tasks of a kind before anything is said of others.
  static constexpr std::size_t kLeast = 3;

  /// A task that is done. steps: that it worked on.
  struct Done {
    TaskKind kind = TaskKind::render;
    std::int32_t tile = 0;
    StepSpan steps = {};
    double seconds = 0;
    /// It also made what later ones find: a worker's scene, the samples of a tile's first step.
    bool is_first = false;
  };
  void add(const Done& task);

  /// What a task will take, in seconds; nullopt: too few of its kind are done. deviations: of the
  /// growth, whose own error is the only one that all tasks of a job share.
  std::optional<double> expected(TaskKind kind, std::int32_t tile, const StepSpan& steps,
                                 double deviations = 0) const;
  /// The standard deviation of the logarithm of what a tile takes, which all of its tasks share: it
  /// is known from few of them.
  double level_error(TaskKind kind, std::int32_t tile) const;
  /// The standard deviation of the logarithm of a task's seconds about what is expected.
  double spread(TaskKind kind) const;
  /// How far off this would have been: of what is done, the later part as expected from the earlier
  /// one, as the root mean square of the logarithm of both sums, at several places of the cut; less
  /// what is chance of single tiles.
  double error_so_far(TaskKind kind) const;

 private:
  static constexpr std::size_t kNewest = 64;  ///< tasks of a tile that count
  struct Seen {
    double place;  ///< the middle of its steps
    double log_seconds;
    bool is_first;
  };
  /// Of the logarithm of the seconds of a step, by steps.
  struct Growth {
    double slope = 0, error = 0, spread = 0.1;
    double seen = 0;  ///< steps from the first to the last
  };
  struct Kind {
    std::vector<std::deque<Seen>> tiles;  ///< seconds of one step
    std::size_t count = 0;
    /// How much longer than the next of its tile the first task of one took: logarithms, in all.
    double firsts_longer = 0;
    std::size_t num_firsts = 0;
    mutable std::optional<Growth> growth = {};  ///< once somebody asks
    mutable std::optional<double> error_so_far = {};
  };
  static Growth fit(const Kind& kind);
  static const Growth& growth_of(const Kind& kind);
  static double seconds_of_step(const Kind& kind, std::size_t tile, double place,
                                double deviations);

  std::array<Kind, 3> kinds_;  ///< by TaskKind
};

}  // namespace baton
