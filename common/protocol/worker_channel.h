#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "common/protocol/messages.h"
#include "common/protocol/socket.h"

namespace baton {

/// A worker's line to its coordinator: messages keep their order, and wait in a bounded queue while
/// the coordinator is away. Used by one thread, except wake().
class WorkerChannel {
 public:
  static Result<WorkerChannel> connect(const std::string& endpoint,
                                       const ClientAccess& access = {});

  /// Ends the connection until the next send(): somebody else needs it more.
  void hang_up();
  /// Queues the message without waiting; false when the queue is full: the coordinator has been
  /// away for long.
  bool send(const Message& message);
  /// The next message, or nullopt after `timeout`, a signal or wake(). A message that cannot be
  /// read is returned as a Refused that says why.
  std::optional<Message> receive(std::chrono::milliseconds timeout);
  /// Why the connection was refused, since the last call (Socket).
  std::optional<Error> take_refusal() { return socket_.take_refusal(); }
  /// Ends a receive() early, from any thread: "there is something to send".
  void wake() { socket_.wake(); }

 private:
  explicit WorkerChannel(Socket socket) : socket_(std::move(socket)) {}

  Socket socket_;
  bool is_hung_up_ = false;
};

}  // namespace baton
