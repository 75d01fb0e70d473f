#include "coordinator/schedule/forecast.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <random>
#include <set>
#include <span>

namespace baton {
namespace {

/// Draws from which the interval comes, and what one draw may cost in all: with more tasks there
/// are fewer draws, which then differ less.
constexpr std::size_t kMostDraws = 15, kLeastDraws = 5, kMostTasks = 200'000;
/// What is left is longer than what error_so_far() looked ahead, and goes farther off.
constexpr double kFartherOff = 2.3;
/// What the model itself leaves out: other work on the machines, scenes that change.
constexpr double kUnknown = 0.01;

/// growth: see TaskTimes::expected.
double expected_seconds(const ForecastJob& job, TaskIndex task, double growth) {
  const TaskKey key = job.graph.key(task);
  return job.times
      .expected(key.kind, key.kind == TaskKind::assemble ? 0 : key.tile, steps_of(job.graph, key),
                growth)
      .value_or(0);
}

/// The logarithm of how far all of a job may be off, as one standard deviation.
double uncertainty(const ForecastJob& job) {
  return std::hypot(kUnknown, kFartherOff * job.times.error_so_far(TaskKind::render));
}

/// A job while it is played.
struct Played {
  const ForecastJob& job;
  std::vector<std::int32_t> missing;  ///< inputs of each task that are not done
  std::set<TaskIndex> ready;
  std::size_t num_open = 0;
  int at_once = 0;  ///< tasks in work
  double end = 0;

  explicit Played(const ForecastJob& played) : job(played) {
    const JobGraph& graph = job.graph;
    missing.resize(static_cast<std::size_t>(graph.num_tasks()));
    for (TaskIndex task = 0; task < graph.num_tasks(); ++task) {
      if (!is_open(job.book.status(task))) continue;
      ++num_open;
      // Of an open task alone: most are done, or all of their inputs are.
      if (job.book.status(task) != TaskStatus::blocked) continue;
      for (const TaskIndex input : graph.inputs(graph.key(task)))
        missing[static_cast<std::size_t>(task)] += is_open(job.book.status(input)) ? 1 : 0;
    }
    ready = job.book.ready();
  }
};

struct Running {
  double end;
  std::size_t job;
  TaskIndex task;
  bool operator>(const Running& other) const { return end > other.end; }
};

/// One draw: tasks take what is expected, times chance.
class Play {
 public:
  Play(const std::vector<Played>& jobs, int num_threads, double growth, double pace,
       std::uint64_t seed)
      : jobs_(jobs), free_(num_threads), growth_(growth), pace_(pace), random_(seed) {
    for (const Played& played : jobs_) {
      std::vector<double>& levels = levels_.emplace_back();
      for (std::int32_t tile = 0; tile < played.job.graph.num_tiles(); ++tile)
        levels.push_back(
            std::exp(played.job.times.level_error(TaskKind::render, tile) * normal_(random_)));
    }
  }

  /// When each job ends.
  std::vector<double> run() {
    for (std::size_t j = 0; j < jobs_.size(); ++j) {
      for (const auto& [task, seconds] : jobs_[j].job.in_work) {
        // What has taken longer than it should takes half as long again as it has by now.
        const double all = draw(j, task);
        begin(j, task, std::max(all - seconds, 0.25 * all));
      }
    }
    grant();
    while (!running_.empty()) {
      const Running done = running_.top();
      running_.pop();
      now_ = done.end;
      ++free_;
      finish(done.job, done.task);
      grant();
    }
    std::vector<double> ends;
    for (const Played& played : jobs_) ends.push_back(played.end);
    return ends;
  }

