// send_raw ENDPOINT KIND: sends one message that no program of Baton would send and prints the
// answer, or "no answer". KIND: version (of protocol version 127), garbage, empty, short (a
// body cut off), many (too many frames); unread: asks much, reads no answer and leaves, again and
// again for a quarter of a minute.

#include <fmt/format.h>

#include <chrono>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "common/protocol/messages.h"
#include "common/protocol/socket.h"

namespace {

baton::Bytes bytes_of(std::string_view text) {
  const baton::ByteView view = baton::as_bytes_view(text);
  return {view.begin(), view.end()};
}

std::vector<baton::Bytes> make_frames(std::string_view kind) {
  std::vector<baton::Bytes> frames = baton::encode_message(baton::ShowJob{"0123456789"});
  // The version is the last two bytes of the first frame, little-endian.
  if (kind == "version") frames[0][frames[0].size() - 2] = std::byte{127};
  if (kind == "garbage") frames = {bytes_of("GET / HTTP/1.0"), bytes_of("\xFF\xFE\xFD")};
  if (kind == "empty") frames = {{}};
  if (kind == "short") frames[2].resize(frames[2].size() / 2);
  if (kind == "many") frames.resize(100, bytes_of("more"));
  return frames;
}

/// Error: it cannot connect.
baton::Status leave_unread(const std::string& endpoint) {
  constexpr int kTimes = 4, kConnections = 3, kQuestions = 6000;
  constexpr std::chrono::milliseconds kUntilTheQueueStands{2500};
  for (int time = 0; time < kTimes; ++time) {
    std::vector<baton::Socket> connections;
    for (int i = 0; i < kConnections; ++i) {
      BATON_ASSIGN(baton::Socket socket,
                   baton::Socket::connect(endpoint, std::chrono::milliseconds(0)));
      connections.push_back(std::move(socket));
    }
    for (int i = 0; i < kQuestions; ++i) {
      for (baton::Socket& connection : connections)
        connection.send(baton::encode_message(baton::ShowJob{"0123456789"}));
    }
    std::this_thread::sleep_for(kUntilTheQueueStands);
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 64;
  constexpr std::chrono::milliseconds kPatience{2000};
  if (argv[2] == std::string_view("unread")) return leave_unread(argv[1]) ? 0 : 1;
  auto socket = baton::Socket::connect(argv[1], kPatience);
  if (!socket) {
    fmt::print(stderr, "{}\n", socket.error().message);
    return 1;
  }
  socket->send(make_frames(argv[2]));

  const auto answer = socket->receive(kPatience);
  if (!answer) {
    fmt::print("no answer\n");
    return 0;
  }
  const auto message = baton::decode_message(*answer);
  if (!message) {
    fmt::print("unreadable: {}\n", message.error().message);
  } else if (const auto* refused = std::get_if<baton::Refused>(&*message)) {
    fmt::print("refused: {}\n", refused->message);
  } else {
    fmt::print("message of type {}\n", message->index());
  }
  return 0;
}
