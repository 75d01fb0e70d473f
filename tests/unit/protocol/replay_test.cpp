#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <thread>

#include "common/protocol/router.h"
#include "common/protocol/worker_channel.h"
#include "tests/support/loopback.h"
#include "tests/support/patience.h"

namespace baton {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr auto kReplayPatience = with_patience(10s);

/// Somebody on the wire: passes the bytes of one connection on, and on request those that come next
/// from the client a second time.
class Eavesdropper {
 public:
  explicit Eavesdropper(int server_port) : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in own = loopback(0);
    socklen_t size = sizeof(own);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&own), size), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&own), &size), 0);
    port_ = ntohs(own.sin_port);
    thread_ = std::thread([this, server_port] { pass_on(server_port); });
  }
  ~Eavesdropper() {
    stop_ = true;
    thread_.join();
    ::close(listener_);
  }

  int port() const { return port_; }
  void replay_next() { replay_ = true; }

 private:
  bool wait_for(int socket) const {
    pollfd ready{socket, POLLIN, 0};
    return ::poll(&ready, 1, 5) > 0;
  }

  void pass_on(int server_port) {
    while (!stop_ && !wait_for(listener_)) continue;
    if (stop_) return;
    const int client = ::accept(listener_, nullptr, nullptr);
    const int server = connect_to_loopback(server_port);
    bool open = server >= 0;
    std::array<char, 65536> bytes{};
    const auto pass = [&](int from, int to, bool twice) {
      const ssize_t count = ::recv(from, bytes.data(), bytes.size(), 0);
      open = count > 0;
      for (int i = 0; open && i < (twice ? 2 : 1); ++i)
        open = ::send(to, bytes.data(), static_cast<std::size_t>(count), MSG_NOSIGNAL) == count;
    };
    while (!stop_ && open) {
      if (wait_for(client)) pass(client, server, replay_.exchange(false));
      if (open && wait_for(server)) pass(server, client, false);
    }
    ::close(client);
    ::close(server);
  }

  const int listener_;
  int port_ = 0;
  std::atomic<bool> stop_{false}, replay_{false};
  std::thread thread_;
};

/// The next that the router reads.
std::optional<Incoming> read_next(Router& router, std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::optional<Incoming> incoming;
  while (!incoming && std::chrono::steady_clock::now() < deadline) incoming = router.receive(20ms);
  return incoming;
}

TEST(Replay, AMessageThatComesAgainIsRefusedAndLogged) {
  const fs::path folder = fs::path(testing::TempDir()) / ("replay-" + std::to_string(::getpid()));
  ASSERT_TRUE(create_keys(folder));
  const auto server = server_access((folder / "server.key").string(), false, {}, {}).value();
  const auto access = client_access((folder / "worker.key").string(), false, {}).value();
  fs::remove_all(folder);
  Router router = Router::bind("tcp://127.0.0.1:*", server).value();
  const std::string& endpoint = router.endpoint();
  Eavesdropper eavesdropper(std::stoi(endpoint.substr(endpoint.rfind(':') + 1)));
  WorkerChannel channel =
      WorkerChannel::connect("tcp://127.0.0.1:" + std::to_string(eavesdropper.port()), access)
          .value();
  ASSERT_TRUE(channel.send(LeaseRequest{1}));
  ASSERT_TRUE(read_next(router, kReplayPatience).has_value());
  EXPECT_FALSE(router.take_refusal().has_value());

  // Once it is read; the second time the connection breaks.
  eavesdropper.replay_next();
  ASSERT_TRUE(channel.send(LeaseRequest{2}));
  const std::optional<Incoming> once = read_next(router, kReplayPatience);
  ASSERT_TRUE(once && once->message);
  EXPECT_EQ(std::get<LeaseRequest>(*once->message).count, 2);
  std::optional<Error> refusal;
  const auto deadline = std::chrono::steady_clock::now() + kReplayPatience;
  while (!refusal && std::chrono::steady_clock::now() < deadline) {
    EXPECT_FALSE(router.receive(20ms).has_value()) << "it was read again";
    refusal = router.take_refusal();
  }
  ASSERT_TRUE(refusal.has_value());
  EXPECT_THAT(refusal->message, HasSubstr("a message came a second time"));
}

}  // namespace
}  // namespace baton
