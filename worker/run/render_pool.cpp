#include "worker/run/render_pool.h"

#include <algorithm>

namespace baton {

RenderPool::RenderPool(int num_threads, Execute execute, std::function<void()> wake)
    : execute_(std::move(execute)), wake_(std::move(wake)) {
  for (int i = 0; i < num_threads; ++i) threads_.emplace_back([this] { work(); });
}

RenderPool::~RenderPool() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    for (Slot& slot : slots_) slot.stop.request_stop();
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void RenderPool::submit(PooledTask task) {
  {
    const std::lock_guard lock(mutex_);
    slots_.push_back({std::move(task), {}, false});
  }
  changed_.notify_one();
}

void RenderPool::stop(const LeaseId& lease) {
  const std::lock_guard lock(mutex_);
  for (Slot& slot : slots_) {
    if (slot.task.lease == lease) slot.stop.request_stop();
  }
}

void RenderPool::drop_queued() {
  const std::lock_guard lock(mutex_);
  for (auto slot = slots_.begin(); slot != slots_.end();) {
    if (slot->running) {
      ++slot;
      continue;
    }
    // A copy: GCC 12 sees unset members in a moved temporary.
    const EndedTask dropped{slot->task.lease,
                            Error{ErrorKind::cancelled, "dropped before it began"}};
    ended_.push_back(dropped);
    slot = slots_.erase(slot);
  }
}

std::vector<EndedTask> RenderPool::collect() {
  const std::lock_guard lock(mutex_);
  return std::exchange(ended_, {});
}

void RenderPool::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    // Take the oldest task that nobody has begun.
    auto slot = slots_.end();
    changed_.wait(lock, [&] {
      slot = std::find_if(slots_.begin(), slots_.end(), [](const Slot& s) { return !s.running; });
      return closing_ || slot != slots_.end();
    });
    if (closing_) return;
    slot->running = true;

    // Run it without the lock; list nodes do not move.
    lock.unlock();
    const std::stop_token stop = slot->stop.get_token();
    Result<TaskOutput> result = stop.stop_requested()
                                    ? Error{ErrorKind::cancelled, "stopped before it began"}
                                    : execute_(slot->task, stop);
    lock.lock();
    ended_.push_back({slot->task.lease, std::move(result)});
    slots_.erase(slot);
    wake_();
  }
}

}  // namespace baton
