#include "common/protocol/worker_channel.h"

#include <utility>

namespace baton {
namespace {

constexpr std::chrono::milliseconds kWorkerLinger{500};

}  // namespace

Result<WorkerChannel> WorkerChannel::connect(const std::string& endpoint,
                                             const ClientAccess& access) {
  BATON_ASSIGN(Socket socket,
               Socket::connect(endpoint, kWorkerLinger, Socket::Unconnected::queue, access));
  return WorkerChannel(std::move(socket));
}

void WorkerChannel::hang_up() {
  if (!std::exchange(is_hung_up_, true)) socket_.hang_up();
}

bool WorkerChannel::send(const Message& message) {
  if (std::exchange(is_hung_up_, false)) socket_.dial();
  return socket_.send(encode_message(message));
}

std::optional<Message> WorkerChannel::receive(std::chrono::milliseconds timeout) {
  const std::optional<std::vector<Bytes>> frames = socket_.receive(timeout);
  if (!frames) return std::nullopt;
  Result<Message> message = decode_message(*frames);
  if (message) return std::move(message).value();
  return Refused{static_cast<std::uint8_t>(message.error().kind), message.error().message};
}

}  // namespace baton
