#include "coordinator/schedule/blob_sizes.h"

#include <algorithm>

#include "common/job/plan/store_estimate.h"

namespace baton {

BlobSizes::BlobSizes(const JobSpec& job) {
  for (const BlobKind kind : kKinds) {
    const auto bytes = static_cast<std::uint64_t>(estimate_blob_bytes(job, kind));
    sizes_.at(static_cast<std::size_t>(kind)) = {bytes, bytes, 1, true};
  }
}

void BlobSizes::learn(const std::vector<BlobRef>& made) {
  for (const BlobRef& blob : made) {
    if (blob.kind == BlobKind::image || blob.is_held()) continue;
    Size& size = sizes_.at(static_cast<std::size_t>(blob.kind));
    if (size.is_estimated) size = {0, 0, 0, false};
    size.largest = std::max(size.largest, blob.size_bytes);
    size.sum += blob.size_bytes;
    ++size.count;
  }
}

std::uint64_t BlobSizes::largest(const JobGraph& graph, const TaskKey& task) const {
  std::uint64_t bytes = 0;
  for (const BlobKind kind : kKinds)
    bytes += static_cast<std::uint64_t>(graph.num_outputs(task, kind)) * of(kind).largest;
  return bytes;
}

std::uint64_t BlobSizes::mean(const JobGraph& graph, const TaskKey& task) const {
  std::uint64_t bytes = 0;
  for (const BlobKind kind : kKinds)
    bytes +=
        static_cast<std::uint64_t>(graph.num_outputs(task, kind)) * of(kind).sum / of(kind).count;
  return bytes;
}

bool BlobSizes::are_known(const JobGraph& graph, const TaskKey& task) const {
  return std::none_of(kKinds.begin(), kKinds.end(), [&](BlobKind kind) {
    return graph.num_outputs(task, kind) > 0 && of(kind).is_estimated;
  });
}

}  // namespace baton
