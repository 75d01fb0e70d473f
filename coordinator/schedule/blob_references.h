#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/job/task.h"

namespace baton {

/// Counts who still needs each blob of the store. Equal blobs of different tasks are one blob,
/// needed twice.
class BlobReferences {
 public:
  /// One need more, of a blob that is there, or is held.
  void add(const BlobRef& blob);
  /// One need more, of one that is to be made again.
  void expect(const Digest& blob);
  /// One need less. The last one makes the blob garbage.
  void release(const Digest& blob);
  /// A blob that nobody needs: garbage at once, unless another task's equal blob is needed.
  void discard(const Digest& blob) { garbage_.push_back(blob); }
  bool contains(const Digest& blob) const { return needs_.contains(blob); }
  /// Whether it is needed and not only expected.
  bool is_there(const Digest& blob) const;
  /// What the blobs that are there take, each counted once; held ones take nothing.
  std::uint64_t size_bytes() const { return size_bytes_; }

  /// The blobs that became garbage since the last call and are not needed again.
  std::vector<Digest> take_garbage();

 private:
  struct Hash {
    std::size_t operator()(const Digest& digest) const { return digest.low; }
  };
  struct Need {
    std::uint64_t size_bytes = 0;
    std::uint32_t count = 0;
    bool is_there = false;
  };

  std::unordered_map<Digest, Need, Hash> needs_;
  std::uint64_t size_bytes_ = 0;
  std::vector<Digest> garbage_;
};

}  // namespace baton
