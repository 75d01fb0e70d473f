#include "coordinator/service/peers.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/limits.h"

namespace baton {

void Peers::add(const PeerId& peer, const WorkerHello& hello, const std::string& bearer) {
  const auto before = workers_.find(hello.worker_id);
  const bool drains = before != workers_.end() && before->second.is_draining &&
                      before->second.hello.instance == hello.instance;
  remove(worker_of(peer));
  remove(hello.worker_id);
  workers_[hello.worker_id] = {peer, hello, bearer, drains, 0};
  names_[peer] = hello.worker_id;
  turned_away_.remove(hello);
}

void Peers::note(const std::string& worker, const Heartbeat& beat) {
  Entry& entry = workers_.at(worker);
  entry.is_draining |= beat.is_draining;
  entry.memory_bytes = beat.memory_bytes;
}

void Peers::remove(const std::string& worker) {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) return;
  names_.erase(found->second.peer);
  workers_.erase(found);
}

std::string Peers::id_for(const WorkerHello& hello) const {
  const auto other = workers_.find(hello.worker_id);
  if (other == workers_.end() || other->second.hello.instance == hello.instance)
    return hello.worker_id;
  return hello.own_name();
}

bool Peers::is_of_another(const std::string& worker, const std::string& bearer) const {
  const auto known = workers_.find(worker);
  return known != workers_.end() && known->second.bearer != bearer;
}

std::string Peers::worker_of(const PeerId& peer) const {
  const auto found = names_.find(peer);
  return found == names_.end() ? std::string() : found->second;
}

std::optional<PeerId> Peers::peer_of(const std::string& worker) const {
  const auto found = workers_.find(worker);
  if (found == workers_.end()) return std::nullopt;
  return found->second.peer;
}

const WorkerHello* Peers::hello_of(const std::string& worker) const {
  const auto found = workers_.find(worker);
  return found == workers_.end() ? nullptr : &found->second.hello;
}

std::vector<WorkerSummary> Peers::summaries() const {
  std::vector<WorkerSummary> result;
  for (const auto& [name, entry] : workers_) {
    result.push_back({.worker_id = name,
                      .host = entry.hello.host,
                      .pid = entry.hello.pid,
                      .num_threads = entry.hello.num_threads,
                      .is_draining = entry.is_draining,
                      .memory_bytes = entry.memory_bytes,
                      .build = entry.hello.build,
                      .renderer = entry.hello.renderer});
  }
  return result;
}

std::vector<PeerId> Peers::connections() const {
  std::vector<PeerId> result;
  for (const auto& [name, entry] : workers_) result.push_back(entry.peer);
  return result;
}

const WorkerHello* Peers::find_other_renderer(const WorkerHello& hello) const {
  const auto renders_alike = [&](const auto& worker) {
    return worker.second.hello.renderer == hello.renderer;
  };
  if (workers_.empty() || std::ranges::any_of(workers_, renders_alike)) return nullptr;
  return &workers_.begin()->second.hello;
}

bool OncePerPeer::first(const PeerId& peer) {
  if (seen_.size() >= limits::kMaxWorkers) seen_.clear();
  return seen_.insert(peer).second;
}

}  // namespace baton
