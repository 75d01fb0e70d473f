#include "coordinator/schedule/blob_references.h"

#include <utility>

#include "common/base/check.h"

namespace baton {

void BlobReferences::add(const Digest& blob) {
  ++counts_[blob];
  expected_.erase(blob);
}

void BlobReferences::expect(const Digest& blob) {
  if (++counts_[blob] == 1) expected_.insert(blob);
}

void BlobReferences::release(const Digest& blob) {
  const auto found = counts_.find(blob);
  BATON_CHECK(found != counts_.end());
  if (--found->second > 0) return;
  counts_.erase(found);
  expected_.erase(blob);
  garbage_.push_back(blob);
}

std::vector<Digest> BlobReferences::take_garbage() {
  std::erase_if(garbage_, [this](const Digest& blob) { return contains(blob); });
  return std::exchange(garbage_, {});
}

}  // namespace baton
