#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/schedule/events.h"
#include "coordinator/schedule/job_graph.h"

namespace baton {

/// A task that somebody works on.
struct Lease {
  LeaseId id;
  std::string worker;
  TimePoint granted_at;
  std::uint64_t expected_bytes = 0;  ///< that its outputs will take in the store
  /// Its state; false where the lease was taken up again.
  bool may_hold = false;
  /// Blobs of earlier attempts without a result: who works on the task may count on them.
  std::vector<Digest> left = {};
};

/// Who is connected, who has which lease, and who wants more. It decides nothing.
class LeaseBook {
 public:
  /// A task of a job.
  using Place = std::pair<Digest, TaskIndex>;

  /// The worker is there and wants nothing. True: it was not there before. renderer: see
  /// WorkerJoined.
  bool join(const std::string& worker, TimePoint now, const std::string& renderer = {});
  /// Whether what the worker makes goes with what `renderer` made; so does what nobody knows.
  bool renders_as(const std::string& worker, const std::string& renderer) const;
  /// The renderer of a worker, which is known.
  const std::string& renderer_of(const std::string& worker) const;
  /// Whether somebody is connected, and nobody renders as `renderer`.
  bool nobody_renders_as(const std::string& renderer) const;
  /// Notes a sign of life. False: the worker is not known.
  bool touch(const std::string& worker, TimePoint now);
  /// How long a worker, which is known, has said nothing.
  std::chrono::duration<double> silence_of(const std::string& worker, TimePoint now) const {
    return now - workers_.at(worker).last_sign;
  }
  /// Forgets a worker, which has no leases.
  void leave(const std::string& worker);
  bool knows(const std::string& worker) const { return workers_.contains(worker); }
  /// Names of all workers, sorted.
  const std::vector<std::string>& connected() const { return connected_; }
  /// Names of those that render as `renderer`, sorted. Valid until one comes or goes.
  const std::vector<std::string>& alike(const std::string& renderer) const;
  /// Workers without a sign of life for longer than `limit`, to be asked for from time to time. Who
  /// asks late has stood still and heard nobody: a pause counts as a quarter of the limit at most.
  std::vector<std::string> silent_at(TimePoint now, std::chrono::milliseconds limit);

  /// The worker wants so many leases more, whatever it wanted before.
  void want(const std::string& worker, std::int32_t count);
  bool wants(const std::string& worker) const;
  /// Who wants leases: who asked first comes first.
  const std::deque<std::string>& hungry() const { return hungry_; }
  /// Offers a lease to each that wants some, one in turn, until `grant` has refused all of them.
  void serve(const std::function<bool(const std::string& worker)>& grant);

  /// The task must not be leased, the worker be known. Valid until the lease is dropped.
  Lease& add(TaskIndex task, Lease lease);
  /// Ends the lease, which must be there.
  Lease drop(const Place& place);
  /// nullptr: nobody has the task.
  Lease* find(const Place& place);
  const Lease& at(const Place& place) const { return leases_.at(place); }
  /// A worker that is not known has none.
  std::set<Place> of_worker(const std::string& worker) const;
  std::vector<TaskIndex> of_job(const Digest& job) const;
  /// One of them; nullptr: there is none.
  const Lease* any_of(const Digest& job) const;
  const std::map<Place, Lease>& all() const { return leases_; }
  bool empty() const { return leases_.empty(); }
  /// What the outputs of all leases will take.
  std::uint64_t expected_bytes() const { return expected_bytes_; }

 private:
  struct Worker {
    TimePoint last_sign;
    std::string renderer;
    std::int32_t wanted = 0;
    std::set<Place> leases;
  };
  std::map<Place, Lease> leases_;
  std::map<std::string, Worker> workers_;
  std::vector<std::string> connected_;  ///< names of workers_, sorted
  /// By renderer, as far as somebody asked since a worker came or went.
  mutable std::map<std::string, std::vector<std::string>> alike_;
  std::optional<TimePoint> asked_for_silent_;
  std::deque<std::string> hungry_;  ///< workers with wanted > 0
  std::uint64_t expected_bytes_ = 0;
};

}  // namespace baton
