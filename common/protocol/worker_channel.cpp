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

bool WorkerChannel::send(const Message& message) { return socket_.send(encode_message(message)); }

std::optional<Message> WorkerChannel::receive(std::chrono::milliseconds timeout) {
  const std::optional<std::vector<Bytes>> frames = socket_.receive(timeout);
  if (!frames) return std::nullopt;
  Result<Message> message = decode_message(*frames);
  if (message) return std::move(message).value();
  return Refused{static_cast<std::uint8_t>(message.error().kind), message.error().message};
}

}  // namespace baton
