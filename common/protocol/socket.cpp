#include "common/protocol/socket.h"

#include <fmt/format.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <utility>
#include <zmq.hpp>

#include "common/base/check.h"
#include "common/base/file_descriptor.h"
#include "common/base/limits.h"
#include "common/protocol/connection_watch.h"
#include "common/protocol/doorkeeper.h"

namespace baton {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kReconnectFirstMs = 50;
constexpr int kReconnectMaxMs = 2000;
// Who connects to a coordinator says within this who it is, or goes.
constexpr int kHandshakeMs = 10000;
// A peer whose machine has vanished is noticed after 5 + 3 * 2 s, and after kUnansweredMs where
// something was sent to it.
constexpr int kKeepAliveIdleS = 5, kKeepAliveIntervalS = 2, kKeepAliveProbes = 3;
constexpr int kUnansweredMs = 12000;
constexpr std::chrono::milliseconds kClosingInterval{100};
constexpr int kMostFailures = 4;
constexpr std::chrono::milliseconds kRedialInterval{700};

void set_options(zmq::socket_t& socket, std::chrono::milliseconds linger) {
  socket.set(zmq::sockopt::linger, static_cast<int>(linger.count()));
  socket.set(zmq::sockopt::sndhwm, limits::kMaxQueuedMessages);
  socket.set(zmq::sockopt::rcvhwm, limits::kMaxQueuedMessages);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(limits::kMaxMessageBytes));
  socket.set(zmq::sockopt::reconnect_ivl, kReconnectFirstMs);
  socket.set(zmq::sockopt::reconnect_ivl_max, kReconnectMaxMs);
  // The system's, not ZeroMQ's heartbeats: those end the process with an assertion where a peer
  // leaves with its queue unread (libzmq 4.3.4).
  socket.set(zmq::sockopt::tcp_keepalive, 1);
  socket.set(zmq::sockopt::tcp_keepalive_idle, kKeepAliveIdleS);
  socket.set(zmq::sockopt::tcp_keepalive_intvl, kKeepAliveIntervalS);
  socket.set(zmq::sockopt::tcp_keepalive_cnt, kKeepAliveProbes);
  socket.set(zmq::sockopt::tcp_maxrt, kUnansweredMs);
}

/// Repeats a call that a signal interrupted.
template <class F>
auto despite_signals(F call) {
  while (true) {
    try {
      return call();
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
  }
}

/// Waits for one of the events, no longer than until the deadline; false: a signal came.
bool poll_until(Clock::time_point deadline, std::vector<zmq::pollitem_t>& items) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
  try {
    zmq::poll(items, std::max(left, std::chrono::milliseconds(0)));
    return true;
  } catch (const zmq::error_t& error) {
    BATON_CHECK(error.num() == EINTR);
    return false;
  }
}

}  // namespace

struct Socket::Impl {
  Impl(bool listens, bool has_key)
      : socket(context, listens ? zmq::socket_type::router : zmq::socket_type::dealer),
        watch(context, socket, {.handshakes = has_key || !listens, .connections = true}),
        wake_fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        is_server(listens) {
    BATON_CHECK(bool{wake_fd});
  }

