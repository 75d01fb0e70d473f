#include "jobs/trace/played_trace.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

namespace baton {
namespace {

constexpr std::int32_t kFilm = 1;  ///< BlobKind::film, as it is sent

/// Parts lie in what is made, or in a wait.
bool is_work(SpanKind kind) { return kind == SpanKind::make || kind == SpanKind::wait; }

/// Busy time of a span: where threads share a processor, that of the clock says too much.
double cpu_of(const TracedSpan& span) {
  return span.cpu_seconds >= 0 ? std::min(span.cpu_seconds, span.seconds) : span.seconds;
}

using Thread = std::pair<std::int32_t, std::int32_t>;

/// Takes the spans of all threads apart.
class Dissection {
 public:
  explicit Dissection(const Trace& trace) {
    for (const TracedSpan& span : trace.spans) {
      by_thread_[{span.process, span.thread}].push_back(&span);
      if (span.kind == SpanKind::help) helps_[{span.process, span.name}].push_back(&span);
    }
    for (auto& [thread, spans] : by_thread_) add_thread(spans);
    join_tasks();
    join_works();
    set_order();
    const double begin_s = trace.begin_s(), end_s = trace.end_s();
    double first_s = end_s, last_s = begin_s;
    for (const TracedSpan& span : trace.spans) {
      if (span.kind != SpanKind::task) continue;
      first_s = std::min(first_s, span.start_s);
      last_s = std::max(last_s, span.end_s());
    }
    played_.lead_s = std::max(first_s - begin_s, 0.0);
    played_.tail_s = std::max(end_s - last_s, 0.0);
    for (const TracedSpan& span : trace.spans) {
      if (span.kind != SpanKind::publish) continue;
      const auto found = of_key_.find(key_of(span.task));
      if (found != of_key_.end()) played_.tasks[found->second].publish_s = span.seconds;
    }
  }
  PlayedTrace take() { return std::move(played_); }

 private:
  /// (version of the job, kind, position, tile)
  using Key = std::tuple<std::string, std::string, std::int32_t, std::int32_t>;
  static Key key_of(const TracedTask& task) {
    return {task.job, task.kind, task.position, task.tile};
  }
  /// A stretch of a task: a frame of it, or what lies between its frames.
  struct Stretch {
    std::int32_t step = -1;
    double busy_s = 0;
    std::vector<PlayedTask::Piece> shares = {};
  };
  struct Work {
    double made_s = 0, own_help_s = 0;
    std::size_t times = 0;
    double help_s = 0;
    double first_s = std::numeric_limits<double>::max();  ///< when somebody needed it
    std::set<std::int32_t> steps;                         ///< in which frames; -1: beside them
  };
  struct Found {
    const TracedSpan* span = nullptr;
    std::vector<Stretch> stretches;
  };

