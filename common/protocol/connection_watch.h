#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>
#include <zmq.hpp>

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
  /// denied: the key is not known. endless: see above.
  enum class Failure { broken_off, replayed, denied, endless };
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
  /// A whole message has come; any frame of it but the first, which the library adds.
  void note_message(const zmq::message_t& frame);
  /// Closes the connections from which more than limits::kMaxUnendedBytes have come since their
  /// last whole message. To be called from time to time, when what has come was taken.
  void close_endless();
  /// What failed, the worst of it, since the last take().
  std::optional<Failure> failure() const { return failure_; }
  std::optional<Failure> take() { return std::exchange(failure_, std::nullopt); }

 private:
  struct Connection {
    /// Bytes received when the last whole message was noticed.
    std::uint64_t bytes = 0;
    /// A whole message has come since the last close_endless().
    bool has_spoken = false;
  };
  void note(Failure failure);

  zmq::socket_t& watched_;
  zmq::socket_t events_;
  std::map<int, Connection> connections_;  ///< by file descriptor
  std::optional<Failure> failure_;
  bool was_connected_ = false;
};

}  // namespace baton
