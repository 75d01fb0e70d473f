#include "common/base/team.h"

#include <optional>
#include <utility>

#include "common/base/trace.h"

namespace baton {

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
