#include "common/protocol/messages.h"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "common/base/archive.h"
#include "common/base/legible.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr std::size_t kNumFrames = 3;
constexpr std::size_t kNumTypes = std::variant_size_v<Message>;

template <class T, class... Types>
constexpr bool kIsOneOf = (std::is_same_v<T, Types> || ...);

/// The most that a body of type T may have. What a worker says is short: the coordinator, which
/// hears a thousand of them, must never be long about one.
template <class T>
constexpr std::uint64_t kMaxBodyBytes =
    kIsOneOf<T, WorkerHello, LeaseRequest, Heartbeat, TaskDone, TaskFailed, LeaseReturn,
             JobDocumentRequest, StatesPublished, BlobsLeft, WorkerGoodbye>
        ? limits::kMaxWorkerMessageBytes
        : limits::kMaxMessageBytes;

/// Nothing of these is made legible: documents, whose bytes their digests are of, and paths that
/// are opened.
template <class T>
constexpr bool kIsVerbatim = kIsOneOf<T, SubmitJob, JobDocument, WorkerWelcome, PictureSource>;
/// What these say may be several lines; any other says names.
template <class T>
constexpr bool kHasLines =
    kIsOneOf<T, TaskDone, TaskFailed, LeaseReturn, JobAccepted, JobList, ShownJob, EventList,
             ReasonChain, TaskList, RequeuePlan, Refused>;

/// Makes every text of a value legible.
class LegibleTexts {
 public:
  using Legible = std::string(std::string_view);
  explicit LegibleTexts(Legible* legible) : legible_(legible) {}

  void make(std::string& text) const { text = legible_(text); }
  template <class T>
  void make(std::vector<T>& values) const {
    for (T& value : values) make(value);
  }
  template <class T, std::size_t N>
  void make(std::array<T, N>& values) const {
    for (T& value : values) make(value);
  }
  template <class T>
  requires std::is_aggregate_v<T>
  void make(T& value) const {
    std::apply([&](auto&... members) { (make(members), ...); }, members_of(value));
  }
  /// A number.
  template <class T>
  void make(T& /*value*/) const {}

 private:
  Legible* legible_;
};

template <std::size_t Type>
Result<Message> decode_body(ByteView body) {
  std::variant_alternative_t<Type, Message> message;
  if (constexpr std::uint64_t most = kMaxBodyBytes<decltype(message)>; body.size() > most) {
    return Error{ErrorKind::bad_input,
                 fmt::format("message: type {}: a body of {} bytes, at most {} are read", Type,
                             body.size(), most)};
  }
  ArchiveReader reader(body);
  reader(message);
  if (!reader.complete()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("message: type {}: {} bytes are no valid body", Type, body.size())};
  }
  if constexpr (!kIsVerbatim<decltype(message)>)
    LegibleTexts(kHasLines<decltype(message)> ? legible_text : legible_line).make(message);
  return Message(std::move(message));
}

template <std::size_t... Types>
constexpr auto make_decoders(std::index_sequence<Types...>) {
  return std::array{&decode_body<Types>...};
}
constexpr auto kDecoders = make_decoders(std::make_index_sequence<kNumTypes>());

Status check_header(ByteView header) {
  ByteReader reader(header);
  const std::string_view expected_name = kProtocolName;
  const ByteView name = reader.get_raw(expected_name.size());
  const auto version = reader.get<std::uint16_t>();
  if (!reader.ok() || !reader.at_end() ||
      std::memcmp(name.data(), expected_name.data(), name.size()) != 0) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("message: the first frame does not name the protocol {}", kProtocolName)};
  }
  if (version != kProtocolVersion) {
    return Error{ErrorKind::version, fmt::format("message: protocol version {}, this program "
                                                 "speaks {}: a farm takes programs of one version",
                                                 version, kProtocolVersion)};
  }
  return {};
}

}  // namespace

std::string WorkerHello::own_name() const {
  return fmt::format("{}#{:08x}", worker_id, static_cast<std::uint32_t>(instance));
}

std::vector<Bytes> encode_message(const Message& message) {
  ByteWriter header;
  header.put_raw(as_bytes_view(kProtocolName));
  header.put(kProtocolVersion);
  ByteWriter type;
  type.put(static_cast<std::uint16_t>(message.index()));
  return {header.take(), type.take(),
          std::visit([](const auto& body) { return to_bytes(body); }, message)};
}

Result<Message> decode_message(const std::vector<Bytes>& frames) {
  // The first frame decides whether the rest may be understood.
  if (frames.empty()) return Error{ErrorKind::bad_input, "message: no frames"};
  BATON_TRY(check_header(frames[0]));
  if (frames.size() != kNumFrames) {
    return Error{ErrorKind::bad_input,
                 fmt::format("message: {} frames, expected {}", frames.size(), kNumFrames)};
  }

  ByteReader reader(frames[1]);
  const auto type = reader.get<std::uint16_t>();
  if (!reader.ok() || !reader.at_end()) {
    return Error{ErrorKind::bad_input, fmt::format("message: a type of {} bytes, expected {}",
                                                   frames[1].size(), sizeof(type))};
  }
  if (type >= kNumTypes) {
    return Error{ErrorKind::bad_input,
                 fmt::format("message: unknown type {}, expected less than {}", type, kNumTypes)};
  }
  return kDecoders[type](frames[2]);
}

}  // namespace baton
