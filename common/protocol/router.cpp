#include "common/protocol/router.h"

#include <utility>

namespace baton {
namespace {

constexpr std::chrono::milliseconds kRouterLinger{1000};  // so that a Shutdown reaches the workers

}  // namespace

Result<Router> Router::bind(const std::string& endpoint, const ServerAccess& access) {
  BATON_ASSIGN(Socket socket, Socket::bind(endpoint, kRouterLinger, access));
  return Router(std::move(socket), access.key);
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
  if (!key_) return Incoming{std::move(peer), decode_message(*frames)};
  const auto speaker = key_->known.find(socket_.sender_key());
  if (speaker == key_->known.end())
    return Incoming{std::move(peer), Error{ErrorKind::usage, "message: from nobody known"}};
  return Incoming{std::move(peer), decode_message(*frames), speaker->second};
}

}  // namespace baton
