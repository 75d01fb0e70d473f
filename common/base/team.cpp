#include "common/base/team.h"

#include <memory>
#include <utility>

#include "common/base/trace.h"

namespace baton {
namespace {

/// Parts that several threads take, one after the other.
struct Parts {
  const std::string& what;
  const std::size_t count;
  const std::function<void(std::size_t)>& part;
  std::mutex mutex = {};
  std::condition_variable changed = {};
  std::size_t next = 0;
  int helpers = 0;

  /// Does one that nobody has begun; false: there is none.
  bool do_one() {
    std::size_t number = 0;
    {
      const std::lock_guard lock(mutex);
      if (next == count) return false;
      number = next++;
    }
    const Span span(SpanKind::help, what);
    part(number);
    return true;
  }
  bool has_more() {
    const std::lock_guard lock(mutex);
    return next < count;
  }
  void count_helper(bool comes) {
    const std::lock_guard lock(mutex);
    helpers += comes ? 1 : -1;
    if (!comes) changed.notify_all();
  }
};

}  // namespace

void share_parts(const Lend& lend, const std::string& what, std::size_t count,
                 const std::function<void(std::size_t)>& part) {
  const Span span(SpanKind::share, what);
  Parts parts{what, count, part};
  const auto help = [&parts] {
    while (parts.do_one()) {
    }
    parts.count_helper(false);
  };
  do {
    while (parts.has_more()) {
      parts.count_helper(true);
      if (lend(help)) continue;
      parts.count_helper(false);
      break;
    }
  } while (parts.do_one());
  std::unique_lock lock(parts.mutex);
  parts.changed.wait(lock, [&] { return parts.helpers == 0; });
}

Team::Turn::Turn(Team& team, std::string what) : team_(team) {
  std::unique_lock lock(team.mutex_);
  if (team.is_taken_) {
    const Span wait(SpanKind::wait, what);
    while (team.is_taken_) {
      team.help(lock);
      if (team.is_taken_) team.changed_.wait(lock);
    }
  }
  team.is_taken_ = true;
  team.what_ = std::move(what);
}

Team::Turn::~Turn() {
  {
    const std::lock_guard lock(team_.mutex_);
    team_.is_taken_ = false;
  }
  team_.changed_.notify_all();
}

void Team::Turn::share(std::size_t parts, const std::function<void(std::size_t)>& part) {
  std::unique_lock lock(team_.mutex_);
  team_.part_ = &part;
  team_.count_ = parts;
  team_.next_ = team_.done_ = 0;
  team_.changed_.notify_all();
  team_.help(lock);
  team_.changed_.wait(lock, [&] { return team_.done_ == team_.count_; });
  team_.part_ = nullptr;
}

void Team::help(std::unique_lock<std::mutex>& lock) {
  while (part_ != nullptr && next_ < count_) {
    const std::function<void(std::size_t)>& part = *part_;
    const std::size_t number = next_++;
    const std::string what = what_;
    lock.unlock();
    {
      const Span span(SpanKind::help, what);
      part(number);
    }
    lock.lock();
    if (++done_ == count_) changed_.notify_all();
  }
}

}  // namespace baton
