#include "common/protocol/connection_watch.h"

#include <arpa/inet.h>
#include <linux/sockios.h>
#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
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

/// What the other end has not taken of what was written; 0: all, or there is no such connection.
int unsent_bytes(int descriptor) {
  int count = 0;
  return ::ioctl(descriptor, SIOCOUTQ, &count) == 0 ? count : 0;
}

/// Of the other end of a TCP connection, without its port; empty: it is none.
std::string address_of(int descriptor) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (::getpeername(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  const void* const number =
      address.ss_family == AF_INET
          ? static_cast<const void*>(&reinterpret_cast<const sockaddr_in*>(&address)->sin_addr)
          : &reinterpret_cast<const sockaddr_in6*>(&address)->sin6_addr;
  if (address.ss_family != AF_INET && address.ss_family != AF_INET6) return {};
  return ::inet_ntop(address.ss_family, number, text.data(), text.size()) == nullptr ? ""
                                                                                     : text.data();
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
      const int descriptor = static_cast<int>(value);
      if (const auto old = connections_.find(descriptor); old != connections_.end()) forget(old);
      connections_[descriptor] = {std::chrono::steady_clock::now(), address_of(descriptor)};
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

void ConnectionWatch::note_message(const zmq::message_t& frame, const Bytes& peer) {
  const auto found = connections_.find(::zmq_msg_get(frame.handle(), ZMQ_SRCFD));
  if (found == connections_.end()) return;
  Connection& connection = found->second;
  connection.has_spoken = true;
  if (!std::exchange(connection.is_known, true)) {
    connection.peer = peer;
    peers_[peer] = found->first;
  }
}

bool ConnectionWatch::take_place(const Bytes& peer, std::uint64_t size_bytes) {
  const auto known = peers_.find(peer);
  if (known == peers_.end()) return true;
  Connection& connection = connections_.at(known->second);
  const auto has_room = [&] {
    return connection.unread + size_bytes <= limits::kMaxUnreadBytes &&
           unread_in_all_ + size_bytes <= limits::kMaxUnreadBytesInAll;
  };
  if (!has_room()) count_unread();
  if (connection.unread > 0 && !has_room()) return false;
  connection.unread += size_bytes;
  unread_in_all_ += size_bytes;
  return true;
}

/// The library writes as long as the system takes it: where nothing waits there, nothing waits.
void ConnectionWatch::count_unread() {
  unread_in_all_ = 0;
  for (auto& [descriptor, connection] : connections_) {
    if (connection.unread > 0 && unsent_bytes(descriptor) == 0) connection.unread = 0;
    unread_in_all_ += connection.unread;
  }
}

ConnectionWatch::Connections::iterator ConnectionWatch::forget(Connections::iterator connection) {
  peers_.erase(connection->second.peer);
  unread_in_all_ -= connection->second.unread;
  return connections_.erase(connection);
}

void ConnectionWatch::close_unwelcome() {
  constexpr std::uint64_t kMaxUnendedInAll = 4 * limits::kMaxUnendedBytes;
  count_unread();
  const auto silent_since = std::chrono::steady_clock::now() - limits::kSilenceAllowed;
  std::map<std::string, int> silent;
  std::multimap<std::uint64_t, int, std::greater<>> unended;  // the most first
  std::uint64_t unended_in_all = 0;
  for (auto next = connections_.begin(); next != connections_.end();) {
    const auto& [descriptor, connection] = *next;
    const std::optional<std::uint64_t> bytes = bytes_received(descriptor);
    const std::uint64_t more =
        bytes && !connection.has_spoken ? *bytes - std::min(*bytes, connection.bytes) : 0;
    const bool is_endless = more > limits::kMaxUnendedBytes;
    const bool is_silent = bytes && !connection.is_known && connection.made < silent_since;
    const bool is_crowd = is_silent && ++silent[connection.address] > limits::kMaxSilentConnections;
    if (!bytes || is_endless || is_crowd) {
      if (bytes) close(descriptor, is_endless ? Failure::endless : Failure::crowd);
      next = forget(next);
      continue;
    }
    unended.emplace(more, descriptor);
    unended_in_all += more;
    if (std::exchange(next->second.has_spoken, false)) next->second.bytes = *bytes;
    ++next;
  }
  for (const auto& [more, descriptor] : unended) {
    if (unended_in_all <= kMaxUnendedInAll) break;
    unended_in_all -= more;
    close(descriptor, Failure::endless);
    forget(connections_.find(descriptor));
  }
}

void ConnectionWatch::close(int descriptor, Failure failure) {
  ::shutdown(descriptor, SHUT_RDWR);
  note(failure);
}

void ConnectionWatch::note(Failure failure) {
  failure_ = std::max(failure_.value_or(failure), failure);
}

}  // namespace baton
