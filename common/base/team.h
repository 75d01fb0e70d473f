#pragma once

#include <condition_variable>
#include <cstddef>
#include <functional>
#include <mutex>
#include <string>

namespace baton {

/// Does part(0) ... part(parts - 1), each once, on any thread and in any order; returns when all
/// are done. What they make must not depend on either.
using DoParts =
    std::function<void(std::size_t parts, const std::function<void(std::size_t)>& part)>;

/// One after the other.
inline void do_in_turn(std::size_t parts, const std::function<void(std::size_t)>& part) {
  for (std::size_t i = 0; i < parts; ++i) part(i);
}

/// Has a thread that has nothing to do begin something at once; false: there is none, and nobody
/// does it.
using Lend = std::function<bool(std::function<void()> work)>;
inline bool lend_nobody(const std::function<void()>&) { return false; }

/// Does parts (DoParts) on the calling thread, with whoever has nothing to do meanwhile. Traces
/// have the whole and its parts under the name `what`.
void share_parts(const Lend& lend, const std::string& what, std::size_t parts,
                 const std::function<void(std::size_t)>& part);

/// A mutex whose waiters help: what one thread makes while others wait for it is made in parts by
/// all of them. Traces have the parts under the name of the whole.
class Team {
 public:
  /// The right to make something; others wait for its end, and help.
  class Turn {
   public:
    /// Waits until nobody has the turn. what: in traces.
    Turn(Team& team, std::string what);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

    /// Does parts, with whoever waits for the turn.
    void share(std::size_t parts, const std::function<void(std::size_t)>& part);

   private:
    Team& team_;
  };

 private:
  /// Does parts as long as there are some that nobody has begun; locked before and after.
  void help(std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable changed_;  ///< parts, or the turn
  bool is_taken_ = false;
  std::string what_;                                        ///< that is made
  const std::function<void(std::size_t)>* part_ = nullptr;  ///< null: nothing is shared
  std::size_t count_ = 0, next_ = 0, done_ = 0;
};

}  // namespace baton
