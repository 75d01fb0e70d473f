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
  /// Others are let in from now on.
  void let_in(std::map<std::string, Speaker> known) { known_ = std::move(known); }
  /// Who was refused last, since the last call.
  std::optional<std::string> take_refusal() { return std::exchange(refusal_, std::nullopt); }

 private:
  std::map<std::string, Speaker> known_;  ///< by their public keys
  zmq::socket_t questions_;
  std::optional<std::string> refusal_;
};

}  // namespace baton
