#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "common/base/bytes.h"

namespace baton {

/// All frames of the next message that has come; empty: there is none.
std::vector<std::string> receive_frames(zmq::socket_t& socket);

/// Hears what becomes of a socket's connections. Must be gone before the socket.
///
/// The library hands a message over when its last frame has come. Until then it keeps the frames,
/// of which it limits the size but not the number, so a connection that never ends a message would
/// grow the process without bound; a listening socket closes it, where it came over TCP.
class ConnectionWatch {
 public:
  /// broken_off: by the other side, without a word, during the handshake: one has a key that the
  /// other cannot read, or only one has any. replayed: a message came again, or out of turn.
  /// denied: the key is not known. crowd: see close_unwelcome(). endless: see above.
  enum class Failure { broken_off, replayed, denied, crowd, endless };
  struct Hears {
    bool handshakes;   ///< failed handshakes
    bool connections;  ///< that were made
  };

  ConnectionWatch(zmq::context_t& context, zmq::socket_t& watched, Hears what);
  ConnectionWatch(const ConnectionWatch&) = delete;
  ConnectionWatch& operator=(const ConnectionWatch&) = delete;
  ~ConnectionWatch();

  /// A connection to the other side stood at some time; its program need not have taken it.
  bool was_connected() const { return was_connected_; }
  /// To be polled: something has happened.
  zmq::socket_t& events() { return events_; }
  /// Takes what has happened; true: a handshake failed.
  bool poll();
  /// A whole message of a peer has come; frame: any of it but the first, which the library adds.
  void note_message(const zmq::message_t& frame, const Bytes& peer);
  /// Whether a message of this size may be queued for the peer: not if it has not read what waits
  /// for it, and that would be more than limits::kMaxUnreadBytes with this one, or with what waits
  /// for others kMaxUnreadBytesInAll. Counts it.
  bool take_place(const Bytes& peer, std::uint64_t size_bytes);
  /// Closes the connections from which more than limits::kMaxUnendedBytes have come since their
  /// last whole message; and, of one address, all but limits::kMaxSilentConnections that have said
  /// nothing for limits::kSilenceAllowed since they were made. To be called from time to time, when
  /// what has come was taken.
  void close_unwelcome();
  /// What failed, the worst of it, since the last take().
  std::optional<Failure> failure() const { return failure_; }
  std::optional<Failure> take() { return std::exchange(failure_, std::nullopt); }

 private:
  struct Connection {
    std::chrono::steady_clock::time_point made = {};
    std::string address = {};  ///< of its other end
    /// As the library calls it; empty: it has not spoken.
    Bytes peer = {};
    /// Bytes received when the last whole message was noticed.
    std::uint64_t bytes = 0;
    /// Queued for it, and perhaps not read.
    std::uint64_t unread = 0;
    /// A whole message has come since the last close_unwelcome(); or ever.
    bool has_spoken = false, is_known = false;
  };
  using Connections = std::map<int, Connection>;  ///< by file descriptor

  void note(Failure failure);
  void close(int descriptor, Failure failure);
  Connections::iterator forget(Connections::iterator connection);
  void count_unread();

  zmq::socket_t& watched_;
  zmq::socket_t events_;
  Connections connections_;
  std::uint64_t unread_in_all_ = 0;
  std::map<Bytes, int> peers_;  ///< their connections
  std::optional<Failure> failure_;
  bool was_connected_ = false;
};

}  // namespace baton
