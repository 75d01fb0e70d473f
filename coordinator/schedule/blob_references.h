#pragma once

#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/base/digest.h"

namespace baton {

/// Counts who still needs each blob of the store. Equal blobs of different tasks are one blob,
/// needed twice.
class BlobReferences {
 public:
  /// One need more, of a blob that is there.
  void add(const Digest& blob);
  /// One need more, of one that is to be made again.
  void expect(const Digest& blob);
  /// One need less. The last one makes the blob garbage.
  void release(const Digest& blob);
  /// A blob that nobody needs: garbage at once, unless another task's equal blob is needed.
  void discard(const Digest& blob) { garbage_.push_back(blob); }
  bool contains(const Digest& blob) const { return counts_.contains(blob); }
  /// Whether it is needed and not only expected.
  bool is_there(const Digest& blob) const { return contains(blob) && !expected_.contains(blob); }

  /// The blobs that became garbage since the last call and are not needed again.
  std::vector<Digest> take_garbage();

 private:
  struct Hash {
    std::size_t operator()(const Digest& digest) const { return digest.low; }
  };

  std::unordered_map<Digest, std::uint32_t, Hash> counts_;
  std::unordered_set<Digest, Hash> expected_;
  std::vector<Digest> garbage_;
};

}  // namespace baton
