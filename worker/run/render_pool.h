#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "worker/run/execute.h"

namespace baton {

/// What a render thread needs to run one task without asking anybody.
struct PooledTask {
  LeaseId lease;
  std::vector<BlobRef> inputs;
  std::shared_ptr<JobEntry> job;
  std::shared_ptr<BlobStore> store;
};

struct EndedTask {
  LeaseId lease;
  Result<TaskOutput> result;
};

/// The render threads. The control thread submits, stops and collects; it never renders. Each
/// thread takes the oldest queued task, runs it with a stop token of its own, and leaves the result
/// for `collect`. The queue is bounded by the session, which asks for no more leases than threads
/// + 1.
class RenderPool {
 public:
  using Execute = std::function<Result<TaskOutput>(const PooledTask& task, std::stop_token stop)>;

  /// `wake` is called on a render thread whenever a result is ready.
  RenderPool(int num_threads, Execute execute, std::function<void()> wake);
  /// Stops every task and joins.
  ~RenderPool();
  RenderPool(const RenderPool&) = delete;
  RenderPool& operator=(const RenderPool&) = delete;

  void submit(PooledTask task);
  /// Asks a queued or running task to end soon; its result will be ErrorKind::cancelled unless it
  /// was about to end.
  void stop(const LeaseId& lease);
  /// Ends every task that no thread has begun as cancelled.
  void drop_queued();
  /// Results since the last call, in the order in which they ended.
  std::vector<EndedTask> collect();

 private:
  struct Slot {
    PooledTask task;
    std::stop_source stop;
    bool running = false;
  };

  void work();

  const Execute execute_;
  const std::function<void()> wake_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Slot> slots_;  ///< oldest first; queued and running
  std::vector<EndedTask> ended_;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace baton
