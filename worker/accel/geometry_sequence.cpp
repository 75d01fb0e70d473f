#include "worker/accel/geometry_sequence.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/trace.h"
#include "common/job/motion.h"

namespace baton {

std::size_t FrameGeometry::size_bytes() const {
  std::size_t size = 0;
  for (const auto& shape : pose.shapes) size += shape == nullptr ? 0 : shape->size_bytes();
  return size > 0 ? size + accel->placement_bytes() : 0;
}

Result<std::shared_ptr<const FrameGeometry>> GeometrySequence::at(Step step) {
  // A job in which nothing moves has one frame for all.
  const FrameIndex name = moves(job_) ? timeline_.frame_of(step) : FrameIndex(0);
  if (auto found = frames_.find(name)) return found;  // while another frame is built
  const std::string what = fmt::format("geometry of frame {}", job_.frames[name.index()]);
  const std::unique_lock lock = lock_traced(placing_, what);
  if (auto found = frames_.find(name)) return found;
  const Span span(SpanKind::make, what);

  // The placed ray tracer refers to the instances beside it.
  auto frame = std::make_shared<FrameGeometry>();
  frame->pose = pose_at(scene_, job_, job_.frames[name.index()].value());
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
