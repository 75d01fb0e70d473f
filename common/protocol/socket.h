#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"
#include "common/protocol/access.h"

namespace baton {

/// One ZeroMQ socket that carries multi-frame messages; only socket, connection_watch, doorkeeper
/// and keys know the library. Not thread-safe, except wake(). Nothing here blocks but receive(),
/// and that no longer than its timeout. Queues are bounded by limits::kMaxQueuedMessages, frames by
/// limits::kMaxMessageBytes, what comes without the end of a message by limits::kMaxUnendedBytes.
/// Broken connections are made again in the background; what was queued is kept, what was on its
/// way is lost.
class Socket {
 public:
  /// What happens to messages while nobody listens.
  enum class Unconnected { queue, refuse };

  /// Talks to one listener (DEALER). `linger`: how long closing waits for unsent messages. An
  /// endpoint that nobody listens on is not an error: messages wait in the queue, or send() refuses
  /// them until there is a connection.
  static Result<Socket> connect(const std::string& endpoint, std::chrono::milliseconds linger,
                                Unconnected unconnected = Unconnected::queue,
                                const ClientAccess& access = {});
  /// Listens for many (ROUTER): the first frame of each message is the peer's identity.
  /// "tcp://host:*" picks a port. With a key, only those that it knows are let in.
  static Result<Socket> bind(const std::string& endpoint, std::chrono::milliseconds linger,
                             const ServerAccess& access = {});

  Socket(Socket&&) noexcept;
  Socket& operator=(Socket&&) noexcept;
  ~Socket();

  /// Waits until send() takes a message; false when it still does not after `timeout`, or when the
  /// key was refused.
  bool wait_to_send(std::chrono::milliseconds timeout);
  /// Queues the frames; false when the queue is full or the peer is gone, and then nothing was
  /// queued. Where many connect, the queue of a peer is full, too, when it reads nothing and too
  /// many bytes wait for it (ConnectionWatch::take_place).
  bool send(const std::vector<Bytes>& frames);
  /// The next message, or nullopt after `timeout`, a signal, wake() or a refusal. Of a message with
  /// more than limits::kMaxMessageFrames frames only so many are returned.
  std::optional<std::vector<Bytes>> receive(std::chrono::milliseconds timeout);
  /// The public key of who sent the last message; empty: without keys.
  const std::string& sender_key() const;
  /// Of a socket that listens: others are let in from now on. Who is connected stays so.
  void let_in(const std::map<std::string, Speaker>& known);
  /// Ends the connection of a socket that connects; dial() makes it again. What is queued is lost.
  void hang_up();
  void dial();
  /// Why a connection was refused, by either side, once. usage: the key is not known, or the
  /// other side spoke against the rules; timeout: it was broken off, which may have other reasons.
  std::optional<Error> take_refusal();
  /// Whether it will not be let in: it was told so, or was broken off again and again.
  bool is_denied() const;
  /// Whether a connection to the other side stood at some time; its program need not have taken it.
  bool was_connected() const;
  /// Ends a receive() that is under way, or the next one, early. From any thread.
  void wake();
  /// The concrete endpoint: with the port that was picked.
  const std::string& endpoint() const;

 private:
  struct Impl;
  explicit Socket(std::unique_ptr<Impl> impl);
  static Result<Socket> open(const std::string& endpoint, std::chrono::milliseconds linger,
                             Unconnected unconnected, const ClientAccess* client,
                             const ServerAccess* server);

  std::unique_ptr<Impl> impl_;
};

}  // namespace baton
