#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/protocol/router.h"
#include "coordinator/service/turned_away.h"

namespace baton {

/// Which connection belongs to which worker. A worker that connects again takes its name along.
class Peers {
 public:
  /// Introduces or replaces a worker. bearer: the name of its key; empty: without one.
  void add(const PeerId& peer, const WorkerHello& hello, const std::string& bearer);
  /// Whether somebody with another key goes by this ID.
  bool is_of_another(const std::string& worker, const std::string& bearer) const;
  void remove(const std::string& worker);
  /// It may not come in now. Returns when it asked first.
  TimePoint turn_away(const WorkerHello& hello, const std::string& reason, TimePoint now) {
    return turned_away_.add(hello, reason, now);
  }
  const TurnedAway& turned_away() const { return turned_away_; }
  /// It was told to finish; that stays so when it connects again.
  void drain(const std::string& worker) { workers_.at(worker).is_draining = true; }
  /// What a worker, which is known, says of itself now.
  void note(const std::string& worker, const Heartbeat& beat);
  /// The ID by which a worker goes here: its name, or where another process has that, the name and
  /// some digits of its instance.
  std::string id_for(const WorkerHello& hello) const;

  /// Empty: the connection belongs to no worker.
  std::string worker_of(const PeerId& peer) const;
  /// nullopt: no such worker.
  std::optional<PeerId> peer_of(const std::string& worker) const;
  /// What it said of itself; null: no such worker.
  const WorkerHello* hello_of(const std::string& worker) const;
  std::size_t num_workers() const { return workers_.size(); }
  /// By name, without their tasks.
  std::vector<WorkerSummary> summaries() const;
  std::vector<PeerId> connections() const;
  /// A connected worker, where none renders as this one does; null: one does, or nobody is there.
  const WorkerHello* find_other_renderer(const WorkerHello& hello) const;

 private:
  struct Entry {
    PeerId peer;
    WorkerHello hello;
    std::string bearer;
    bool is_draining = false;
    std::uint64_t memory_bytes = 0;
  };
  std::map<std::string, Entry> workers_;
  std::map<PeerId, std::string> names_;
  TurnedAway turned_away_;
};

/// Remembers connections, so that each is told or complained about once. Bounded: forgets all when
/// it is full.
class OncePerPeer {
 public:
  /// True the first time.
  bool first(const PeerId& peer);
  void clear() { seen_.clear(); }

 private:
  std::set<PeerId> seen_;
};

}  // namespace baton