  /// The spans of a thread come in the order of their starts, what contains others first.
  void add_thread(const std::vector<const TracedSpan*>& spans) {
    for (std::size_t i = 0; i < spans.size(); ++i) {
      const TracedSpan& task = *spans[i];
      if (task.kind != SpanKind::task) continue;
      std::size_t end = i + 1;
      while (end < spans.size() && spans[end]->start_s < task.end_s()) ++end;
      add_task(task, {spans.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                      spans.begin() + static_cast<std::ptrdiff_t>(end)});
    }
  }
  void add_task(const TracedSpan& task, const std::vector<const TracedSpan*>& inside) {
    Found found{&task, {{-1, cpu_of(task)}}};
    double frame_end_s = 0, work_end_s = 0, io_end_s = 0;
    const TracedSpan* share = nullptr;
    std::string work;
    bool is_made_here = false;
    for (const TracedSpan* span : inside) {
      if (span->kind == SpanKind::frame && span->start_s >= work_end_s) {
        found.stretches.push_back({span->step, cpu_of(*span)});
        found.stretches.push_back({});
        found.stretches.front().busy_s -= cpu_of(*span);
        frame_end_s = span->end_s();
      }
      const bool is_in_frame = span->start_s < frame_end_s;
      Stretch& stretch =
          is_in_frame ? found.stretches[found.stretches.size() - 2] : found.stretches.back();
      // What lies in a work is of it.
      if (is_work(span->kind) && span->start_s >= work_end_s) {
        Work& of = works_[{task.task.job, span->name}];
        of.first_s = std::min(of.first_s, span->start_s);
        of.steps.insert(is_in_frame ? stretch.step : -1);
        if (span->kind == SpanKind::make) {
          of.made_s += busy_of(*span, inside);
          ++of.times;
        }
        (is_in_frame ? stretch : found.stretches.front()).busy_s -= cpu_of(*span);
        work_end_s = span->end_s();
        work = span->name;
        is_made_here = span->kind == SpanKind::make;
      } else if (span->kind == SpanKind::share && span->start_s >= work_end_s) {
        share = span;
        stretch.shares.push_back(parts_of(*span));
      } else if (span->kind == SpanKind::help && share != nullptr && is_part_of(*span, *share)) {
        stretch.busy_s -= cpu_of(*span);
      } else if (span->kind == SpanKind::help) {
        Work& of = works_[{task.task.job, span->name}];
        of.help_s += cpu_of(*span);
        if (is_made_here && span->name == work) of.own_help_s += cpu_of(*span);
      }
      if ((span->kind == SpanKind::read || span->kind == SpanKind::write) &&
          span->start_s >= work_end_s && span->start_s >= io_end_s) {
        stretch.busy_s += span->seconds - cpu_of(*span);
        io_end_s = span->end_s();
      }
    }
    if (!task.task.is_lost && !task.task.kind.empty()) found_.push_back(std::move(found));
  }
  static bool is_part_of(const TracedSpan& part, const TracedSpan& share) {
    constexpr double kRounding = 1e-6;
    return part.name == share.name && part.start_s >= share.start_s - kRounding &&
           part.end_s() <= share.end_s() + kRounding;
  }
  /// By whoever did them.
  PlayedTask::Piece parts_of(const TracedSpan& share) const {
    PlayedTask::Piece piece;
    const auto found = helps_.find({share.process, share.name});
    if (found == helps_.end()) return piece;
    for (const TracedSpan* part : found->second) {
      if (!is_part_of(*part, share)) continue;
      ++piece.parts;
      piece.part_s += cpu_of(*part);
    }
    if (piece.parts > 0) piece.part_s /= static_cast<double>(piece.parts);
    return piece;
  }
  /// Busy time of a work, reading and writing in it included.
  static double busy_of(const TracedSpan& work, const std::vector<const TracedSpan*>& inside) {
    double busy_s = cpu_of(work), until_s = 0;
    for (const TracedSpan* span : inside) {
      if (span->start_s < work.start_s || span->end_s() > work.end_s()) continue;
      if (span->kind != SpanKind::read && span->kind != SpanKind::write) continue;
      if (span->start_s < until_s) continue;
      busy_s += span->seconds - cpu_of(*span);
      until_s = span->end_s();
    }
    return busy_s;
  }

