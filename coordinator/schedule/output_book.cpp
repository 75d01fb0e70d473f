#include "coordinator/schedule/output_book.h"

#include <utility>

#include "common/base/limits.h"

namespace baton {

const std::vector<BlobRef>& OutputBook::former_outputs(TaskIndex task) const {
  static const std::vector<BlobRef> kNone;
  const auto found = former_.find(task);
  return found == former_.end() ? kNone : found->second.outputs;
}

bool OutputBook::is_counted(TaskIndex task) const {
  const auto found = former_.find(task);
  return found != former_.end() && found->second.is_counted;
}

void OutputBook::remember(TaskIndex task, std::vector<BlobRef> outputs) {
  former_.try_emplace(task, Former{std::move(outputs), /*is_counted=*/false});
}

bool OutputBook::tells_makers() const { return makers_.size() <= limits::kMaxWorkers; }

const BlobRef* OutputBook::held_state(TaskIndex task) const {
  const std::vector<BlobRef>& made = outputs(task);
  return !made.empty() && made.front().is_held() ? &made.front() : nullptr;
}

/// made: whether it is there now, or there no longer. (Unsigned sums wrap to what they were.)
void OutputBook::count(const JobGraph& graph, const BlobRef& output, bool made) {
  const std::uint64_t sign = made ? 1 : ~std::uint64_t{0};
  if (output.kind == BlobKind::image) totals_.frames += made ? 1u : ~0u;
  if (output.kind == BlobKind::state) {
    totals_.state_bytes += sign * output.size_bytes;
    if (!output.is_held()) totals_.state_pixels += sign * graph.num_pixels(output.tile);
  }
  if (output.is_held()) totals_.num_held += made ? 1u : ~std::size_t{0};
}

void OutputBook::enter(const JobGraph& graph, TaskIndex task, std::vector<BlobRef> outputs) {
  for (const BlobRef& output : outputs) count(graph, output, true);
  record(task).outputs = std::move(outputs);
}

void OutputBook::set_maker(TaskIndex task, const std::string& worker) {
  const auto next = static_cast<std::uint16_t>(makers_.size());
  const auto [maker, is_new] = tells_makers() ? maker_numbers_.try_emplace(worker, next)
                                              : std::pair{maker_numbers_.find(worker), false};
  if (is_new) makers_.push_back(worker);
  record(task).maker = maker != maker_numbers_.end() ? maker->second : std::uint16_t{0};
}

void OutputBook::publish_state(const JobGraph& graph, TaskIndex task, const BlobRef& published) {
  BlobRef& state = record(task).outputs.front();
  count(graph, state, false);
  state = published;
  count(graph, state, true);
}

void OutputBook::remove(const JobGraph& graph, TaskIndex task, bool remember) {
  std::vector<BlobRef> before = std::exchange(record(task).outputs, {});
  for (const BlobRef& output : before) count(graph, output, false);
  if (remember && !before.empty() && !before.front().is_any_image())
    former_[task] = {std::move(before)};
}

}  // namespace baton
