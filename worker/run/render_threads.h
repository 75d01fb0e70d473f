#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <stop_token>
#include <thread>
#include <vector>

#include "worker/run/execute.h"

namespace baton {

/// What a render thread needs to execute one task without asking anybody.
struct QueuedTask {
  Grant grant;
  std::shared_ptr<JobEntry> job;
  std::shared_ptr<BlobStore> store;
};

/// The render threads, and one more that waits for the disk. The control thread submits, stops and
/// collects; it never renders. Each render thread takes the oldest queued task, executes it with a
/// stop token of its own and goes on with the next; the publisher makes durable what has been
/// executed, all that came up during one wait by the next, and leaves the results for `collect`.
/// The queue is bounded by the session, which requests few more leases than there are threads.
class RenderThreads {
 public:
  /// `left`: see execute_task().
  using Execute = std::function<Result<TaskResult>(
      const QueuedTask& task, const std::stop_token& stop, std::vector<BlobRef>& left)>;
  /// Makes the outputs of tasks that went well durable; an error becomes that of each of them.
  using Publish = std::function<Status(std::span<const QueuedTask> tasks)>;

  /// `wake` is called on one of the threads whenever there is something to take or to collect.
  RenderThreads(int num_threads, Execute execute, Publish publish, std::function<void()> wake);
  /// Stops every task and joins.
  ~RenderThreads();
  RenderThreads(const RenderThreads&) = delete;
  RenderThreads& operator=(const RenderThreads&) = delete;

  void submit(QueuedTask task);
  /// Lend: a render thread without a task does it, before any task.
  bool lend(std::function<void()> work);
  /// Asks a queued or begun task to end soon; its result will be ErrorKind::cancelled unless it was
  /// about to end.
  void stop(const LeaseId& lease);
  /// Ends every task that no thread has begun as cancelled.
  void drop_queued();
  /// Tasks that have left their thread since the last call; each will end.
  std::vector<LeaseId> take_executed();
  /// Results since the last call, in the order in which they ended.
  std::vector<TaskEnded> collect();

 private:
  struct Slot {
    QueuedTask task;
    std::stop_source stop;
    bool running = false;
  };

  struct Executed {
    std::vector<QueuedTask> tasks;
    std::vector<TaskEnded> ends;  ///< (tasks) how each has ended
  };

  void work();
  void publish_executed();

  const Execute execute_;
  const Publish publish_;
  const std::function<void()> wake_;
  std::mutex mutex_;
  std::condition_variable changed_;       ///< for the render threads
  std::condition_variable executed_any_;  ///< for the publisher
  std::size_t num_idle_ = 0;              ///< threads that wait for changed_
  /// What idle threads have been lent to and have not begun: no more than there are of them.
  std::deque<std::function<void()>> lent_;
  std::list<Slot> slots_;  ///< oldest first; queued and begun
  Executed executed_;      ///< not yet durable
  std::vector<LeaseId> left_thread_;
  std::vector<TaskEnded> ended_;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace baton
