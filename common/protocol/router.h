#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "common/protocol/messages.h"
#include "common/protocol/socket.h"

namespace baton {

/// Names a connection, chosen by the library; a peer that connects again has another one.
using PeerId = Bytes;

/// What a peer sent, or why it cannot be read.
struct Incoming {
  PeerId peer;
  Result<Message> message;
};

/// The coordinator's side of every connection. Used by one thread, except wake().
class Router {
 public:
  /// "tcp://host:*" picks a port. Errors: malformed endpoint, address in use or not of this
  /// machine.
  static Result<Router> bind(const std::string& endpoint);

  /// Queues without waiting; false when the peer is gone or its queue is full.
  bool send(const PeerId& peer, const Message& message);
  /// The next message of any peer, or nullopt after `timeout`, a signal or wake().
  std::optional<Incoming> receive(std::chrono::milliseconds timeout);
  /// Ends a receive() early, from any thread.
  void wake() { socket_.wake(); }
  /// The concrete endpoint: with the port that was picked.
  const std::string& endpoint() const { return socket_.endpoint(); }

 private:
  explicit Router(Socket socket) : socket_(std::move(socket)) {}

  Socket socket_;
};

}  // namespace baton
