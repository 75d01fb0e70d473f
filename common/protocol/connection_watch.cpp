#include "common/protocol/connection_watch.h"

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>

#include "common/base/check.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr const char* kWatchEndpoint = "inproc://connections";

/// What has come over a TCP connection so far; nullopt: the descriptor is none.
std::optional<std::uint64_t> bytes_received(int descriptor) {
  tcp_info info{};
  socklen_t size = sizeof(info);
  if (::getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return std::nullopt;
  return info.tcpi_bytes_received;
}

}  // namespace

std::vector<std::string> receive_frames(zmq::socket_t& socket) {
  std::vector<std::string> frames;
  zmq::message_t frame;
  do {
    if (!socket.recv(frame, zmq::recv_flags::dontwait)) break;
    frames.push_back(frame.to_string());
  } while (frame.more());
  return frames;
}

ConnectionWatch::ConnectionWatch(zmq::context_t& context, zmq::socket_t& watched, Hears what)
    : watched_(watched), events_(context, zmq::socket_type::pair) {
  constexpr int kFailures = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                            ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
  constexpr int kConnections = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_CONNECTED;
  const int heard = (what.handshakes ? kFailures : 0) | (what.connections ? kConnections : 0);
  BATON_CHECK(::zmq_socket_monitor(watched_.handle(), kWatchEndpoint, heard) == 0);
  events_.set(zmq::sockopt::linger, 0);
  events_.set(zmq::sockopt::rcvhwm, 0);  // a full queue would stop the thread that reports
  events_.connect(kWatchEndpoint);
}

ConnectionWatch::~ConnectionWatch() { ::zmq_socket_monitor(watched_.handle(), nullptr, 0); }

bool ConnectionWatch::poll() {
  bool has_failed = false;
  while (true) {
    const std::vector<std::string> event = receive_frames(events_);
    std::uint16_t number = 0;
    std::uint32_t value = 0;
    if (event.empty() || event[0].size() < sizeof(number) + sizeof(value)) return has_failed;
    std::memcpy(&number, event[0].data(), sizeof(number));
    std::memcpy(&value, event[0].data() + sizeof(number), sizeof(value));
    if (number == ZMQ_EVENT_ACCEPTED) {
      connections_[static_cast<int>(value)] = {};
      continue;
    }
    if (number == ZMQ_EVENT_CONNECTED) {
      was_connected_ = true;
      continue;
    }
    has_failed = true;
    const bool is_replayed = number == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL &&
                             value == ZMQ_PROTOCOL_ERROR_ZMTP_INVALID_SEQUENCE;
    note(number == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH ? Failure::denied
         : is_replayed                             ? Failure::replayed
                                                   : Failure::broken_off);
  }
}

void ConnectionWatch::note_message(const zmq::message_t& frame) {
  const auto found = connections_.find(::zmq_msg_get(frame.handle(), ZMQ_SRCFD));
  if (found != connections_.end()) found->second.has_spoken = true;
}

void ConnectionWatch::close_endless() {
  for (auto next = connections_.begin(); next != connections_.end();) {
    const auto [descriptor, connection] = *next;
    const std::optional<std::uint64_t> bytes = bytes_received(descriptor);
    const bool is_endless =
        bytes && !connection.has_spoken && *bytes > connection.bytes + limits::kMaxUnendedBytes;
    if (is_endless) {
      ::shutdown(descriptor, SHUT_RDWR);
      note(Failure::endless);
    }
    if (!bytes || is_endless) {
      next = connections_.erase(next);
      continue;
    }
    if (connection.has_spoken) next->second = {*bytes, false};
    ++next;
  }
}

void ConnectionWatch::note(Failure failure) {
  failure_ = std::max(failure_.value_or(failure), failure);
}

}  // namespace baton
