#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "common/base/exit_codes.h"
#include "common/job/roots.h"
#include "common/protocol/keys.h"

namespace baton {

struct WorkerOptions {
  std::string endpoint;   ///< of the coordinator, e.g. "tcp://127.0.0.1:5570"
  int num_threads = 1;    ///< render threads, at least 1
  std::string worker_id;  ///< for people; empty: host and process id
  ClientAccess access = {};
  Roots roots = {};  ///< folders that jobs may read from and write to; empty: all
  std::chrono::seconds give_up{
      60};  ///< silence of the coordinator after which the worker ends; 0: never
};

/// Program version, ray tracer and instruction sets, one per line.
std::string describe_worker();

/// Works for a coordinator until it says Shutdown (ok), `drain` becomes true and the running tasks
/// are finished (ok), or it has been silent for too long (unavailable). The calling thread becomes
/// the control thread: it owns the channel and never renders.
ExitCode run_worker(const WorkerOptions& options, const std::atomic<bool>& drain);

}  // namespace baton
