#include "coordinator/schedule/blob_references.h"

#include <utility>

#include "common/base/check.h"

namespace baton {

void BlobReferences::add(const BlobRef& blob) {
  Need& need = needs_[blob.digest];
  ++need.count;
  if (need.is_there) return;
  need.is_there = true;
  need.size_bytes = blob.size_bytes;
  size_bytes_ += blob.size_bytes;
}

void BlobReferences::expect(const Digest& blob) { ++needs_[blob].count; }

void BlobReferences::release(const Digest& blob) {
  const auto found = needs_.find(blob);
  BATON_CHECK(found != needs_.end());
  if (--found->second.count > 0) return;
  size_bytes_ -= found->second.size_bytes;
  needs_.erase(found);
  garbage_.push_back(blob);
}

bool BlobReferences::is_there(const Digest& blob) const {
  const auto found = needs_.find(blob);
  return found != needs_.end() && found->second.is_there;
}

std::vector<Digest> BlobReferences::take_garbage() {
  std::erase_if(garbage_, [this](const Digest& blob) { return contains(blob); });
  return std::exchange(garbage_, {});
}

}  // namespace baton
