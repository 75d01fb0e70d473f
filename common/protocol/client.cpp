#include "common/protocol/client.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/patience.h"

namespace baton {
namespace {

constexpr std::chrono::milliseconds kClientLinger{0};

/// A coordinator accepts connections at once, however busy it is.
constexpr std::chrono::milliseconds kConnectPatience{2000 * kPatienceFactor};

Result<Socket> connect_to(const std::string& endpoint) {
  return Socket::connect(endpoint, kClientLinger, Socket::Unconnected::refuse);
}

ErrorKind error_kind_of(std::uint8_t kind) {
  return kind <= static_cast<std::uint8_t>(ErrorKind::no_space) ? static_cast<ErrorKind>(kind)
                                                                : ErrorKind::internal;
}

}  // namespace

RequestClient::RequestClient(std::string endpoint, Socket socket)
    : endpoint_(std::move(endpoint)), socket_(std::move(socket)) {}

Result<RequestClient> RequestClient::connect(const std::string& endpoint) {
  BATON_ASSIGN(Socket socket, connect_to(endpoint));
  return RequestClient(endpoint, std::move(socket));
}

Result<Message> RequestClient::request(const Message& message, std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point deadline = Clock::now() + timeout;

  // Nobody there is found out soon.
  const bool connected = socket_.wait_to_send(std::min(timeout, kConnectPatience));
  if (!connected || !socket_.send(encode_message(message))) {
    BATON_ASSIGN(socket_, connect_to(endpoint_));
    return Error{ErrorKind::timeout, fmt::format("{}: no coordinator listens there", endpoint_)};
  }

  // Wait for the one answer; a signal may end a wait early.
  std::optional<std::vector<Bytes>> frames;
  while (!frames && Clock::now() < deadline) {
    frames = socket_.receive(std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()));
  }
  if (!frames) {
    BATON_ASSIGN(socket_, connect_to(endpoint_));
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