  /// In the order of their starts, the last attempt at each.
  void join_tasks() {
    std::ranges::stable_sort(found_, {}, [](const Found& f) { return f.span->start_s; });
    for (std::size_t i = 0; i < found_.size(); ++i) last_of_key_[key_of(found_[i].span->task)] = i;
    for (std::size_t i = 0; i < found_.size(); ++i) {
      const TracedSpan& span = *found_[i].span;
      if (last_of_key_[key_of(span.task)] != i) continue;
      of_key_[key_of(span.task)] = played_.tasks.size();
      kept_.push_back(i);
      PlayedTask& task = played_.tasks.emplace_back();
      task.kind = span.task.kind;
      task.began_s = span.start_s;
    }
  }
  /// Numbers the works and gives each frame what it needs.
  void join_works() {
    std::vector<std::pair<std::pair<std::string, std::string>, Work>> ordered(works_.begin(),
                                                                              works_.end());
    std::ranges::stable_sort(ordered, {}, [](const auto& w) { return w.second.first_s; });
    std::map<std::pair<std::string, std::int32_t>, std::vector<std::size_t>> needed;
    for (const auto& [name, work] : ordered) {
      const double times = static_cast<double>(std::max<std::size_t>(work.times, 1));
      for (const std::int32_t step : work.steps)
        needed[{name.first, step}].push_back(played_.works.size());
      played_.works.push_back(
          {name.second, std::max(work.made_s - work.own_help_s, 0.0) / times, work.help_s / times});
    }
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const Found& found = found_[kept_[i]];
      for (const Stretch& stretch : found.stretches) {
        PlayedTask::Piece piece{{}, std::max(stretch.busy_s, 0.0)};
        const bool is_first = &stretch == &found.stretches.front();
        if (stretch.step >= 0 || is_first)
          piece.works = needed[{found.span->task.job, stretch.step}];
        std::vector<PlayedTask::Piece>& pieces = played_.tasks[i].pieces;
        if (piece.seconds > 0 || !piece.works.empty()) pieces.push_back(std::move(piece));
        pieces.insert(pieces.end(), stretch.shares.begin(), stretch.shares.end());
      }
    }
  }
  /// Who needs whose results.
  void set_order() {
    // By version, step and tile.
    std::map<std::tuple<std::string, std::int32_t, std::int32_t>, std::size_t> renders, seconds;
    std::map<std::pair<std::string, std::int32_t>, std::vector<std::size_t>> films, second_films;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const TracedTask& task = found_[kept_[i]].span->task;
      if (task.kind == "render") {
        for (std::int32_t step = task.first; step <= task.last; ++step) {
          renders[{task.job, step, task.tile}] = i;
          films[{task.job, step}].push_back(i);
        }
      } else if (task.kind == "second pass") {
        seconds[{task.job, task.position, task.tile}] = i;
        second_films[{task.job, task.position}].push_back(i);
      }
    }
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const TracedTask& task = found_[kept_[i]].span->task;
      std::vector<std::size_t>& after = played_.tasks[i].after;
      for (const auto& [kind, position, tile] : task.inputs) {
        const auto& of =
            kind == kFilm && task.kind == "render" && seconds.contains({task.job, position, tile})
                ? seconds
                : renders;
        const auto found = of.find({task.job, position, tile});
        if (found != of.end() && found->second != i) after.push_back(found->second);
      }
      if (task.step < 0) continue;
      const auto& last = second_films.contains({task.job, task.step}) ? second_films : films;
      const auto found = last.find({task.job, task.step});
      if (found != last.end())
        after.insert(after.end(), found->second.begin(), found->second.end());
    }
  }

  std::map<Thread, std::vector<const TracedSpan*>> by_thread_;
  std::map<std::pair<std::int32_t, std::string>, std::vector<const TracedSpan*>> helps_;
  std::vector<Found> found_;
  /// Of found_, by the number of the played task.
  std::vector<std::size_t> kept_;
  std::map<Key, std::size_t> last_of_key_, of_key_;
  std::map<std::pair<std::string, std::string>, Work> works_;  ///< by version and name
  PlayedTrace played_;
};

/// The state of a simulation.
class Player {
 public:
  Player(const PlayedTrace& trace, std::size_t threads)
      : trace_(trace), free_(threads), tasks_(trace.tasks.size()), works_(trace.works.size()) {
    for (std::size_t i = 0; i < trace.tasks.size(); ++i) {
      for (const std::size_t before : trace.tasks[i].after) tasks_[before].followers.push_back(i);
      tasks_[i].missing = trace.tasks[i].after.size();
      if (tasks_[i].missing == 0) ready_.push(i);
    }
    for (std::size_t w = 0; w < works_.size(); ++w) {
      works_[w].alone_s = trace.works[w].alone_s;
      works_[w].shared_s = trace.works[w].shared_s;
    }
  }

  Playback run() {
    begin_ready();
    while (!events_.empty()) {
      const Event event = events_.top();
      events_.pop();
      now_s_ = event.time_s;
      if (event.kind == EventKind::piece_done) end_piece(event.number);
      if (event.kind == EventKind::part_done) end_part(event.number, /*is_helper=*/false);
      if (event.kind == EventKind::helped_part_done) end_part(event.number, /*is_helper=*/true);
      if (event.kind == EventKind::published) release(event.number);
      if (event.kind == EventKind::work_done && works_[event.number].version == event.version)
        end_work(event.number);
      begin_ready();
    }
    return result();
  }

