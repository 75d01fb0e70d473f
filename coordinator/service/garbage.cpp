#include "coordinator/service/garbage.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

namespace baton {
namespace {

constexpr std::size_t kMaxRemoved = 1 << 16;
/// More is forgotten, and found when the store is searched for leftovers.
constexpr std::size_t kMaxWaiting = 1 << 20;
constexpr std::chrono::milliseconds kSlice{50};

}  // namespace

Status Garbage::remove_some(BlobStore& store,
                            const std::function<Result<bool>(const Digest&)>& is_needed) {
  using Clock = std::chrono::steady_clock;
  waiting_.resize(std::min(waiting_.size(), kMaxWaiting));
  const Clock::time_point end = Clock::now() + kSlice;
  while (!waiting_.empty() && Clock::now() < end) {
    const Digest blob = waiting_.back();
    waiting_.pop_back();
    BATON_ASSIGN(const bool stays, is_needed(blob));
    const Status removed = stays ? Status() : store.remove(blob);
    if (!removed) {
      if (unremoved_.empty()) spdlog::warn("{}; tried again", removed.error().message);
      unremoved_.insert(blob);
      continue;
    }
    unremoved_.erase(blob);
    if (stays) continue;
    if (removed_.size() >= kMaxRemoved) removed_.clear();
    removed_.insert(blob);
  }
  return {};
}

}  // namespace baton
