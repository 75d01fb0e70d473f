#include "common/protocol/doorkeeper.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>
#include <vector>

#include "common/base/check.h"

namespace baton {
namespace {

constexpr const char* kZapEndpoint = "inproc://zeromq.zap.01";
constexpr const char* kZapVersion = "1.0";
constexpr std::size_t kZapFields =
    7;  // version, request, domain, address, identity, mechanism, key
constexpr std::size_t kKeyBytes = 32;
constexpr const char* kWatchEndpoint = "inproc://handshakes";

/// All frames of the next message; empty: there is none.
std::vector<std::string> receive_all(zmq::socket_t& socket) {
  std::vector<std::string> frames;
  zmq::message_t frame;
  do {
    if (!socket.recv(frame, zmq::recv_flags::dontwait)) break;
    frames.push_back(frame.to_string());
  } while (frame.more());
  return frames;
}

}  // namespace

Doorkeeper::Doorkeeper(zmq::context_t& context, std::map<std::string, Speaker> known)
    : known_(std::move(known)), questions_(context, zmq::socket_type::rep) {
  questions_.set(zmq::sockopt::linger, 0);
  questions_.bind(kZapEndpoint);
}

void Doorkeeper::answer() {
  while (true) {
    const std::vector<std::string> question = receive_all(questions_);
    if (question.empty()) return;
    std::array<char, 41> key{};
    const bool is_curve =
        question.size() == kZapFields && question[5] == "CURVE" && question[6].size() == kKeyBytes;
    if (is_curve)
      ::zmq_z85_encode(key.data(), reinterpret_cast<const std::uint8_t*>(question[6].data()),
                       kKeyBytes);
    const bool known = is_curve && known_.contains(key.data());
    if (!known)
      refusal_ = fmt::format("a connection from {}: its key is not known here",
                             question.size() > 3 ? question[3] : "somewhere");

    const std::array<std::string, 6> reply{kZapVersion,
                                           question.size() > 1 ? question[1] : "",
                                           known ? "200" : "400",
                                           known ? "" : "the key is not known",
                                           known ? std::string(key.data()) : "",
                                           ""};
    for (std::size_t i = 0; i < reply.size(); ++i) {
      const auto more = i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none;
      questions_.send(zmq::buffer(reply[i]), more);
    }
  }
}

HandshakeWatch::HandshakeWatch(zmq::context_t& context, zmq::socket_t& watched)
    : watched_(watched), events_(context, zmq::socket_type::pair) {
  constexpr int kFailures = ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                            ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
  BATON_CHECK(::zmq_socket_monitor(watched_.handle(), kWatchEndpoint, kFailures) == 0);
  events_.set(zmq::sockopt::linger, 0);
  events_.set(zmq::sockopt::rcvhwm, 0);  // a full queue would stop the thread that reports
  events_.connect(kWatchEndpoint);
}

HandshakeWatch::~HandshakeWatch() { ::zmq_socket_monitor(watched_.handle(), nullptr, 0); }

void HandshakeWatch::look() {
  while (true) {
    const std::vector<std::string> event = receive_all(events_);
    std::uint16_t number = 0;
    std::uint32_t reason = 0;
    if (event.empty() || event[0].size() < sizeof(number) + sizeof(reason)) return;
    std::memcpy(&number, event[0].data(), sizeof(number));
    std::memcpy(&reason, event[0].data() + sizeof(number), sizeof(reason));
    const bool is_replayed = number == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL &&
                             reason == ZMQ_PROTOCOL_ERROR_ZMTP_INVALID_SEQUENCE;
    const Failure failure = number == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH ? Failure::denied
                            : is_replayed                             ? Failure::replayed
                                                                      : Failure::broken_off;
    failure_ = std::max(failure_.value_or(failure), failure);
  }
}

}  // namespace baton
