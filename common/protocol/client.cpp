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

Result<Socket> connect_to(const std::string& endpoint, const ClientAccess& access) {
  return Socket::connect(endpoint, kClientLinger, Socket::Unconnected::refuse, access);
}

ErrorKind error_kind_of(std::uint8_t kind) {
  return kind <= static_cast<std::uint8_t>(ErrorKind::no_space) ? static_cast<ErrorKind>(kind)
                                                                : ErrorKind::internal;
}

}  // namespace

RequestClient::RequestClient(std::string endpoint, ClientAccess access, Socket socket)
    : endpoint_(std::move(endpoint)), access_(std::move(access)), socket_(std::move(socket)) {}

Result<RequestClient> RequestClient::connect(const std::string& endpoint,
                                             const ClientAccess& access) {
  BATON_ASSIGN(Socket socket, connect_to(endpoint, access));
  return RequestClient(endpoint, access, std::move(socket));
}

/// Drops the connection. Why there is no answer: a refusal says more than silence.
Error RequestClient::give_up(const std::string& otherwise) {
  const std::optional<Error> refusal = socket_.take_refusal();
  Result<Socket> fresh = connect_to(endpoint_, access_);
  if (!fresh) return fresh.error();
  socket_ = std::move(fresh).value();
  return refusal.value_or(Error{ErrorKind::timeout, endpoint_ + ": " + otherwise});
}

Result<Message> RequestClient::request(const Message& message, std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point deadline = Clock::now() + timeout;
  pending_.clear();

  // Nobody there is found out soon. A coordinator that stands still or is full may come back.
  bool connected = socket_.wait_to_send(std::min(timeout, kConnectPatience));
  if (!connected && socket_.was_connected()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    connected = socket_.wait_to_send(std::max(left, std::chrono::milliseconds(0)));
  }
  if (!connected || !socket_.send(encode_message(message))) {
    return give_up(socket_.was_connected()
                       ? "who listens there takes no connection: a coordinator that stands still "
                         "or has no file descriptors left (its log says so), or another program"
                       : "no coordinator listens there");
  }

  // Wait for the one answer; a signal may end a wait early.
  std::optional<std::vector<Bytes>> frames;
  while (!frames && Clock::now() < deadline && !socket_.is_denied()) {
    frames = socket_.receive(std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()));
  }
  if (!frames) return give_up(fmt::format("no coordinator answered within {} ms", timeout.count()));

  BATON_ASSIGN(Message answer, decode_message(*frames));
  if (const auto* refused = std::get_if<Refused>(&answer)) {
    const ErrorKind kind = error_kind_of(refused->kind);
    if (kind == ErrorKind::timeout) pending_ = refused->message;
    return Error{kind, refused->message};
  }
  return answer;
}

}  // namespace baton