  /// The keys come before bind and connect.
  void use(const ClientKey& key) {
    socket.set(zmq::sockopt::curve_publickey, key.own.public_key);
    socket.set(zmq::sockopt::curve_secretkey, key.own.secret_key);
    socket.set(zmq::sockopt::curve_serverkey, key.server_public_key);
  }
  void use(const ServerKey& key) {
    doorkeeper.emplace(context, key.known);
    socket.set(zmq::sockopt::curve_server, 1);
    socket.set(zmq::sockopt::curve_secretkey, key.own.secret_key);
  }
  /// A coordinator that was started later or again may have made keys since. False: not others.
  bool take_new_key() {
    const Result<std::optional<ClientKey>> found = own_key(endpoint);
    if (!finds_key || !found || *found == found_key) return false;
    found_key = *found;
    redial();
    return true;
  }
  void redial() {
    socket.disconnect(endpoint);
    if (finds_key && found_key) {
      use(*found_key);
    } else if (finds_key) {
      ::zmq_setsockopt(socket.handle(), ZMQ_PLAIN_USERNAME, nullptr, 0);  // none is used
    }
    socket.connect(endpoint);
    next_dial.reset();
  }
  /// Polled beside the socket itself, which is the first.
  std::vector<zmq::pollitem_t> poll_items(short events) {
    std::vector<zmq::pollitem_t> items{{socket.handle(), 0, events, 0}};
    items.push_back({watch.events().handle(), 0, ZMQ_POLLIN, 0});
    if (doorkeeper) items.push_back({doorkeeper->questions().handle(), 0, ZMQ_POLLIN, 0});
    return items;
  }
  Clock::time_point next_turn(Clock::time_point deadline) const {
    return std::min(deadline, next_dial.value_or(deadline));
  }
  bool is_denied() const {
    return watch.failure() == ConnectionWatch::Failure::denied || num_failed >= kMostFailures;
  }
  /// True: a handshake has failed.
  bool look_at_connections() {
    if (doorkeeper) doorkeeper->answer();
    bool has_failed = watch.poll();
    const auto now = Clock::now();
    if (has_failed && take_new_key()) {
      watch.take();
      has_failed = false;
    }
    if (has_failed) ++num_failed;
    // The library gives an endpoint up after a handshake that failed; the coordinator may only have
    // begun, and its keys be found in a moment.
    if (has_failed && !is_server) next_dial = now + kRedialInterval;
    if (next_dial && now >= *next_dial && !take_new_key()) redial();
    if (is_server && now >= next_closing) {
      watch.close_unwelcome();
      next_closing = now + kClosingInterval;
    }
    return has_failed;
  }
  /// False after the timeout, a wake-up, a signal or a failed handshake.
  bool wait_for_message(std::chrono::milliseconds timeout) {
    const auto deadline = Clock::now() + timeout;
    std::vector<zmq::pollitem_t> items = poll_items(ZMQ_POLLIN);
    items.push_back({nullptr, wake_fd.number(), ZMQ_POLLIN, 0});
    while (true) {
      if (!poll_until(next_turn(deadline), items)) return false;
      const bool is_woken = (items.back().revents & ZMQ_POLLIN) != 0;
      eventfd_t count = 0;
      if (is_woken) ::eventfd_read(wake_fd.number(), &count);
      const bool has_failed = look_at_connections();
      if (items[0].revents & ZMQ_POLLIN) return true;
      if (is_woken || has_failed || Clock::now() >= deadline) return false;
    }
  }

  zmq::context_t context;
  zmq::socket_t socket;
  ConnectionWatch watch;
  std::optional<Doorkeeper> doorkeeper;
  FileDescriptor wake_fd;
  std::string endpoint, sender_key;
  std::optional<ClientKey> found_key;  ///< in use, where finds_key
  bool finds_key = false;              ///< ClientAccess::finds_key
  bool is_server;
  int num_failed = 0;  ///< handshakes
  std::optional<Clock::time_point> next_dial;
  Clock::time_point next_closing;
};

void Socket::let_in(const std::map<std::string, Speaker>& known) {
  if (impl_->doorkeeper) impl_->doorkeeper->let_in(known);
}
void Socket::hang_up() {
  impl_->socket.disconnect(impl_->endpoint);
  impl_->next_dial.reset();
}
void Socket::dial() { impl_->socket.connect(impl_->endpoint); }

Socket::Socket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Socket::Socket(Socket&&) noexcept = default;
Socket& Socket::operator=(Socket&&) noexcept = default;
Socket::~Socket() = default;

Result<Socket> Socket::open(const std::string& endpoint, std::chrono::milliseconds linger,
                            Unconnected unconnected, const ClientAccess* client,
                            const ServerAccess* server) {
  // ZeroMQ takes a port modulo 65536.
  const std::string port = endpoint.substr(endpoint.rfind(':') + 1);
  const bool is_number = !port.empty() && port.find_first_not_of("0123456789") == std::string::npos;
  if (is_number && (port.size() > 5 || std::stoi(port) > 65535)) {
    return Error{ErrorKind::usage, fmt::format("{}: expected a port up to 65535", endpoint)};
  }
  const bool listen = server != nullptr;
  const bool has_key = listen ? server->key.has_value() : client->key.has_value();
  BATON_TRY(check_exposure(endpoint, has_key, listen ? server->insecure : client->insecure));
  try {
    auto impl = std::make_unique<Impl>(listen, has_key);
    set_options(impl->socket, linger);
    if (listen && server->key) impl->use(*server->key);
    if (!listen && client->key) impl->use(*client->key);
    if (!listen && client->finds_key) {
      impl->finds_key = true;
      impl->found_key = client->key;
    }
    impl->socket.set(zmq::sockopt::immediate, unconnected == Unconnected::refuse);
    if (listen) {
      impl->socket.set(zmq::sockopt::router_mandatory, true);
      impl->socket.set(zmq::sockopt::handshake_ivl, kHandshakeMs);
      impl->socket.bind(endpoint);
      impl->endpoint = impl->socket.get(zmq::sockopt::last_endpoint);
    } else {
      impl->socket.connect(endpoint);
      impl->endpoint = endpoint;
    }
    return Socket(std::move(impl));
  } catch (const zmq::error_t& error) {
    return Error{error.num() == EINVAL ? ErrorKind::usage : ErrorKind::io,
                 fmt::format("{}: cannot {}: {}; expected an endpoint like tcp://127.0.0.1:5570",
                             endpoint, listen ? "listen" : "connect", error.what())};
  }
}

