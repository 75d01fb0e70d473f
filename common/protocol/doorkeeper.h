#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <zmq.hpp>

#include "common/protocol/keys.h"

namespace baton {

/// Answers ZeroMQ's question whether a key may connect (ZAP, RFC 27), for all listening sockets of
/// a context. A message then carries the public key of its sender as "User-Id". Used by the thread
/// of the socket: a handshake waits for its next answer().
class Doorkeeper {
 public:
  Doorkeeper(zmq::context_t& context, std::map<std::string, Speaker> known);

  /// To be polled: there are questions.
  zmq::socket_t& questions() { return questions_; }
  void answer();
  /// Who was refused last, since the last call.
  std::optional<std::string> take_refusal() { return std::exchange(refusal_, std::nullopt); }

 private:
  std::map<std::string, Speaker> known_;  ///< by their public keys
  zmq::socket_t questions_;
  std::optional<std::string> refusal_;
};

/// Hears which handshakes of a socket fail. Must be gone before the socket.
class HandshakeWatch {
 public:
  /// broken_off: by the other side, without a word: one has a key that the other cannot read, or
  /// only one has any. replayed: a message came again, or out of turn. denied: the key is not
  /// known.
  enum class Failure { broken_off, replayed, denied };

  HandshakeWatch(zmq::context_t& context, zmq::socket_t& watched);
  HandshakeWatch(const HandshakeWatch&) = delete;
  HandshakeWatch& operator=(const HandshakeWatch&) = delete;
  ~HandshakeWatch();

  /// To be polled: something has failed.
  zmq::socket_t& events() { return events_; }
  /// Takes what has come.
  void look();
  /// What failed, the worst of it, since the last take().
  std::optional<Failure> failure() const { return failure_; }
  std::optional<Failure> take() { return std::exchange(failure_, std::nullopt); }

 private:
  zmq::socket_t& watched_;
  zmq::socket_t events_;
  std::optional<Failure> failure_;
};

}  // namespace baton
