#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <thread>

#include "common/base/file_descriptor.h"
#include "common/base/limits.h"
#include "common/protocol/client.h"
#include "common/protocol/router.h"
#include "common/protocol/worker_channel.h"
#include "tests/support/patience.h"

namespace baton {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr auto kPatience = with_patience(10s);  // for what must come
constexpr auto kMoment = 20ms;                  // for what must not come

struct ChannelTest : testing::Test {
  Router router = Router::bind("tcp://127.0.0.1:*").value();

  /// Answers one message with what `answer` makes of it.
  template <class F>
  std::jthread answer_once(F answer) {
    return std::jthread([this, answer] {
      if (std::optional<Incoming> incoming = router.receive(kPatience))
        router.send(incoming->peer, answer(*incoming));
    });
  }
};

TEST_F(ChannelTest, RouterPicksAPort) {
  EXPECT_THAT(router.endpoint(), testing::MatchesRegex("tcp://127\\.0\\.0\\.1:[0-9]+"));
}

TEST_F(ChannelTest, ARequestIsAnswered) {
  RequestClient client = RequestClient::connect(router.endpoint()).value();
  const std::jthread server = answer_once([](const Incoming& incoming) -> Message {
    return JobAccepted{{}, digest_of(std::get<SubmitJob>(*incoming.message).json), false};
  });
  const Result<Message> answer = client.request(SubmitJob{"{}"}, kPatience);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(std::get<JobAccepted>(*answer).version, digest_of("{}"));
}

TEST_F(ChannelTest, ARefusalIsAnError) {
  RequestClient client = RequestClient::connect(router.endpoint()).value();
  const std::jthread server = answer_once([](const Incoming&) -> Message {
    return Refused{static_cast<std::uint8_t>(ErrorKind::bad_input), "no such job"};
  });
  const Result<Message> answer = client.request(ShowJob{"ab"}, kPatience);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(answer.error().message, "no such job");
}

TEST_F(ChannelTest, SilenceIsATimeoutAndALateAnswerIsNotMistaken) {
  // An answered request first, so that the connection stands.
  RequestClient client = RequestClient::connect(router.endpoint()).value();
  {
    const std::jthread server = answer_once([](const Incoming&) -> Message { return JobList{}; });
    ASSERT_TRUE(client.request(ListJobs{}, kPatience).ok());
  }
  const Result<Message> silence = client.request(ListJobs{}, kMoment);
  ASSERT_FALSE(silence.ok());
  EXPECT_EQ(silence.error().kind, ErrorKind::timeout);
  EXPECT_THAT(silence.error().message, HasSubstr(router.endpoint()));

  // Answer the first request now, then the second: only the latter may arrive.
  const std::optional<Incoming> late = router.receive(kPatience);
  ASSERT_TRUE(late.has_value());
  router.send(late->peer, JobList{});
  const std::jthread server = answer_once([](const Incoming&) -> Message { return ShownJob{}; });
  const Result<Message> answer = client.request(ShowJob{"ab"}, kPatience);
  ASSERT_TRUE(answer.ok()) << answer.error().message;
  EXPECT_TRUE(std::holds_alternative<ShownJob>(*answer));
}

TEST(RequestClientAlone, NobodyThereIsSaidSo) {
  RequestClient client = RequestClient::connect("tcp://127.0.0.1:1").value();
  const Result<Message> answer = client.request(ListJobs{}, kMoment);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().kind, ErrorKind::timeout);
  EXPECT_EQ(answer.error().message, "tcp://127.0.0.1:1: no coordinator listens there");
}

// A coordinator that stands still, or has no descriptor for one more connection.
TEST(RequestClientAlone, WhoListensAndTakesNobodyIsToldApart) {
  const FileDescriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* const place = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof(address);
  ASSERT_EQ(::bind(listener.number(), place, size), 0);
  ASSERT_EQ(::listen(listener.number(), 4), 0);
  ASSERT_EQ(::getsockname(listener.number(), place, &size), 0);

  const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  RequestClient client = RequestClient::connect(endpoint).value();
  const Result<Message> answer = client.request(ListJobs{}, with_patience(200ms));
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().kind, ErrorKind::timeout);
  EXPECT_THAT(answer.error().message, HasSubstr(endpoint + ": who listens there takes no"));
}

