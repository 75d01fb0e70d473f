#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/base/digest.h"

namespace baton {

/// Counts who still needs each blob of the store. Equal blobs of different tasks are one blob,
/// needed twice.
class BlobReferences {
 public:
  void add(const Digest& blob) { ++counts_[blob]; }
  /// One need less. The last one makes the blob garbage.
  void release(const Digest& blob);
  /// A blob that nobody needs: garbage at once, unless another task's equal blob is needed.
  void discard(const Digest& blob) { garbage_.push_back(blob); }
  bool contains(const Digest& blob) const { return counts_.contains(blob); }

  /// The blobs that became garbage since the last call and are not needed again.
  std::vector<Digest> take_garbage();

 private:
  struct Hash {
    std::size_t operator()(const Digest& digest) const { return digest.low; }
  };

  std::unordered_map<Digest, std::uint32_t, Hash> counts_;
  std::vector<Digest> garbage_;
};

}  // namespace baton
