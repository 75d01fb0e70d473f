#include "worker/accel/geometry_sequence.h"

#include <algorithm>

#include "common/base/limits.h"
#include "common/job/motion.h"

namespace baton {

Result<std::shared_ptr<const FrameGeometry>> GeometrySequence::at(std::int32_t index) {
  // A job in which nothing moves has one frame for all.
  const std::int32_t name = moves(job_) ? index : 0;
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(frames_.begin(), frames_.end(), [&](const auto& f) { return f.first == name; });
  if (found != frames_.end()) {
    frames_.splice(frames_.begin(), frames_, found);
    return frames_.front().second;
  }

  // The placed ray tracer refers to the instances beside it.
  auto frame = std::make_shared<FrameGeometry>();
  frame->pose = pose_at(scene_, job_, job_.frames[static_cast<std::size_t>(name)]);
  const bool placed = std::any_of(scene_.instances.begin(), scene_.instances.end(),
                                  [](const Instance& instance) { return instance.moves(); });
  frame->accel = rest_;
  if (placed) {
    BATON_ASSIGN(frame->accel, rest_->place(frame->pose.instances));
  }
  frames_.emplace_front(name, std::move(frame));
  if (frames_.size() > limits::kMaxCachedPoses) frames_.pop_back();
  return frames_.front().second;
}

}  // namespace baton
