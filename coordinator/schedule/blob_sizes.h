#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "coordinator/schedule/job_graph.h"

namespace baton {

/// What the blobs of a job take in the store: as those tell that are made, and as
/// `estimate_blob_bytes` says of kinds of which there is none yet.
class BlobSizes {
 public:
  explicit BlobSizes(const JobSpec& job);

  /// Held states tell nothing.
  void learn(const std::vector<BlobRef>& made);
  /// What the outputs of a task take at most, as far as those before it tell.
  std::uint64_t largest(const JobGraph& graph, const TaskKey& task) const;
  /// The same on average.
  std::uint64_t mean(const JobGraph& graph, const TaskKey& task) const;
  /// What a state takes on average, and a film.
  std::uint64_t mean_state() const { return mean(BlobKind::state); }
  std::uint64_t mean_film() const { return mean(BlobKind::film); }
  /// What the largest state takes.
  std::uint64_t largest_state() const { return of(BlobKind::state).largest; }
  /// Whether nothing in these sizes of the task's outputs is estimated.
  bool are_known(const JobGraph& graph, const TaskKey& task) const;

 private:
  struct Size {
    std::uint64_t largest = 0, sum = 0, count = 0;
    bool is_estimated = false;
  };
  static constexpr std::array kKinds{BlobKind::state, BlobKind::film, BlobKind::first_pass};
  std::uint64_t mean(BlobKind kind) const { return of(kind).sum / of(kind).count; }
  const Size& of(BlobKind kind) const { return sizes_.at(static_cast<std::size_t>(kind)); }

  std::array<Size, 4> sizes_;  ///< by kind
};

}  // namespace baton
