#pragma once

#include <chrono>
#include <string>

#include "common/protocol/messages.h"
#include "common/protocol/socket.h"

namespace baton {

/// Asks a coordinator one question at a time. Used by one thread.
class RequestClient {
 public:
  /// Succeeds for every well-formed endpoint, whether a coordinator listens there or not.
  static Result<RequestClient> connect(const std::string& endpoint,
                                       const ClientAccess& access = {});

  /// Sends and waits for the answer; a Refused becomes the Error that it carries.
  /// ErrorKind::usage when the coordinator does not know the key, timeout when nobody listens
  /// (known after 2 s times kPatienceFactor) or no answer came in time. The connection is then
  /// dropped, so that a late answer is never taken for that of the next request.
  Result<Message> request(const Message& message, std::chrono::milliseconds timeout);
  /// What the coordinator is still doing before it can answer the last request, which is to be made
  /// again; empty: it was answered, or nobody was there. request() says it as a timeout, too.
  const std::string& pending() const { return pending_; }

 private:
  RequestClient(std::string endpoint, ClientAccess access, Socket socket);
  Error give_up(const std::string& otherwise);

  std::string endpoint_;
  ClientAccess access_;
  Socket socket_;
  std::string pending_;
};

}  // namespace baton
