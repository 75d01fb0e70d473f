#pragma once

#include <atomic>
#include <chrono>
#include <optional>
#include <string>

#include "common/base/exit_codes.h"
#include "common/protocol/access.h"
#include "worker/run/job_cache.h"

namespace baton {

struct WorkerOptions {
  std::string endpoint;   ///< the coordinator: "tcp://127.0.0.1:5570"
  int num_threads = 1;    ///< render threads, at least 1
  std::string worker_id;  ///< for people; empty: host and process id
  ClientAccess access = {};
  Machine machine = {};
  /// Silence of the coordinator after which the worker ends; 0: never.
  std::chrono::seconds give_up{60};
  /// When it must be gone; it takes nothing that it cannot finish before.
  std::optional<std::chrono::system_clock::time_point> end_at = {};
  /// Time without a task after which the worker ends; 0: never.
  std::chrono::seconds idle_exit{0};
  /// Time that the worker goes on with its tasks when told to end; 0: to their end.
  std::chrono::seconds drain{0};
};

/// Holds this process to an instruction set, before anything is computed (limit_instruction_set).
Status use_instruction_set(const std::string& name);

/// Program version, ray tracer and instruction sets, one per line.
std::string describe_worker();

/// Works for a coordinator until it says Shutdown (ok), the worker is to end and has finished or
/// given back its leases (ok), or the coordinator has been silent for too long (unavailable).
/// signals: how many have asked it to end; from the second one on it gives back what it has begun.
/// The calling thread becomes the control thread: it owns the channel and never renders.
ExitCode run_worker(const WorkerOptions& options, const std::atomic<int>& signals);

}  // namespace baton
