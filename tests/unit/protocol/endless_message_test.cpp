#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/limits.h"
#include "common/protocol/router.h"
#include "common/protocol/worker_channel.h"
#include "tests/support/loopback.h"
#include "tests/support/patience.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

/// The beginning of a connection that speaks ZMTP 3.0 without keys (RFC 23).
std::string greeting() {
  std::string bytes(64, '\0');
  bytes[0] = '\xff';
  bytes[9] = '\x7f';
  bytes[10] = 3;
  bytes.replace(12, 4, "NULL");
  return bytes;
}

/// "I am a DEALER".
std::string ready() {
  using namespace std::string_literals;
  const std::string body = "\x05READY\x0bSocket-Type\0\0\0\x06"s + "DEALER";
  return "\x04"s + static_cast<char>(body.size()) + body;
}

/// A frame that is not the last of its message.
std::string frame_with_more(std::size_t num_bytes) {
  std::string bytes = "\x03";
  for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(num_bytes >> shift);
  return bytes + std::string(num_bytes, 'x');
}

// Without an end of the message everything stays in the library, and nothing of it is received.
TEST(EndlessMessage, ItsConnectionIsClosedAndOthersGoOn) {
  Router router = Router::bind("tcp://127.0.0.1:*").value();
  const std::string& endpoint = router.endpoint();
  WorkerChannel channel = WorkerChannel::connect(endpoint).value();
  ASSERT_TRUE(channel.send(LeaseRequest{1}));

  const int talker = connect_to_loopback(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
  ASSERT_GE(talker, 0);
  const std::string start = greeting() + ready(), frame = frame_with_more(1 << 20);
  ASSERT_EQ(::send(talker, start.data(), start.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(start.size()));

  constexpr std::size_t kTooMuch = 8 * limits::kMaxUnendedBytes;
  const auto deadline = std::chrono::steady_clock::now() + with_patience(60s);
  std::size_t num_sent = 0, num_heard = 0;
  std::optional<Error> refusal;
  while (!refusal && num_sent < kTooMuch && std::chrono::steady_clock::now() < deadline) {
    const std::size_t at = num_sent % frame.size();
    const ssize_t sent =
        ::send(talker, frame.data() + at, frame.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent > 0) num_sent += static_cast<std::size_t>(sent);
    num_heard += router.receive(1ms).has_value();
    refusal = router.take_refusal();
  }
  ::close(talker);
  ASSERT_TRUE(refusal.has_value()) << num_sent << " bytes were taken";
  EXPECT_THAT(refusal->message, HasSubstr("without the end of a message"));
  EXPECT_GT(num_sent, limits::kMaxUnendedBytes);

  // The worker, whose messages end, has its connection still.
  ASSERT_TRUE(channel.send(LeaseRequest{2}));
  while (num_heard < 2 && std::chrono::steady_clock::now() < deadline)
    num_heard += router.receive(20ms).has_value();
  EXPECT_EQ(num_heard, 2u);
  EXPECT_FALSE(router.take_refusal().has_value());
}

// Whoever has no key, or says nothing, does not take the descriptors of those who work.
TEST(SilentConnections, OfOneAddressOnlySoManyStay) {
  Router router = Router::bind("tcp://127.0.0.1:*").value();
  const std::string& endpoint = router.endpoint();
  WorkerChannel channel = WorkerChannel::connect(endpoint).value();
  ASSERT_TRUE(channel.send(LeaseRequest{1}));
  constexpr int kCount = 3 * limits::kMaxSilentConnections;
  std::vector<int> mute;
  for (int i = 0; i < kCount; ++i) {
    mute.push_back(connect_to_loopback(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    ASSERT_GE(mute.back(), 0);
  }
  // The others are closed long before the time of a handshake is up.
  const auto num_open = [&] {
    return std::ranges::count_if(mute, [](int descriptor) {
      char byte = 0;
      while (true) {
        const ssize_t read = ::recv(descriptor, &byte, 1, MSG_DONTWAIT);
        if (read <= 0) return read < 0 && errno == EAGAIN;
      }
    });
  };
  int num_heard = 0;
  std::optional<Error> refusal;
  const auto deadline = std::chrono::steady_clock::now() + with_patience(8s);
  while (num_open() > limits::kMaxSilentConnections &&
         std::chrono::steady_clock::now() < deadline) {
    num_heard += router.receive(20ms).has_value();
    if (auto said = router.take_refusal()) refusal = said;
  }
  EXPECT_EQ(num_open(), limits::kMaxSilentConnections);
  ASSERT_TRUE(refusal.has_value());
  EXPECT_THAT(refusal->message, HasSubstr("of one address that say nothing"));
  ASSERT_TRUE(channel.send(LeaseRequest{2}));
  while (num_heard < 2 && std::chrono::steady_clock::now() < deadline)
    num_heard += router.receive(20ms).has_value();
  EXPECT_EQ(num_heard, 2) << "who has spoken stays";
  for (const int descriptor : mute) ::close(descriptor);
}

/// A client that asks and reads no answers.
struct Talker {
  int descriptor = -1;
  /// As the router knows it; empty: its question has not come.
  PeerId peer;
};
Talker ask_without_reading(Router& router) {
  const std::string& endpoint = router.endpoint();
  Talker talker{connect_to_loopback(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))), {}};
  EXPECT_GE(talker.descriptor, 0);
  const auto say = [&](const std::string& words) {
    EXPECT_EQ(::send(talker.descriptor, words.data(), words.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(words.size()));
  };
  // The library takes what comes after a greeting once it has answered that.
  say(greeting());
  std::string heard;
  for (char byte = 0; !heard.ends_with("READY") && ::recv(talker.descriptor, &byte, 1, 0) == 1;)
    heard += byte;
  say(ready() + std::string("\0\1x", 3));
  std::optional<Incoming> question;
  const auto deadline = std::chrono::steady_clock::now() + with_patience(30s);
  while (!question && std::chrono::steady_clock::now() < deadline) question = router.receive(20ms);
  EXPECT_TRUE(question.has_value());
  if (question) talker.peer = question->peer;
  return talker;
}

/// Bytes of answers of this size that are taken for the talker, of more than may be.
std::size_t bytes_taken(Router& router, const Talker& talker, std::size_t answer_bytes) {
  const JobDocument answer{{}, std::string(answer_bytes, 'x'), {}, {}};
  std::size_t num_taken = 0;
  for (std::size_t i = 0; i < 2 * limits::kMaxUnreadBytes / answer_bytes; ++i)
    num_taken += router.send(talker.peer, answer);
  return num_taken * answer_bytes;
}

// Answers that nobody reads take no more memory than one of the largest.
TEST(UnreadAnswers, AreLimitedInBytes) {
  Router router = Router::bind("tcp://127.0.0.1:*").value();
  const Talker talker = ask_without_reading(router);
  constexpr std::size_t kAnswerBytes = 4 << 20;
  const std::size_t taken = bytes_taken(router, talker, kAnswerBytes);
  EXPECT_GE(taken, 2 * kAnswerBytes);
  EXPECT_LE(taken, limits::kMaxUnreadBytes);

  // Once it reads it gets answers again.
  std::string read(1 << 20, '\0');
  bool is_heard = false;
  const auto deadline = std::chrono::steady_clock::now() + with_patience(30s);
  while (!is_heard && std::chrono::steady_clock::now() < deadline) {
    while (::recv(talker.descriptor, read.data(), read.size(), MSG_DONTWAIT) > 0) continue;
    router.receive(5ms);
    is_heard = router.send(talker.peer, JobDocument{{}, std::string(kAnswerBytes, 'x'), {}, {}});
  }
  EXPECT_TRUE(is_heard);
  ::close(talker.descriptor);
}

// Small ones are limited by how many may wait for one client, so it takes several.
TEST(UnreadAnswers, OfAllClientsAreLimitedHoweverSmall) {
  Router router = Router::bind("tcp://127.0.0.1:*").value();
  constexpr std::size_t kAnswerBytes = 12 << 10;
  constexpr std::size_t kOfOne = kAnswerBytes * limits::kMaxQueuedMessages;
  static_assert(kOfOne < limits::kMaxUnreadBytes);
  std::vector<Talker> talkers;
  std::size_t taken = 0;
  for (std::size_t i = 0; i < limits::kMaxUnreadBytesInAll / kOfOne + 2; ++i) {
    talkers.push_back(ask_without_reading(router));
    taken += bytes_taken(router, talkers.back(), kAnswerBytes);
  }
  EXPECT_LE(taken, limits::kMaxUnreadBytesInAll);
  EXPECT_GE(taken, limits::kMaxUnreadBytesInAll / 2);
  for (const Talker& talker : talkers) ::close(talker.descriptor);
}

/// With a key, as farms have it, or without.
class ManyMessages : public testing::TestWithParam<bool> {};

// What counts is what came since the last end of a message, however much came before.
TEST_P(ManyMessages, MayComeOverOneConnection) {
  ServerAccess server;
  ClientAccess client;
  if (GetParam()) {
    const fs::path folder = fs::path(testing::TempDir()) / ("many-" + std::to_string(::getpid()));
    ASSERT_TRUE(create_keys(folder));
    server = server_access((folder / "server.key").string(), false, {}, {}).value();
    client = client_access((folder / "worker.key").string(), false, {}).value();
    fs::remove_all(folder);
  }
  Router router = Router::bind("tcp://127.0.0.1:*", server).value();
  WorkerChannel channel = WorkerChannel::connect(router.endpoint(), client).value();
  const JobDocument document{{}, std::string(limits::kMaxMessageBytes / 2, ' ')};
  for (int i = 0; i < 6; ++i) {
    ASSERT_TRUE(channel.send(document));
    const auto deadline = std::chrono::steady_clock::now() + with_patience(20s);
    bool heard = false;
    while (!heard && std::chrono::steady_clock::now() < deadline)
      heard = router.receive(20ms).has_value();
    ASSERT_TRUE(heard) << i;
  }
  EXPECT_FALSE(router.take_refusal().has_value());
}

INSTANTIATE_TEST_SUITE_P(Keys, ManyMessages, testing::Bool(), [](const auto& with_key) {
  return with_key.param ? "WithKey" : "WithoutKey";
});

}  // namespace
}  // namespace baton