 private:
  enum class EventKind { piece_done, part_done, helped_part_done, published, work_done };
  struct Event {
    double time_s;
    EventKind kind;
    std::size_t number;   ///< of the task or work
    std::size_t version;  ///< of the work's state
    std::size_t order;

    bool operator>(const Event& other) const {
      return std::pair(time_s, order) > std::pair(other.time_s, other.order);
    }
  };
  struct BusyStretch {
    double from_s, to_s, threads;
  };
  struct Task {
    std::size_t missing = 0;
    std::vector<std::size_t> followers;
    std::size_t piece = 0, work = 0;  ///< at which it is
    double work_since_s = 0;
    std::size_t parts_left = 0, parts_begun = 0;  ///< begun: and not done
    double end_s = 0;
    std::optional<std::size_t> cause;  ///< whose result came last
    double busy_s = 0;
    std::map<std::string, double> waits_s;
  };
  struct Work {
    bool is_made = false;
    double alone_s = 0, shared_s = 0;  ///< left
    double since_s = 0;
    std::size_t version = 0;
    std::vector<std::size_t> tasks;  ///< that are at it
  };

  void add(double time_s, EventKind kind, std::size_t number, std::size_t version = 0) {
    events_.push({time_s, kind, number, version, next_order_++});
  }
  void begin_ready() {
    while (free_ > 0 && !sharing_.empty()) {
      --free_;
      begin_part(*sharing_.begin(), /*is_helper=*/true);
    }
    while (free_ > 0 && !ready_.empty()) {
      --free_;
      const std::size_t task = ready_.top();
      ready_.pop();
      go_on(task);
    }
  }
  /// A task at the beginning of a piece, or with another of its works there.
  void go_on(std::size_t number) {
    Task& task = tasks_[number];
    const std::vector<PlayedTask::Piece>& pieces = trace_.tasks[number].pieces;
    if (task.piece == pieces.size()) return end_task(number);
    const PlayedTask::Piece& piece = pieces[task.piece];
    while (task.work < piece.works.size()) {
      const std::size_t work = piece.works[task.work];
      if (!works_[work].is_made) {
        task.work_since_s = now_s_;
        return join(work, number);
      }
      ++task.work;
    }
    if (piece.parts > 0) {
      task.parts_left = piece.parts;
      sharing_.insert(number);
      return begin_part(number, /*is_helper=*/false);
    }
    task.busy_s += piece.seconds;
    stretches_.push_back({now_s_, now_s_ + piece.seconds, 1});
    add(now_s_ + piece.seconds, EventKind::piece_done, number);
  }
  void begin_part(std::size_t number, bool is_helper) {
    Task& task = tasks_[number];
    const double part_s = trace_.tasks[number].pieces[task.piece].part_s;
    if (--task.parts_left == 0) sharing_.erase(number);
    ++task.parts_begun;
    if (!is_helper) task.busy_s += part_s;
    stretches_.push_back({now_s_, now_s_ + part_s, 1});
    add(now_s_ + part_s, is_helper ? EventKind::helped_part_done : EventKind::part_done, number);
  }
  void end_part(std::size_t number, bool is_helper) {
    Task& task = tasks_[number];
    --task.parts_begun;
    if (task.parts_left > 0) return begin_part(number, is_helper);
    if (is_helper) ++free_;
    if (task.parts_begun == 0) end_piece(number);
  }
  void end_piece(std::size_t number) {
    Task& task = tasks_[number];
    ++task.piece;
    task.work = 0;
    go_on(number);
  }
  void join(std::size_t number, std::size_t task) {
    Work& work = works_[number];
    advance(work);
    work.tasks.push_back(task);
    const double left_s = work.alone_s + work.shared_s / static_cast<double>(work.tasks.size());
    add(now_s_ + left_s, EventKind::work_done, number, ++work.version);
  }
  /// One works alone first, then all do.
  void advance(Work& work) {
    const double since_s = std::exchange(work.since_s, now_s_);
    if (work.tasks.empty()) return;
    const double alone_s = std::min(now_s_ - since_s, work.alone_s);
    const double shared_since_s = since_s + alone_s, passed_s = now_s_ - shared_since_s;
    const auto count = static_cast<double>(work.tasks.size());
    stretches_.push_back({since_s, shared_since_s, 1});
    stretches_.push_back({shared_since_s, now_s_, count});
    work.alone_s -= alone_s;
    work.shared_s = std::max(work.shared_s - passed_s * count, 0.0);
  }
  void end_work(std::size_t number) {
    Work& work = works_[number];
    advance(work);
    work.is_made = true;
    for (const std::size_t at : std::exchange(work.tasks, {})) {
      tasks_[at].waits_s[without_number(trace_.works[number].name)] +=
          now_s_ - tasks_[at].work_since_s;
      ++tasks_[at].work;
      go_on(at);
    }
  }
  void end_task(std::size_t number) {
    ++free_;
    tasks_[number].end_s = now_s_;
    end_s_ = now_s_;
    last_ = number;
    add(now_s_ + trace_.tasks[number].publish_s, EventKind::published, number);
  }
  void release(std::size_t number) {
    for (const std::size_t follower : tasks_[number].followers) {
      if (--tasks_[follower].missing > 0) continue;
      tasks_[follower].cause = number;
      ready_.push(follower);
    }
  }
  Playback result() const {
    Playback playback;
    playback.seconds = trace_.lead_s + end_s_ + trace_.tail_s;
    if (playback.seconds > 0) playback.busy = trace_.work_s() / playback.seconds;
    for (const BusyStretch& stretch : stretches_)
      playback.busy_over_time.add(playback.seconds, trace_.lead_s + stretch.from_s,
                                  trace_.lead_s + stretch.to_s, stretch.threads);
    if (tasks_.empty()) return playback;
    for (std::optional<std::size_t> at = last_; at; at = tasks_[*at].cause) {
      playback.chain_s[trace_.tasks[*at].kind] += tasks_[*at].busy_s;
      for (const auto& [work, seconds] : tasks_[*at].waits_s)
        playback.chain_waits_s[work] += seconds;
      ++playback.chain_tasks;
    }
    return playback;
  }

