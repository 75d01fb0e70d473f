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

/// Parts that several threads take, one after the other.
class Parts {
 public:
  /// what: in traces. All outlive it.
  Parts(const std::string& what, std::size_t count, const std::function<void(std::size_t)>& part)
      : what_(what), count_(count), part_(part) {}
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  /// Does one that nobody has begun; false: there is none.
  bool do_one();
  /// Waits until there are no helpers; none may come any more.
  void wait();
  /// Somebody is about to call help() or remove_helper(). False: each was begun.
  bool add_helper();
  void remove_helper();
  /// Of a helper: does them until each was begun.
  void help();

 private:
  const std::string& what_;
  const std::size_t count_;
  const std::function<void(std::size_t)>& part_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t next_ = 0, num_helpers_ = 0;
};

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
  std::mutex mutex_;
  std::condition_variable changed_;  ///< parts, or the turn
  bool is_taken_ = false;
  std::string what_;        ///< that is made
  Parts* parts_ = nullptr;  ///< null: nothing is shared
};

}  // namespace baton
