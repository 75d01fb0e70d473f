#include "worker/run/job_states.h"

namespace baton {
namespace {

BlobRef ref_of(const Digest& name, const SampleState& state) {
  return {BlobKind::state, state.step.value(), state.tile, name};
}

}  // namespace

bool JobStates::hold(const BlobRef& ref, const StatePtr& state) {
  if (held_.keep(ref.digest, ref.step(), state)) return true;
  kept_.clear();
  if (held_.keep(ref.digest, ref.step(), state)) return true;
  lacks_room_ = true;
  return false;
}

JobStates::StatePtr JobStates::find(const BlobRef& ref) const {
  return ref.is_held() ? held_.find(ref.digest) : kept_.find(ref.digest);
}

JobStates::List JobStates::held(const std::vector<Digest>& names) const {
  List result;
  for (const Digest& name : names) {
    if (StatePtr state = held_.find(name)) result.emplace_back(ref_of(name, *state), state);
  }
  return result;
}

JobStates::List JobStates::held() const {
  List result;
  for (auto& [name, state] : held_.all()) result.emplace_back(ref_of(name, *state), state);
  return result;
}

}  // namespace baton
