#include "coordinator/schedule/task_times.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace baton {
namespace {

constexpr double kLeastSeconds = 1e-4;
/// Of a tile's own times the newest few tell its level.
constexpr std::size_t kLevel = 4;
/// How far the growth may carry a time.
constexpr double kCarried = 2;
constexpr double kMostGrowth = 1.8;  // e^1.8 is 6

double middle(const StepSpan& steps) { return 0.5 * (steps.first.value() + steps.last.value()); }

/// Where a tile has others, its first does not count.
template <class Seen>
std::size_t first_that_counts(const std::deque<Seen>& tile) {
  return tile.size() > 1 && tile.front().is_first ? 1 : 0;
}

}  // namespace

void TaskTimes::add(const Done& task) {
  Kind& kind = kinds_[static_cast<std::size_t>(task.kind)];
  const auto tile = static_cast<std::size_t>(task.tile);
  if (kind.tiles.size() <= tile) kind.tiles.resize(tile + 1);
  std::deque<Seen>& seen = kind.tiles[tile];
  // What was made by the way counts only until there is another time.
  if (task.is_first && !seen.empty()) return;
  const double log_seconds = std::log(std::max(task.seconds, kLeastSeconds) / task.steps.size());
  if (!seen.empty() && seen.front().is_first) {
    kind.firsts_longer += seen.front().log_seconds - log_seconds;
    ++kind.num_firsts;
    seen.pop_front();
  }
  if (seen.size() >= kNewest) seen.pop_front();
  seen.push_back({middle(task.steps), log_seconds, task.is_first});
  ++kind.count;
  kind.growth.reset();
  kind.error_so_far.reset();
}

/// Least squares with one slope for all tiles and a level for each.
TaskTimes::Growth TaskTimes::fit(const Kind& kind) {
  struct Point {
    double place, x, y;
  };
  std::vector<Point> points;
  double xx = 0, xy = 0, yy = 0;
  std::size_t num_tiles = 0;
  Growth growth;
  for (const std::deque<Seen>& tile : kind.tiles) {
    if (tile.size() < 2) continue;
    double x = 0, y = 0;
    for (const Seen& seen : tile) {
      x += seen.place / static_cast<double>(tile.size());
      y += seen.log_seconds / static_cast<double>(tile.size());
    }
    for (const Seen& seen : tile) {
      const Point point{seen.place, seen.place - x, seen.log_seconds - y};
      xx += point.x * point.x;
      xy += point.x * point.y;
      yy += point.y * point.y;
      points.push_back(point);
    }
    growth.seen = std::max(growth.seen, tile.back().place - tile.front().place);
    ++num_tiles;
  }
  const std::size_t num = points.size();
  if (num <= num_tiles + 1) return growth;
  const double freedom = static_cast<double>(num - num_tiles - 1);
  growth.slope = xx > 0 ? xy / xx : 0;
  growth.spread = std::sqrt(std::max(0.0, yy - growth.slope * xy) / freedom);
  // What befalls a step befalls all of its tiles.
  std::map<double, double> of_steps;
  for (const Point& point : points)
    of_steps[point.place] += point.x * (point.y - growth.slope * point.x);
  double square = 0;
  for (const auto& [place, sum] : of_steps) square += sum * sum;
  const double num_steps = static_cast<double>(of_steps.size());
  if (xx > 0)
    growth.error = num_steps > 2 ? std::sqrt(square * num_steps / (num_steps - 2)) / xx
                                 : growth.spread / std::sqrt(xx);
  // What may be chance is carried on less.
  const double chance = growth.slope != 0 ? growth.error / growth.slope : 1;
  growth.slope *= std::max(0.0, 1 - chance * chance);
  return growth;
}

const TaskTimes::Growth& TaskTimes::growth_of(const Kind& kind) {
  if (!kind.growth) kind.growth = fit(kind);
  return *kind.growth;
}

