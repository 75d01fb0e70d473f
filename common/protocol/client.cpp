#include "common/protocol/client.h"

#include <fmt/format.h>

#include <utility>

namespace baton {
namespace {

constexpr std::chrono::milliseconds kLinger{0};

ErrorKind error_kind_of(std::uint8_t kind) {
  return kind <= static_cast<std::uint8_t>(ErrorKind::internal) ? static_cast<ErrorKind>(kind)
                                                                : ErrorKind::internal;
}

}  // namespace

RequestClient::RequestClient(std::string endpoint, Socket socket)
    : endpoint_(std::move(endpoint)), socket_(std::move(socket)) {}

Result<RequestClient> RequestClient::connect(const std::string& endpoint) {
  BATON_ASSIGN(Socket socket, Socket::connect(endpoint, kLinger));
  return RequestClient(endpoint, std::move(socket));
}

Result<Message> RequestClient::request(const Message& message, std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point deadline = Clock::now() + timeout;

  // Wait for the one answer; a signal may end a wait early.
  std::optional<std::vector<Bytes>> frames;
  if (socket_.send(encode_message(message))) {
    while (!frames && Clock::now() < deadline) {
      frames =
          socket_.receive(std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()));
    }
  }
  if (!frames) {
    BATON_ASSIGN(socket_, Socket::connect(endpoint_, kLinger));
    return Error{ErrorKind::timeout, fmt::format("{}: no coordinator answered within {} ms",
                                                 endpoint_, timeout.count())};
  }

  BATON_ASSIGN(Message answer, decode_message(*frames));
  if (const auto* refused = std::get_if<Refused>(&answer)) {
    return Error{error_kind_of(refused->kind), refused->message};
  }
  return answer;
}

}  // namespace baton
