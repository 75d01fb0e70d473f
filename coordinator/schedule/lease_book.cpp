#include "coordinator/schedule/lease_book.h"

#include <algorithm>
#include <iterator>

#include "common/base/check.h"
#include "common/base/limits.h"

namespace baton {

bool LeaseBook::join(const std::string& worker, TimePoint now, const std::string& renderer) {
  const auto [place, is_new] = workers_.try_emplace(worker);
  place->second.last_sign = now;
  place->second.renderer = renderer;
  alike_.clear();
  want(worker, 0);
  if (is_new) connected_.insert(std::ranges::upper_bound(connected_, worker), worker);
  return is_new;
}

bool LeaseBook::renders_as(const std::string& worker, const std::string& renderer) const {
  const auto found = workers_.find(worker);
  return renderer.empty() || found == workers_.end() || found->second.renderer.empty() ||
         found->second.renderer == renderer;
}

const std::vector<std::string>& LeaseBook::alike(const std::string& renderer) const {
  const auto [place, is_new] = alike_.try_emplace(renderer);
  if (is_new) {
    std::ranges::copy_if(connected_, std::back_inserter(place->second),
                         [&](const std::string& worker) { return renders_as(worker, renderer); });
  }
  return place->second;
}

const std::string& LeaseBook::renderer_of(const std::string& worker) const {
  return workers_.at(worker).renderer;
}

bool LeaseBook::nobody_renders_as(const std::string& renderer) const {
  return !connected_.empty() && alike(renderer).empty();
}

bool LeaseBook::touch(const std::string& worker, TimePoint now) {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) return false;
  found->second.last_sign = now;
  return true;
}

void LeaseBook::leave(const std::string& worker) {
  BATON_CHECK(of_worker(worker).empty());
  std::erase(hungry_, worker);
  std::erase(connected_, worker);
  workers_.erase(worker);
  alike_.clear();
}

std::vector<std::string> LeaseBook::silent_at(TimePoint now, std::chrono::milliseconds limit) {
  const auto most = std::chrono::steady_clock::duration(limit) / 4;
  const auto pause = now - asked_for_silent_.value_or(now);
  asked_for_silent_ = now;
  std::vector<std::string> silent;
  for (auto& [id, worker] : workers_) {
    if (pause > most) worker.last_sign = std::min(now, worker.last_sign + (pause - most));
    if (worker.last_sign < now - limit) silent.push_back(id);
  }
  return silent;
}

void LeaseBook::want(const std::string& worker, std::int32_t count) {
  std::int32_t& wanted = workers_.at(worker).wanted;
  const bool was_hungry = wanted > 0;
  wanted = std::clamp(count, 0, limits::kMaxLeasesPerWorker);
  if (wanted > 0 && !was_hungry) hungry_.push_back(worker);
  if (wanted == 0 && was_hungry) std::erase(hungry_, worker);
}

bool LeaseBook::wants(const std::string& worker) const {
  const auto found = workers_.find(worker);
  return found != workers_.end() && found->second.wanted > 0;
}

void LeaseBook::serve(const std::function<bool(const std::string& worker)>& grant) {
  std::deque<std::string> unserved;
  while (!hungry_.empty()) {
    const std::string worker = std::move(hungry_.front());
    hungry_.pop_front();
    if (!grant(worker)) {
      unserved.push_back(worker);
    } else if (--workers_.at(worker).wanted > 0) {
      hungry_.push_back(worker);
    }
  }
  hungry_ = std::move(unserved);
}

Lease& LeaseBook::add(TaskIndex task, Lease lease) {
  const Place place{lease.id.job, task};
  expected_bytes_ += lease.expected_bytes;
  workers_.at(lease.worker).leases.insert(place);
  const auto [added, is_new] = leases_.try_emplace(place, std::move(lease));
  BATON_CHECK(is_new);
  return added->second;
}

Lease LeaseBook::drop(const Place& place) {
  const auto lease = leases_.extract(place);
  BATON_CHECK(!lease.empty());
  expected_bytes_ -= lease.mapped().expected_bytes;
  workers_.at(lease.mapped().worker).leases.erase(place);
  return lease.mapped();
}

Lease* LeaseBook::find(const Place& place) {
  const auto found = leases_.find(place);
  return found == leases_.end() ? nullptr : &found->second;
}

std::set<LeaseBook::Place> LeaseBook::of_worker(const std::string& worker) const {
  const auto found = workers_.find(worker);
  return found == workers_.end() ? std::set<Place>() : found->second.leases;
}

std::vector<TaskIndex> LeaseBook::of_job(const Digest& job) const {
  std::vector<TaskIndex> tasks;
  for (auto lease = leases_.lower_bound({job, 0}); lease != leases_.end(); ++lease) {
    if (lease->first.first != job) break;
    tasks.push_back(lease->first.second);
  }
  return tasks;
}

const Lease* LeaseBook::any_of(const Digest& job) const {
  const auto lease = leases_.lower_bound({job, 0});
  return lease != leases_.end() && lease->first.first == job ? &lease->second : nullptr;
}

}  // namespace baton
