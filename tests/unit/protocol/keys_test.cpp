#include "common/protocol/keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "common/base/files.h"
#include "common/protocol/client.h"
#include "common/protocol/router.h"
#include "common/protocol/worker_channel.h"
#include "tests/support/patience.h"

namespace baton {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr auto kKeyPatience = with_patience(10s);

struct KeysTest : testing::Test {
  const fs::path folder =
      fs::path(testing::TempDir()) /
      (std::to_string(::getpid()) + testing::UnitTest::GetInstance()->current_test_info()->name());

  void SetUp() override {
    fs::remove_all(folder);
    ASSERT_TRUE(create_keys(folder).ok());
  }
  void TearDown() override { fs::remove_all(folder); }

  ClientAccess client(const std::string& name) const {
    return client_access((folder / (name + ".key")).string(), false, {}).value();
  }
  ServerAccess server() const {
    return server_access((folder / "server.key").string(), false, {}, {}).value();
  }
};

TEST_F(KeysTest, KeysAreTheirOwnersAlone) {
  for (const char* name : {"server", "worker", "viewer", "user", "admin"}) {
    const fs::path path = folder / (std::string(name) + ".key");
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u) << path;
  }
  EXPECT_EQ(create_keys(folder).error().kind, ErrorKind::usage) << "they are not replaced";
  EXPECT_EQ(::chmod((folder / "user.key").c_str(), 0644), 0);
  EXPECT_THAT(read_client_key(folder / "user.key").error().message,
              HasSubstr("others may read this key: chmod 600"));
}

TEST_F(KeysTest, EachKeyIsKnownByRoleAndName) {
  ASSERT_TRUE(add_key(folder, {Role::user, "anna"}).ok());
  const ServerKey key = read_server_key(folder / "server.key").value();
  EXPECT_EQ(key.known.size(), 5u);
  for (const char* name : {"worker", "viewer", "user", "admin", "anna"}) {
    const ClientKey of_client = read_client_key(folder / (std::string(name) + ".key")).value();
    ASSERT_TRUE(key.known.contains(of_client.own.public_key)) << name;
    EXPECT_EQ(key.known.at(of_client.own.public_key).name, name);
    EXPECT_EQ(key.known.at(of_client.own.public_key).role, of_client.speaker.role);
    EXPECT_EQ(of_client.server_public_key, key.own.public_key);
  }
  EXPECT_FALSE(add_key(folder, {Role::user, "../anna"}).ok());
  EXPECT_FALSE(add_key(folder, {Role::user, "anna"}).ok()) << "is there";
  EXPECT_FALSE(add_key(folder, {Role::user, "server"}).ok()) << "is there";
}

TEST_F(KeysTest, WhatIsNoKeyIsSaidSo) {
  EXPECT_THAT(read_client_key(folder / "server.key").error().message, HasSubstr("a coordinator"));
  EXPECT_THAT(read_server_key(folder / "admin.key").error().message, HasSubstr("expected that of"));
  const fs::path path = folder / "bad.key";
  std::ofstream(path) << "# of Baton\nrole user\npublic short\n";
  ASSERT_EQ(::chmod(path.c_str(), 0600), 0);
  EXPECT_THAT(read_client_key(path).error().message, HasSubstr("line 3: 'public': expected"));
  std::ofstream(path) << "role user\n";
  EXPECT_THAT(read_client_key(path).error().message, HasSubstr("no whole key"));
  EXPECT_EQ(read_client_key(folder / "none.key").error().kind, ErrorKind::io);
}

TEST(Exposure, OtherMachinesNeedAKey) {
  for (const char* endpoint : {"tcp://127.0.0.1:5570", "tcp://127.1.2.3:*", "tcp://localhost:1",
                               "tcp://[::1]:5570", "ipc://@baton", "tcp://lo:5570"}) {
    EXPECT_TRUE(check_exposure(endpoint, false, false).ok()) << endpoint;
  }
  for (const char* endpoint : {"tcp://*:5570", "tcp://0.0.0.0:5570", "tcp://farm:5570",
                               "tcp://[::]:5570", "tcp://127.evil.com:5570", "tcp://eth0:5570"}) {
    EXPECT_EQ(check_exposure(endpoint, false, false).error().kind, ErrorKind::usage) << endpoint;
    EXPECT_TRUE(check_exposure(endpoint, true, false).ok()) << endpoint;
    EXPECT_TRUE(check_exposure(endpoint, false, true).ok()) << endpoint;
  }
  EXPECT_FALSE(Router::bind("tcp://*:*").ok());
  EXPECT_FALSE(WorkerChannel::connect("tcp://192.0.2.1:5570").ok());
  EXPECT_FALSE(RequestClient::connect("tcp://192.0.2.1:5570").ok());
}

