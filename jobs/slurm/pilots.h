#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace baton {

/// How many pilots a farm should have, and what is to be done about it. A pilot is a baton-worker
/// in an allocation of Slurm. All here is pure: snapshots in, orders out.

enum class SlurmState {
  waiting,  ///< will begin
  /// Was put back into the queue, which lets it wait for minutes.
  resting,
  running,  ///< its program is at work, or should be
  /// Stands still until somebody lets it go on.
  suspended,
  ending,
};

/// A pilot that Slurm has.
struct SlurmPilot {
  /// "17_3": array and task, as scancel takes it.
  std::string id;
  SlurmState state = SlurmState::waiting;
  /// How long it has been running without a worker of its name.
  double alone_s = 0;
  /// For people: Slurm's own word and its reason, its name there, the node, what is left of the
  /// time.
  std::string state_text = {}, reason = {}, job_name = {}, node = {}, time_left = {};

  bool operator==(const SlurmPilot&) const = default;
};

/// A worker of a pilot that the coordinator has, connected or not yet missed.
struct SlurmWorker {
  std::string id;    ///< names its pilot
  std::string name;  ///< by which it goes at the coordinator
  int leases = 0;
  bool told_to_end = false;
};

struct SlurmSnapshot {
  std::vector<SlurmPilot> pilots;
  std::vector<SlurmWorker> workers;
  std::uint64_t tasks = 0;    ///< tasks that could be in work at once
  int threads_per_pilot = 1;  ///< at least 1
  int least = 1, most = 1;
};

struct SlurmOrders {
  int submit = 0;
  std::vector<std::string> cancel;  ///< pilots
  std::vector<std::string> drain;   ///< workers

  bool operator==(const SlurmOrders&) const = default;
};

/// A pilot whose worker the coordinator has not seen for longer is counted out.
inline constexpr double kMostAlone_s = 45;

/// How many pilots the work is enough for, within the limits.
int wanted_pilots(const SlurmSnapshot& now);

/// Whom the coordinator sees is there, whatever Slurm says: a controller that was killed may have
/// forgotten it. Of the others counts who waits or has just begun. A pilot that rests or is alone
/// for long is given up; a suspended one is replaced and left to whoever suspended it. When there
/// are too many, those that wait go first, then those with the fewest leases are drained. A pilot
/// counts once: when Slurm has started it again, the coordinator still has its dead worker, too.
SlurmOrders give_orders(const SlurmSnapshot& now);

/// Counts arrays in a row whose pilots have all gone without ever having worked: they cannot, and
/// others would not either. One alone may be an array that a controller has forgotten.
class VainArrays {
 public:
  void submitted(const std::string& array) { open_ = array; }
  /// What a snapshot has found. True: one more has been in vain.
  bool observe(const SlurmSnapshot& now);
  /// Pilots of it that are cancelled as there are too many do not count.
  void cancelled(const std::vector<std::string>& pilots);
  int count() const { return count_; }
  const std::string& last() const { return last_; }  ///< in vain

 private:
  /// A submission of whose pilots nothing has been seen; empty: none.
  std::string open_;
  std::string last_;
  int count_ = 0;
};

}  // namespace baton
