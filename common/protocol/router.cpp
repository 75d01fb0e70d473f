#include "common/protocol/router.h"

#include <fmt/format.h>

#include <utility>

namespace baton {
namespace {

constexpr std::chrono::milliseconds kRouterLinger{1000};  // so that a Shutdown reaches the workers

}  // namespace

Result<Router> Router::bind(const std::string& endpoint, const ServerAccess& access) {
  BATON_ASSIGN(Socket socket, Socket::bind(endpoint, kRouterLinger, access));
  Router router(std::move(socket), access);
  if (!access.key_file.empty()) {
    if (const auto stamp = stamp_of(access.key_file)) router.key_stamp_ = *stamp;
  }
  return router;
}

Result<std::optional<std::string>> Router::read_keys_again() {
  std::optional<std::string> said;
  if (access_.key_file.empty()) return said;
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(access_.key_file));
  if (stamp == key_stamp_) return said;
  key_stamp_ = stamp;
  BATON_ASSIGN(ServerKey key, read_server_key(access_.key_file));
  if (!(key.own == access_.key->own)) {
    return Error{ErrorKind::usage,
                 access_.key_file.string() +
                     ": has another key for the coordinator itself, which it takes when it is "
                     "started again"};
  }
  const auto names = [](const ServerKey& of, const ServerKey& without) {
    std::string text;
    for (const auto& [text_of_key, speaker] : of.known) {
      if (!without.known.contains(text_of_key)) text += " " + speaker.name;
    }
    return text;
  };
  const std::string added = names(key, *access_.key), removed = names(*access_.key, key);
  access_.key->known = std::move(key.known);
  socket_.let_in(access_.key->known);
  said = fmt::format("{} was read again; let in:{}; shut out:{}", access_.key_file.string(),
                     added.empty() ? " nobody new" : added, removed.empty() ? " nobody" : removed);
  return said;
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
  if (!access_.key) return Incoming{std::move(peer), decode_message(*frames)};
  const auto speaker = access_.key->known.find(socket_.sender_key());
  if (speaker == access_.key->known.end()) {
    return Incoming{std::move(peer),
                    Error{ErrorKind::usage, "the coordinator does not know this key any more"}};
  }
  return Incoming{std::move(peer), decode_message(*frames), speaker->second};
}

}  // namespace baton