TEST_F(KeysTest, WhoSpeaksIsProvenByTheKey) {
  Router router = Router::bind("tcp://127.0.0.1:*", server()).value();
  for (const char* name : {"worker", "user", "admin"}) {
    WorkerChannel channel = WorkerChannel::connect(router.endpoint(), client(name)).value();
    ASSERT_TRUE(channel.send(LeaseRequest{3}));
    std::optional<Incoming> incoming;
    const auto deadline = std::chrono::steady_clock::now() + kKeyPatience;
    while (!incoming && std::chrono::steady_clock::now() < deadline)
      incoming = router.receive(50ms);
    ASSERT_TRUE(incoming.has_value()) << name;
    EXPECT_EQ(incoming->speaker.name, name);
    EXPECT_EQ(role_name(incoming->speaker.role), name);
    ASSERT_TRUE(router.send(incoming->peer, NoWork{7}));
    const std::optional<Message> answer = channel.receive(kKeyPatience);
    ASSERT_TRUE(answer.has_value());
    EXPECT_EQ(std::get<NoWork>(*answer).retry_ms, 7);
  }
}

/// What both sides say when `access` is tried: the client's error, and the router's last refusal.
std::pair<std::optional<Error>, std::optional<Error>> try_to_speak(Router& router,
                                                                   const ClientAccess& access) {
  WorkerChannel channel = WorkerChannel::connect(router.endpoint(), access).value();
  EXPECT_TRUE(channel.send(StopCoordinator{}));
  std::optional<Error> ours, theirs;
  const auto deadline = std::chrono::steady_clock::now() + kKeyPatience;
  while ((!ours || !theirs) && std::chrono::steady_clock::now() < deadline) {
    EXPECT_FALSE(router.receive(20ms).has_value()) << "it was let in";
    EXPECT_FALSE(channel.receive(20ms).has_value());
    if (!ours) ours = channel.take_refusal();
    if (!theirs) theirs = router.take_refusal();
  }
  return {ours, theirs};
}

TEST_F(KeysTest, AKeyThatIsNotKnownIsRefusedAndBothAreTold) {
  Router router = Router::bind("tcp://127.0.0.1:*", server()).value();
  ASSERT_TRUE(add_key(folder, {Role::admin, "late"}).ok());  // the router has read its file before
  const auto [ours, theirs] = try_to_speak(router, client("late"));
  ASSERT_TRUE(ours && theirs);
  EXPECT_EQ(ours->kind, ErrorKind::usage);
  EXPECT_THAT(ours->message, HasSubstr("does not know this key"));
  EXPECT_THAT(theirs->message, HasSubstr("from 127.0.0.1: its key is not known here"));
}

TEST_F(KeysTest, AKeyOfAnotherCoordinatorAndNoKeyAreRefused) {
  Router router = Router::bind("tcp://127.0.0.1:*", server()).value();
  ASSERT_TRUE(create_keys(folder / "other").ok());
  const std::string other = (folder / "other/admin.key").string();
  for (const ClientAccess& access : {client_access(other, false, {}).value(), ClientAccess{}}) {
    const auto [ours, theirs] = try_to_speak(router, access);
    ASSERT_TRUE(ours && theirs);
    EXPECT_THAT(ours->message, HasSubstr("was broken off: either side may lack a key"));
    EXPECT_THAT(theirs->message, HasSubstr("no key, or not one for this coordinator"));
  }
}

TEST_F(KeysTest, AKeyThatIsFoundAfterARefusalIsTaken) {
  ::setenv("XDG_STATE_HOME", (folder / "state").c_str(), 1);
  const ServerAccess access = server_access({}, false, "tcp://127.0.0.1:*", folder).value();
  Router router = Router::bind("tcp://127.0.0.1:*", access).value();
  WorkerChannel channel =
      WorkerChannel::connect(router.endpoint(), client_access({}, false, router.endpoint()).value())
          .value();
  std::optional<Error> refusal;
  const auto tried_until = std::chrono::steady_clock::now() + kKeyPatience;
  while (!refusal && std::chrono::steady_clock::now() < tried_until) {
    router.receive(20ms);
    channel.receive(20ms);
    refusal = channel.take_refusal();
  }
  ASSERT_TRUE(refusal.has_value()) << "there was no key yet";

  const OwnKeysNote note(router.endpoint(), access);
  std::optional<Incoming> incoming;
  const auto deadline = std::chrono::steady_clock::now() + kKeyPatience;
  while (!incoming && std::chrono::steady_clock::now() < deadline) {
    channel.send(LeaseRequest{3});
    channel.receive(20ms);
    incoming = router.receive(20ms);
  }
  ::unsetenv("XDG_STATE_HOME");
  EXPECT_TRUE(incoming.has_value());
}

TEST_F(KeysTest, ARequestSaysWhyItWasRefused) {
  Router router = Router::bind("tcp://127.0.0.1:*", server()).value();
  ASSERT_TRUE(add_key(folder, {Role::admin, "late"}).ok());
  std::atomic<bool> stop{false};
  std::thread loop([&] {
    while (!stop) router.receive(20ms);
  });
  RequestClient client = RequestClient::connect(router.endpoint(), this->client("late")).value();
  const auto asked = std::chrono::steady_clock::now();
  const Result<Message> answer = client.request(ListJobs{}, 10 * kKeyPatience);
  EXPECT_LT(std::chrono::steady_clock::now() - asked, 9 * kKeyPatience) << "said when it is known";
  stop = true;
  loop.join();
  ASSERT_FALSE(answer.ok());
  EXPECT_THAT(answer.error().message, HasSubstr("does not know this key"));
}

}  // namespace
}  // namespace baton
