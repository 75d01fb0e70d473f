#include "common/protocol/socket.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>
#include <zmq.hpp>

#include "common/base/check.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr int kReconnectFirstMs = 50;
constexpr int kReconnectMaxMs = 2000;
constexpr int kTransportHeartbeatMs = 2000;  // notices a peer whose machine vanished
constexpr int kTransportTimeoutMs = 6000;

void set_options(zmq::socket_t& socket, std::chrono::milliseconds linger) {
  socket.set(zmq::sockopt::linger, static_cast<int>(linger.count()));
  socket.set(zmq::sockopt::sndhwm, limits::kMaxQueuedMessages);
  socket.set(zmq::sockopt::rcvhwm, limits::kMaxQueuedMessages);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<std::int64_t>(limits::kMaxMessageBytes));
  socket.set(zmq::sockopt::reconnect_ivl, kReconnectFirstMs);
  socket.set(zmq::sockopt::reconnect_ivl_max, kReconnectMaxMs);
  socket.set(zmq::sockopt::heartbeat_ivl, kTransportHeartbeatMs);
  socket.set(zmq::sockopt::heartbeat_timeout, kTransportTimeoutMs);
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

}  // namespace

struct Socket::Impl {
  explicit Impl(zmq::socket_type type)
      : socket(context, type), wake_fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    BATON_CHECK(wake_fd >= 0);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { ::close(wake_fd); }

  zmq::context_t context;
  zmq::socket_t socket;
  int wake_fd;
  std::string endpoint;
};

Socket::Socket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Socket::Socket(Socket&&) noexcept = default;
Socket& Socket::operator=(Socket&&) noexcept = default;
Socket::~Socket() = default;

Result<Socket> Socket::open(const std::string& endpoint, bool listen,
                            std::chrono::milliseconds linger, Unconnected unconnected) {
  // ZeroMQ takes a port modulo 65536.
  const std::string port = endpoint.substr(endpoint.rfind(':') + 1);
  const bool is_number = !port.empty() && port.find_first_not_of("0123456789") == std::string::npos;
  if (is_number && (port.size() > 5 || std::stoi(port) > 65535)) {
    return Error{ErrorKind::usage, fmt::format("{}: expected a port up to 65535", endpoint)};
  }
  try {
    auto impl =
        std::make_unique<Impl>(listen ? zmq::socket_type::router : zmq::socket_type::dealer);
    set_options(impl->socket, linger);
    impl->socket.set(zmq::sockopt::immediate, unconnected == Unconnected::refuse);
    if (listen) {
      impl->socket.set(zmq::sockopt::router_mandatory, true);
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
                               Unconnected unconnected) {
  return open(endpoint, false, linger, unconnected);
}

Result<Socket> Socket::bind(const std::string& endpoint, std::chrono::milliseconds linger) {
  return open(endpoint, true, linger, Unconnected::queue);
}

bool Socket::wait_to_send(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  zmq::pollitem_t item{impl_->socket.handle(), 0, ZMQ_POLLOUT, 0};
  while (true) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    try {
      zmq::poll(&item, 1, std::max(left, std::chrono::milliseconds(0)));
    } catch (const zmq::error_t& error) {
      BATON_CHECK(error.num() == EINTR);
    }
    if (item.revents & ZMQ_POLLOUT) return true;
    if (left.count() <= 0) return false;
  }
}

bool Socket::send(const std::vector<Bytes>& frames) {
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
  // Wait for the first of message, wake-up, signal, timeout.
  std::array<zmq::pollitem_t, 2> items{zmq::pollitem_t{impl_->socket.handle(), 0, ZMQ_POLLIN, 0},
                                       zmq::pollitem_t{nullptr, impl_->wake_fd, ZMQ_POLLIN, 0}};
  try {
    zmq::poll(items.data(), items.size(), timeout);
  } catch (const zmq::error_t& error) {
    BATON_CHECK(error.num() == EINTR);
    return std::nullopt;
  }
  if (items[1].revents & ZMQ_POLLIN) {
    eventfd_t count = 0;
    ::eventfd_read(impl_->wake_fd, &count);
  }
  if (!(items[0].revents & ZMQ_POLLIN)) return std::nullopt;

  // The frames of one message arrive together.
  std::vector<Bytes> frames;
  zmq::message_t frame;
  do {
    const bool received = despite_signals(
        [&] { return impl_->socket.recv(frame, zmq::recv_flags::dontwait).has_value(); });
    if (!received) return std::nullopt;
    if (frames.size() < limits::kMaxMessageFrames) {
      const auto* data = frame.data<std::byte>();
      frames.emplace_back(data, data + frame.size());
    }
  } while (frame.more());
  return frames;
}

void Socket::wake() { ::eventfd_write(impl_->wake_fd, 1); }

const std::string& Socket::endpoint() const { return impl_->endpoint; }

}  // namespace baton
