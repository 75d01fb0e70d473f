#include "coordinator/schedule/standings.h"

namespace baton {

void Standings::add_failure(const std::string& worker, std::int32_t max_failures, TimePoint now) {
  Failed& failed = failed_[worker];
  if (++failed.failures >= max_failures) failed = {0, now + kWorkerRest};
}

void Standings::add_blind(const std::string& worker, const std::string& unseen, TimePoint now) {
  blind_[worker] = {unseen, now + kBlindRest};
}

void Standings::forget(const std::string& worker) {
  failed_.erase(worker);
  blind_.erase(worker);
}

bool Standings::has_failed_much(const std::string& worker, TimePoint now) const {
  const auto found = failed_.find(worker);
  return found != failed_.end() && now < found->second.rests_until;
}

std::string Standings::unseen_by(const std::string& worker) const {
  const auto found = blind_.find(worker);
  return found == blind_.end() ? std::string() : found->second.unseen;
}

bool Standings::is_blind(const std::string& worker, TimePoint now) const {
  const auto found = blind_.find(worker);
  return found != blind_.end() && now < found->second.until;
}

}  // namespace baton