TEST_F(ChannelTest, AWorkersMessagesKeepTheirOrder) {
  WorkerChannel worker = WorkerChannel::connect(router.endpoint()).value();
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(worker.send(LeaseRequest{i}));
  PeerId peer;
  for (int i = 0; i < 100; ++i) {
    const std::optional<Incoming> incoming = router.receive(kPatience);
    ASSERT_TRUE(incoming.has_value());
    EXPECT_EQ(std::get<LeaseRequest>(*incoming->message).count, i);
    peer = incoming->peer;
  }
  ASSERT_TRUE(router.send(peer, NoWork{5}));
  const std::optional<Message> answer = worker.receive(kPatience);
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(std::get<NoWork>(*answer).retry_ms, 5);
}

TEST_F(ChannelTest, MessagesWaitForACoordinatorThatComesBack) {
  const std::string endpoint = router.endpoint();
  WorkerChannel worker = WorkerChannel::connect(endpoint).value();
  ASSERT_TRUE(worker.send(LeaseRequest{1}));
  ASSERT_TRUE(router.receive(kPatience).has_value());

  { const Router gone = std::move(router); }
  std::this_thread::sleep_for(kMoment);
  ASSERT_TRUE(worker.send(LeaseRequest{2}));
  Result<Router> again = Router::bind(endpoint);
  ASSERT_TRUE(again.ok()) << again.error().message;
  const std::optional<Incoming> incoming = again->receive(kPatience);
  ASSERT_TRUE(incoming.has_value());
  EXPECT_EQ(std::get<LeaseRequest>(*incoming->message).count, 2);
}

TEST(Channels, AWorkersQueueIsBounded) {
  WorkerChannel worker = WorkerChannel::connect("tcp://127.0.0.1:9").value();  // nobody listens
  int sent = 0;
  while (sent < 3 * limits::kMaxQueuedMessages && worker.send(LeaseRequest{1})) ++sent;
  EXPECT_LT(sent, 3 * limits::kMaxQueuedMessages);
}

TEST_F(ChannelTest, APeerThatIsGoneCannotBeSentTo) {
  EXPECT_FALSE(router.send(Bytes{std::byte{1}}, NoWork{}));
}

TEST_F(ChannelTest, UnreadableMessagesNameTheirFault) {
  Socket stranger = Socket::connect(router.endpoint(), 0ms).value();
  ASSERT_TRUE(stranger.send({Bytes(3, std::byte{'x'})}));
  const std::optional<Incoming> incoming = router.receive(kPatience);
  ASSERT_TRUE(incoming.has_value());
  ASSERT_FALSE(incoming->message.ok());
  EXPECT_THAT(incoming->message.error().message, HasSubstr("does not name the protocol"));
}

TEST_F(ChannelTest, WakingEndsAReceiveEarly) {
  WorkerChannel worker = WorkerChannel::connect(router.endpoint()).value();
  worker.wake();
  EXPECT_FALSE(worker.receive(1h).has_value());
  const std::jthread other([&] {
    std::this_thread::sleep_for(kMoment);
    worker.wake();
  });
  EXPECT_FALSE(worker.receive(1h).has_value());
}

TEST_F(ChannelTest, AnAddressInUseOrMalformedIsAnError) {
  const Result<Router> second = Router::bind(router.endpoint());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::io);
  EXPECT_THAT(second.error().message, HasSubstr(router.endpoint() + ": cannot listen"));
  for (const char* endpoint : {"", "nonsense", "tcp://", "tcp://127.0.0.1"}) {
    EXPECT_FALSE(RequestClient::connect(endpoint).ok()) << endpoint;
  }
}

}  // namespace
}  // namespace baton
