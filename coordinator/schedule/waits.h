#pragma once

#include <string>

#include "coordinator/schedule/scheduler.h"

namespace baton {

/// What the job, which must be known, cannot go on without; empty: it goes on, or has ended. Of a
/// job that failed although its tasks are done, what somebody must decide.
std::string waits_for(const Scheduler& scheduler, const Digest& job, TimePoint now);

/// Whether the store has no room for the next task of the job, which must be known, and nothing in
/// work will make some.
bool lacks_room(const Scheduler& scheduler, const Digest& job);

}  // namespace baton