  const PlayedTrace& trace_;
  std::size_t free_;
  double now_s_ = 0, end_s_ = 0;
  std::size_t last_ = 0, next_order_ = 0;
  std::vector<Task> tasks_;
  std::vector<Work> works_;
  std::vector<BusyStretch> stretches_;
  std::set<std::size_t> sharing_;  ///< tasks with parts that nobody has begun
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  std::priority_queue<std::size_t, std::vector<std::size_t>, std::greater<>> ready_;
};

}  // namespace

double PlayedTrace::work_s() const {
  double sum_s = 0;
  for (const PlayedTask& task : tasks) {
    for (const PlayedTask::Piece& piece : task.pieces)
      sum_s += piece.seconds + static_cast<double>(piece.parts) * piece.part_s;
  }
  for (const SharedWork& work : works) sum_s += work.alone_s + work.shared_s;
  return sum_s;
}

void BusyOverTime::add(double whole_s, double from_s, double to_s, double count) {
  const double slice_s = whole_s / static_cast<double>(kSlices);
  if (slice_s <= 0) return;
  const auto slice_of = [&](double time_s) {
    return std::min(static_cast<std::size_t>(std::max(time_s, 0.0) / slice_s), kSlices - 1);
  };
  for (std::size_t i = slice_of(from_s); i <= slice_of(to_s); ++i) {
    const double begin_s = slice_s * static_cast<double>(i), end_s = begin_s + slice_s;
    const double covered_s = std::min(to_s, end_s) - std::max(from_s, begin_s);
    if (covered_s > 0) threads[i] += count * covered_s / slice_s;
  }
}

PlayedTrace take_apart(const Trace& trace) { return Dissection(trace).take(); }

Playback play(const PlayedTrace& trace, std::size_t threads) {
  return Player(trace, threads).run();
}

}  // namespace baton