Result<Socket> Socket::connect(const std::string& endpoint, std::chrono::milliseconds linger,
                               Unconnected unconnected, const ClientAccess& access) {
  return open(endpoint, linger, unconnected, &access, nullptr);
}

Result<Socket> Socket::bind(const std::string& endpoint, std::chrono::milliseconds linger,
                            const ServerAccess& access) {
  return open(endpoint, linger, Unconnected::queue, nullptr, &access);
}

bool Socket::wait_to_send(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  std::vector<zmq::pollitem_t> items = impl_->poll_items(ZMQ_POLLOUT);
  while (!impl_->is_denied()) {
    const bool is_signal = !poll_until(impl_->next_turn(deadline), items);
    if (!is_signal && (items[0].revents & ZMQ_POLLOUT)) return true;
    impl_->look_at_connections();
    if (Clock::now() >= deadline) return false;
  }
  return false;
}

bool Socket::send(const std::vector<Bytes>& frames) {
  if (impl_->is_server) {
    std::uint64_t size = 0;
    for (const Bytes& frame : frames) size += frame.size();
    if (!impl_->watch.take_place(frames.front(), size)) return false;
  }
  try {
    bool queued = true;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto more = i + 1 < frames.size() ? zmq::send_flags::sndmore : zmq::send_flags::none;
      const zmq::const_buffer frame(frames[i].data(), frames[i].size());
      const bool sent = despite_signals(
          [&] { return impl_->socket.send(frame, more | zmq::send_flags::dontwait).has_value(); });
      // Refused at once: nothing is queued. Later: the connection broke, and the library drops the
      // message, for which it must see all its frames.
      if (!sent && i == 0) return false;
      queued = queued && sent;
    }
    return queued;
  } catch (const zmq::error_t& error) {
    BATON_CHECK(error.num() == EHOSTUNREACH);
    return false;
  }
}

std::optional<std::vector<Bytes>> Socket::receive(std::chrono::milliseconds timeout) {
  if (!impl_->wait_for_message(timeout)) return std::nullopt;

  // The frames of one message arrive together.
  std::vector<Bytes> frames;
  zmq::message_t frame;
  do {
    const bool received = despite_signals(
        [&] { return impl_->socket.recv(frame, zmq::recv_flags::dontwait).has_value(); });
    if (!received) return std::nullopt;
    // Who sent it stands with each frame but the first, which the library adds.
    if (frames.size() == 1 && impl_->is_server) impl_->watch.note_message(frame, frames.front());
    if (frames.size() <= 1 && impl_->doorkeeper) {
      const char* const key = ::zmq_msg_gets(frame.handle(), "User-Id");
      impl_->sender_key = key != nullptr ? key : "";
    }
    if (frames.size() < limits::kMaxMessageFrames) {
      const auto* data = frame.data<std::byte>();
      frames.emplace_back(data, data + frame.size());
    }
  } while (frame.more());
  return frames;
}

const std::string& Socket::sender_key() const { return impl_->sender_key; }

std::optional<Error> Socket::take_refusal() {
  if (impl_->doorkeeper) {
    if (std::optional<std::string> refusal = impl_->doorkeeper->take_refusal())
      return Error{ErrorKind::usage, *refusal};
  }
  const auto failure = impl_->watch.take();
  if (!failure) return std::nullopt;
  const bool denied = *failure == ConnectionWatch::Failure::denied;
  if (impl_->is_server) {
    if (denied) return std::nullopt;  // the doorkeeper has told
    if (*failure == ConnectionWatch::Failure::endless)
      return Error{ErrorKind::usage,
                   fmt::format("a connection: {} bytes without the end of a message",
                               limits::kMaxUnendedBytes)};
    if (*failure == ConnectionWatch::Failure::crowd)
      return Error{ErrorKind::usage,
                   fmt::format("connections: more than {} of one address that say nothing",
                               limits::kMaxSilentConnections)};
    if (*failure == ConnectionWatch::Failure::replayed)
      return Error{ErrorKind::usage, "a connection: a message came a second time, or out of turn"};
    return Error{ErrorKind::usage, "a connection: it has no key, or not one for this coordinator"};
  }
  if (denied)
    return Error{ErrorKind::usage,
                 fmt::format("{}: the coordinator does not know this key", impl_->endpoint)};
  return Error{ErrorKind::timeout,
               fmt::format("{}: the connection was broken off: either side may lack a key, or this "
                           "one is of another coordinator",
                           impl_->endpoint)};
}

bool Socket::is_denied() const { return impl_->is_denied(); }

bool Socket::was_connected() const { return impl_->watch.was_connected(); }

void Socket::wake() { ::eventfd_write(impl_->wake_fd.number(), 1); }

const std::string& Socket::endpoint() const { return impl_->endpoint; }

}  // namespace baton
