#include "worker/run/render_threads.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/trace.h"

namespace baton {

RenderThreads::RenderThreads(int num_threads, Execute execute, Publish publish,
                             std::function<void()> wake)
    : execute_(std::move(execute)), publish_(std::move(publish)), wake_(std::move(wake)) {
  for (int i = 0; i < num_threads; ++i) {
    threads_.emplace_back([this, i] {
      name_traced_thread(fmt::format("render {}", i + 1));
      work();
    });
  }
  threads_.emplace_back([this] {
    name_traced_thread("publisher");
    publish_executed();
  });
}

RenderThreads::~RenderThreads() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
    for (Slot& slot : slots_) slot.stop.request_stop();
  }
  changed_.notify_all();
  executed_any_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void RenderThreads::submit(QueuedTask task) {
  {
    const std::lock_guard lock(mutex_);
    slots_.push_back({std::move(task), {}, false});
  }
  changed_.notify_one();
}

bool RenderThreads::lend(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    if (closing_ || lent_.size() >= num_idle_) return false;
    lent_.push_back(std::move(work));
  }
  changed_.notify_one();
  return true;
}

void RenderThreads::stop(const LeaseId& lease) {
  const std::lock_guard lock(mutex_);
  for (Slot& slot : slots_) {
    if (slot.task.grant.lease == lease) slot.stop.request_stop();
  }
}

void RenderThreads::drop_queued() {
  const std::lock_guard lock(mutex_);
  for (auto slot = slots_.begin(); slot != slots_.end();) {
    if (slot->running) {
      ++slot;
      continue;
    }
    // A copy: GCC 12 sees unset members in a moved temporary.
    const TaskEnded dropped{slot->task.grant.lease,
                            Error{ErrorKind::cancelled, "dropped before it began"}};
    ended_.push_back(dropped);
    slot = slots_.erase(slot);
  }
}

std::vector<LeaseId> RenderThreads::take_executed() {
  const std::lock_guard lock(mutex_);
  return std::exchange(left_thread_, {});
}

std::vector<TaskEnded> RenderThreads::collect() {
  const std::lock_guard lock(mutex_);
  return std::exchange(ended_, {});
}

void RenderThreads::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    // Take the oldest task that nobody has begun.
    auto slot = slots_.end();
    ++num_idle_;
    changed_.wait(lock, [&] {
      slot = std::find_if(slots_.begin(), slots_.end(), [](const Slot& s) { return !s.running; });
      return closing_ || !lent_.empty() || slot != slots_.end();
    });
    --num_idle_;
    if (!lent_.empty()) {  // somebody waits for it
      const std::function<void()> work = std::move(lent_.front());
      lent_.pop_front();
      lock.unlock();
      work();
      lock.lock();
      continue;
    }
    if (closing_) return;
    slot->running = true;

    // Execute it without the lock; list nodes do not move.
    lock.unlock();
    const std::stop_token stop = slot->stop.get_token();
    TaskEnded end{slot->task.grant.lease, Error{ErrorKind::cancelled, "stopped before it began"}};
    if (!stop.stop_requested()) end.result = execute_(slot->task, stop, end.left);
    lock.lock();
    left_thread_.push_back(slot->task.grant.lease);
    executed_.tasks.push_back(std::move(slot->task));
    executed_.ends.push_back(std::move(end));
    slots_.erase(slot);
    executed_any_.notify_one();
    wake_();
  }
}

void RenderThreads::publish_executed() {
  std::unique_lock lock(mutex_);
  while (true) {
    executed_any_.wait(lock, [&] { return closing_ || !executed_.tasks.empty(); });
    if (closing_) return;
    Executed batch = std::exchange(executed_, {});

    // One wait for all that went well, without the lock.
    lock.unlock();
    std::vector<QueuedTask> good;
    for (std::size_t i = 0; i < batch.tasks.size(); ++i) {
      if (batch.ends[i].result) good.push_back(batch.tasks[i]);
    }
    const Status published = good.empty() ? Status() : publish_(good);
    lock.lock();
    for (TaskEnded& end : batch.ends) {
      if (end.result && !published) {
        end.left = std::move(end.result->made.outputs);
        end.result = published.error();
      }
      ended_.push_back(std::move(end));
    }
    wake_();
  }
}

}  // namespace baton
