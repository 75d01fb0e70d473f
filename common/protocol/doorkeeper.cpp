#include "common/protocol/doorkeeper.h"

#include <fmt/format.h>

#include <array>
#include <utility>
#include <vector>

#include "common/protocol/connection_watch.h"

namespace baton {
namespace {

constexpr const char* kZapEndpoint = "inproc://zeromq.zap.01";
constexpr const char* kZapVersion = "1.0";
constexpr std::size_t kZapFields =
    7;  // version, request, domain, address, identity, mechanism, key
constexpr std::size_t kKeyBytes = 32;

}  // namespace

Doorkeeper::Doorkeeper(zmq::context_t& context, std::map<std::string, Speaker> known)
    : known_(std::move(known)), questions_(context, zmq::socket_type::rep) {
  questions_.set(zmq::sockopt::linger, 0);
  questions_.bind(kZapEndpoint);
}

void Doorkeeper::answer() {
  while (true) {
    const std::vector<std::string> question = receive_frames(questions_);
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

}  // namespace baton
