#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "common/base/file_stamp.h"
#include "common/protocol/messages.h"
#include "common/protocol/socket.h"

namespace baton {

/// Names a connection, chosen by the library; a peer that connects again has another one.
using PeerId = Bytes;

/// What a peer sent, or why it cannot be read, and who the peer is.
struct Incoming {
  PeerId peer;
  Result<Message> message;
  Speaker speaker = {};
};

/// The coordinator's side of every connection. Used by one thread, except wake().
class Router {
 public:
  /// "tcp://host:*" picks a port. Errors: malformed endpoint, address in use or not of this
  /// machine, or open to other machines without a key.
  static Result<Router> bind(const std::string& endpoint, const ServerAccess& access = {});

  /// Queues without waiting; false when the peer is gone or its queue is full.
  bool send(const PeerId& peer, const Message& message);
  /// The next message of any peer, or nullopt after `timeout`, a signal or wake().
  std::optional<Incoming> receive(std::chrono::milliseconds timeout);
  /// Looks whether the file of the keys has changed: whoever it knows now is let in, of others
  /// nothing is taken any more. Returns what is to be said of that. Errors: it cannot be read, or
  /// has another key for the coordinator itself; then all stays as it was.
  Result<std::optional<std::string>> read_keys_again();
  /// What became of a connection that was refused, since the last call.
  std::optional<Error> take_refusal() { return socket_.take_refusal(); }
  /// Ends a receive() early, from any thread.
  void wake() { socket_.wake(); }
  /// The concrete endpoint: with the port that was picked.
  const std::string& endpoint() const { return socket_.endpoint(); }

 private:
  Router(Socket socket, ServerAccess access)
      : socket_(std::move(socket)), access_(std::move(access)) {}

  Socket socket_;
  ServerAccess access_;
  std::optional<FileStamp> key_stamp_;  ///< of access_.key_file, as it was last read
};

}  // namespace baton
