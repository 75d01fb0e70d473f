#include "worker/accel/geometry_sequence.h"

#include <algorithm>

#include "common/job/motion.h"
#include "common/job/sequence.h"

namespace baton {

std::size_t FrameGeometry::size_bytes() const {
  std::size_t size = 0;
  for (const auto& shape : pose.shapes) size += shape == nullptr ? 0 : shape->size_bytes();
  return size > 0 ? size + accel->placement_bytes() : 0;
}

Result<std::shared_ptr<const FrameGeometry>> GeometrySequence::at(std::int32_t index) {
  // A job in which nothing moves has one frame for all.
  const std::int32_t name = moves(job_) ? frame_of_step(job_, index) : 0;
  if (auto found = frames_.find(name)) return found;  // while another frame is built
  const std::lock_guard lock(placing_);
  if (auto found = frames_.find(name)) return found;

  // The placed ray tracer refers to the instances beside it.
  auto frame = std::make_shared<FrameGeometry>();
  frame->pose = pose_at(scene_, job_, job_.frames[static_cast<std::size_t>(name)]);
  const bool placed = std::any_of(scene_.instances.begin(), scene_.instances.end(),
                                  [](const Instance& instance) { return instance.moves(); });
  frame->accel = rest_;
  frame->scene = &scene_;
  if (placed) {
    BATON_ASSIGN(frame->accel, rest_->place(frame->pose.instances, frame->pose.shapes));
  }
  return frames_.insert(name, std::move(frame));
}

}  // namespace baton