 private:
  double draw(std::size_t j, TaskIndex task) {
    const ForecastJob& job = jobs_[j].job;
    const TaskKey key = job.graph.key(task);
    const double spread = job.times.spread(key.kind);
    const double level =
        key.kind == TaskKind::render ? levels_[j][static_cast<std::size_t>(key.tile)] : 1;
    const double mean =
        level * std::exp(uncertainty(job) * pace_) * expected_seconds(job, task, growth_);
    return mean * std::exp(spread * normal_(random_) - 0.5 * spread * spread);
  }
  void begin(std::size_t job, TaskIndex task, double seconds) {
    running_.push({now_ + seconds, job, task});
    --free_;
    ++jobs_[job].at_once;
  }
  void grant() {
    for (std::size_t j = 0; j < jobs_.size() && free_ > 0; ++j) {
      std::set<TaskIndex>& ready = jobs_[j].ready;
      while (free_ > 0 && !ready.empty() && jobs_[j].at_once < jobs_[j].job.most_at_once) {
        const TaskIndex task = *ready.begin();
        ready.erase(ready.begin());
        begin(j, task, draw(j, task));
      }
    }
  }
  void finish(std::size_t j, TaskIndex task) {
    Played& played = jobs_[j];
    --played.at_once;
    if (--played.num_open == 0) played.end = now_;
    const JobGraph& graph = played.job.graph;
    for (const TaskIndex next : graph.dependents(graph.key(task))) {
      if (played.job.book.status(next) != TaskStatus::blocked) continue;
      if (--played.missing[static_cast<std::size_t>(next)] == 0) played.ready.insert(next);
    }
  }

  std::vector<Played> jobs_;
  std::vector<std::vector<double>> levels_;  ///< of the tiles of each job, as factors
  int free_;
  const double growth_, pace_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double now_ = 0;
  std::priority_queue<Running, std::vector<Running>, std::greater<>> running_;
};

/// Whether all kinds of tasks that are open have times.
bool is_known(const ForecastJob& job) {
  std::set<TaskKind> kinds;
  const JobGraph& graph = job.graph;
  for (TaskIndex task = 0; task < graph.num_tasks(); ++task) {
    if (!is_open(job.book.status(task))) continue;
    const TaskKey key = graph.key(task);
    if (!kinds.insert(key.kind).second) continue;
    if (!job.times.expected(key.kind, 0, {Step(0), Step(0)})) return false;
  }
  return true;
}

/// The value below which a share of the draws lies.
double quantile(const std::vector<double>& sorted, double share) {
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(place);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (place - static_cast<double>(low)) * (sorted[high] - sorted[low]);
}

/// Tasks that fill all threads till the end.
std::vector<Eta> added_up(std::span<const ForecastJob> jobs, int num_threads) {
  constexpr double kNineInTen = 1.2816;  // standard deviations
  std::vector<Eta> etas;
  double seconds = 0;
  for (const ForecastJob& job : jobs) {
    for (TaskIndex task = 0; task < job.graph.num_tasks(); ++task) {
      if (is_open(job.book.status(task))) seconds += expected_seconds(job, task, 0);
    }
    const double likely = seconds / std::max(std::min(num_threads, job.most_at_once), 1);
    const double factor = std::exp(kNineInTen * uncertainty(job));
    etas.push_back({likely / factor, likely, likely * factor});
  }
  return etas;
}

}  // namespace

StepSpan steps_of(const JobGraph& graph, const TaskKey& task) {
  if (task.kind != TaskKind::assemble) return graph.steps(task);
  const Step step = graph.timeline().last_step_of(task.frame());
  return {step, step};
}

std::vector<Eta> forecast(const std::vector<ForecastJob>& jobs, int num_threads) {
  std::vector<Eta> etas(jobs.size());
  if (num_threads < 1) return etas;
  std::size_t num_known = 0, num_tasks = 0;
  while (num_known < jobs.size() && is_known(jobs[num_known]))
    num_tasks += jobs[num_known++].book.counts().open;
  if (num_tasks * kLeastDraws > kMostTasks) {
    std::ranges::copy(added_up({jobs.data(), num_known}, num_threads), etas.begin());
    return etas;
  }
  std::vector<Played> played;
  for (std::size_t j = 0; j < num_known; ++j) played.emplace_back(jobs[j]);
  const std::size_t num_draws =
      std::clamp(kMostTasks / std::max<std::size_t>(num_tasks, 1), kLeastDraws, kMostDraws);

  // What all tasks share is spread evenly over the draws, not left to chance.
  std::vector<std::vector<double>> ends(num_known);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (std::size_t d = 0; d < num_draws; ++d) {
    const double pace = normal(random), growth = normal(random);
    const std::vector<double> of_draw = Play(played, num_threads, growth, pace, d).run();
    for (std::size_t j = 0; j < num_known; ++j) ends[j].push_back(of_draw[j]);
  }
  for (std::size_t j = 0; j < num_known; ++j) {
    std::ranges::sort(ends[j]);
    etas[j] = Eta{quantile(ends[j], 0.1), quantile(ends[j], 0.5), quantile(ends[j], 0.9)};
  }
  return etas;
}

}  // namespace baton