double TaskTimes::seconds_of_step(const Kind& kind, std::size_t tile, double place,
                                  double deviations) {
  const Growth& growth = growth_of(kind);
  const double slope = growth.slope + deviations * growth.error;
  // Carried to where the task is; what grew for a while does not do so for ever.
  const double most = kCarried * growth.seen;
  const auto carried = [&](double distance) {
    return most > 0 ? slope * most * (1 - std::exp(-distance / most)) : 0;
  };
  const double first_longer =
      kind.num_firsts > 0 ? kind.firsts_longer / static_cast<double>(kind.num_firsts) : 0;
  const auto level_of = [&](const std::deque<Seen>& seen) {
    const std::size_t from =
        std::max(first_that_counts(seen), seen.size() - std::min(seen.size(), kLevel));
    double level = 0;
    for (std::size_t i = from; i < seen.size(); ++i)
      level += seen[i].log_seconds - (seen[i].is_first ? first_longer : 0) +
               std::clamp(carried(place - seen[i].place), -kMostGrowth, kMostGrowth);
    return level / static_cast<double>(seen.size() - from);
  };
  const double mean_of_noise = 0.5 * growth.spread * growth.spread;
  if (tile < kind.tiles.size() && !kind.tiles[tile].empty())
    return std::exp(level_of(kind.tiles[tile]) + mean_of_noise);
  // Nothing is known of this one: as the others in the mean.
  double seconds = 0, num = 0;
  for (const std::deque<Seen>& seen : kind.tiles) {
    if (seen.empty()) continue;
    seconds += std::exp(level_of(seen) + mean_of_noise);
    ++num;
  }
  return seconds / num;
}

std::optional<double> TaskTimes::expected(TaskKind which, std::int32_t tile, const StepSpan& steps,
                                          double deviations) const {
  const Kind& kind = kinds_[static_cast<std::size_t>(which)];
  if (kind.count < kLeast) return std::nullopt;
  return steps.size() *
         seconds_of_step(kind, static_cast<std::size_t>(tile), middle(steps), deviations);
}

double TaskTimes::level_error(TaskKind which, std::int32_t tile) const {
  const Kind& kind = kinds_[static_cast<std::size_t>(which)];
  const auto place = static_cast<std::size_t>(tile);
  const std::size_t num = place < kind.tiles.size() ? kind.tiles[place].size() : 0;
  return growth_of(kind).spread /
         std::sqrt(static_cast<double>(std::clamp<std::size_t>(num, 1, kLevel)));
}

double TaskTimes::spread(TaskKind kind) const {
  return growth_of(kinds_[static_cast<std::size_t>(kind)]).spread;
}

double TaskTimes::error_so_far(TaskKind which) const {
  const Kind& kind = kinds_[static_cast<std::size_t>(which)];
  if (kind.error_so_far) return *kind.error_so_far;
  double first = std::numeric_limits<double>::max(), last = 0;
  for (const std::deque<Seen>& tile : kind.tiles) {
    if (tile.empty()) continue;
    first = std::min(first, tile.front().place);
    last = std::max(last, tile.back().place);
  }
  double square = 0, num = 0;
  for (const double share : {0.25, 0.4, 0.55}) {
    const double cut = first + share * (last - first);
    Kind before;
    before.tiles.resize(kind.tiles.size());
    before.firsts_longer = kind.firsts_longer;
    before.num_firsts = kind.num_firsts;
    for (std::size_t tile = 0; tile < kind.tiles.size(); ++tile) {
      for (const Seen& seen : kind.tiles[tile]) {
        if (seen.place <= cut) before.tiles[tile].push_back(seen);
      }
      before.count += before.tiles[tile].size();
    }
    double came = 0, was_expected = 0, chance = 0;
    for (std::size_t tile = 0; tile < kind.tiles.size(); ++tile) {
      double of_tile = 0, num_after = 0;
      for (const Seen& seen : kind.tiles[tile]) {
        if (seen.place <= cut || before.tiles[tile].empty()) continue;
        of_tile += std::exp(seen.log_seconds);
        was_expected += seconds_of_step(before, tile, seen.place, 0);
        ++num_after;
      }
      if (num_after == 0) continue;
      came += of_tile;
      const auto num_before = static_cast<double>(std::min(before.tiles[tile].size(), kLevel));
      chance += of_tile * of_tile * (1 / num_before + 1 / num_after);
    }
    if (came == 0) continue;
    const double off = std::log(came / was_expected);
    const double spread = growth_of(before).spread;
    square += off * off - spread * spread * chance / (came * came);
    ++num;
  }
  kind.error_so_far = num > 0 ? std::sqrt(std::max(square, 0.0) / num) : 0;
  return *kind.error_so_far;
}

}  // namespace baton
