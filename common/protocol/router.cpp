#include "common/protocol/router.h"

#include <utility>

namespace baton {
namespace {

constexpr std::chrono::milliseconds kRouterLinger{1000};  // so that a Shutdown reaches the workers

}  // namespace

Result<Router> Router::bind(const std::string& endpoint) {
  BATON_ASSIGN(Socket socket, Socket::bind(endpoint, kRouterLinger));
  return Router(std::move(socket));
}

bool Router::send(const PeerId& peer, const Message& message) {
  std::vector<Bytes> frames = encode_message(message);
  frames.insert(frames.begin(), peer);
  return socket_.send(frames);
}

std::optional<Incoming> Router::receive(std::chrono::milliseconds timeout) {
  std::optional<std::vector<Bytes>> frames = socket_.receive(timeout);
  if (!frames) return std::nullopt;
  PeerId peer = std::move(frames->front());
  frames->erase(frames->begin());
  return Incoming{std::move(peer), decode_message(*frames)};
}

}  // namespace baton
