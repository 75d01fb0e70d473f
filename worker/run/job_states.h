#pragma once

#include <atomic>
#include <utility>
#include <vector>

#include "common/base/digest.h"
#include "common/job/step_keep.h"
#include "common/job/task.h"
#include "common/state/sample_state.h"

namespace baton {

/// The decoded states of one job that are in this process, in one share of its memory. Those that
/// it *holds* are nowhere else and stay until no task needs them; they have the names of
/// held_state_name(). Those that it *keeps* are in the store, too: where things move, a state is
/// the input of several tasks. They make room for held ones. Any number of threads.
class JobStates {
 public:
  using StatePtr = std::shared_ptr<const SampleState>;
  using List = std::vector<std::pair<BlobRef, StatePtr>>;

  explicit JobStates(const MemorySharePtr& share) : held_(share), kept_(share) {}

  /// False: there is no room, and it is not held.
  bool hold(const BlobRef& ref, const StatePtr& state);
  /// Whether a state found no room since the last call.
  bool take_lack_of_room() { return lacks_room_.exchange(false); }
  /// Keeps a state of the store, if there is room.
  void keep(const Digest& digest, const StatePtr& state) { kept_.keep(digest, state->step, state); }
  /// Null: it is not here.
  StatePtr find(const BlobRef& ref) const;

  /// Those of the held states that are named; all, in the order of their names.
  List held(const std::vector<Digest>& names) const;
  List held() const;
  bool holds_any() const { return !held_.empty(); }

  /// Forgets the states of steps before this one: no task needs them.
  void release_before(Step step) {
    held_.release_before(step);
    kept_.release_before(step);
  }
  /// Leaves the room of what it keeps to other jobs.
  void drop_kept() { kept_.clear(); }
  /// What all states take.
  std::size_t size_bytes() const { return held_.size_bytes() + kept_.size_bytes(); }

 private:
  StepKeep<Digest, SampleState> held_, kept_;
  std::atomic<bool> lacks_room_ = false;
};

}  // namespace baton
