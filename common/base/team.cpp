#include "common/base/team.h"

#include <utility>

#include "common/base/trace.h"

namespace baton {

bool Parts::do_one() {
  std::size_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    if (next_ == count_) return false;
    number = next_++;
  }
  const Span span(SpanKind::help, what_);
  part_(number);
  return true;
}

void Parts::wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return num_helpers_ == 0; });
}

bool Parts::add_helper() {
  const std::lock_guard lock(mutex_);
  if (next_ == count_) return false;
  ++num_helpers_;
  return true;
}

void Parts::remove_helper() {
  const std::lock_guard lock(mutex_);
  if (--num_helpers_ == 0) changed_.notify_all();
}

void Parts::help() {
  while (do_one()) {
  }
  remove_helper();
}

void share_parts(const Lend& lend, const std::string& what, std::size_t count,
                 const std::function<void(std::size_t)>& part) {
  const Span span(SpanKind::share, what);
  Parts parts(what, count, part);
  do {
    while (parts.add_helper()) {
      if (lend([&parts] { parts.help(); })) continue;
      parts.remove_helper();
      break;
    }
  } while (parts.do_one());
  parts.wait();
}

Team::Turn::Turn(Team& team, std::string what) : team_(team) {
  std::unique_lock lock(team.mutex_);
  if (team.is_taken_) {
    const Span wait(SpanKind::wait, what);
    while (team.is_taken_) {
      if (Parts* const parts = team.parts_; parts != nullptr && parts->add_helper()) {
        lock.unlock();
        parts->help();
        lock.lock();
      } else {
        team.changed_.wait(lock);
      }
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

void Team::Turn::share(std::size_t count, const std::function<void(std::size_t)>& part) {
  Parts parts(team_.what_, count, part);
  const auto show = [&](Parts* shown) {
    const std::lock_guard lock(team_.mutex_);
    team_.parts_ = shown;
  };
  show(&parts);
  team_.changed_.notify_all();
  while (parts.do_one()) {
  }
  show(nullptr);
  parts.wait();
}

}  // namespace baton
