#pragma once

#include <functional>
#include <set>
#include <vector>

#include "common/store/blob_store.h"

namespace baton {

/// Blobs that nobody may need any more. They are removed when what replaces them is durable, a few
/// at a time: a slow disk keeps nobody waiting.
class Garbage {
 public:
  void add(const std::vector<Digest>& blobs) {
    waiting_.insert(waiting_.end(), blobs.begin(), blobs.end());
  }
  /// What the disk would not let go is tried again.
  void retry() { waiting_.insert(waiting_.end(), unremoved_.begin(), unremoved_.end()); }
  bool empty() const { return waiting_.empty(); }
  /// Whether the blob was removed here, of late: it is not late, but equal to one that nobody
  /// needed.
  bool has_removed(const Digest& blob) const { return removed_.contains(blob); }
  /// Removes what there is time for. is_needed: asked of each when its turn comes; its errors end
  /// this. Faults of the disk are logged.
  Status remove_some(BlobStore& store, const std::function<Result<bool>(const Digest&)>& is_needed);

 private:
  std::vector<Digest> waiting_;
  std::set<Digest> unremoved_;
  /// Up to kMaxRemoved, then forgotten all at once.
  std::set<Digest> removed_;
};

}  // namespace baton
