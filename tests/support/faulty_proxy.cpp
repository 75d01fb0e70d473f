// faulty_proxy LISTEN COORDINATOR RECORD: stands between workers and a coordinator, passes on what
// they say, and does to single messages what networks do.
//
// Standard input, one command a line: "NUMBER drop|double|delay TYPE MS" strikes the next message
// of this type (a double comes after MS milliseconds, a delayed one then only); "NUMBER none"
// forgets a command that has not struck. It ends when the input does.
//
// RECORD is what a witness saw, one line each: "MS struck NUMBER", once more when a message goes on
// late; "MS WORKER back SILENCE_MS" when a worker speaks after seconds of silence; "MS WORKER epoch
// EPOCH" of each welcome; and for each lease that a message is about, before it
// is struck, "MS WORKER TYPE JOB KIND STEP TILE ATTEMPT EPOCH [OUTPUT...]", where OUTPUT is
// KIND:FRAME:DIGEST; kinds are numbers. MS: of a clock that only goes forward.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <list>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "common/protocol/messages.h"
#include "common/protocol/socket.h"

namespace baton {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// A worker that has said nothing for so long is gone, and its connection is closed.
constexpr std::chrono::seconds kForgotten{120};
constexpr std::chrono::seconds kSilence{2};
constexpr milliseconds kTurn{1};

struct MessageType {
  std::string_view name;
  std::size_t index;
};
template <class M>
std::size_t index_of() {
  static const std::size_t index = Message(M{}).index();
  return index;
}
/// The types that a command may name.
std::vector<MessageType> message_types() {
  return {{"WorkerHello", index_of<WorkerHello>()},
          {"WorkerWelcome", index_of<WorkerWelcome>()},
          {"LeaseRequest", index_of<LeaseRequest>()},
          {"LeaseGrant", index_of<LeaseGrant>()},
          {"LeaseRevoke", index_of<LeaseRevoke>()},
          {"Heartbeat", index_of<Heartbeat>()},
          {"TaskDone", index_of<TaskDone>()},
          {"TaskFailed", index_of<TaskFailed>()},
          {"ReportReceived", index_of<ReportReceived>()},
          {"NoWork", index_of<NoWork>()},
          {"JobDocument", index_of<JobDocument>()},
          {"JobDocumentRequest", index_of<JobDocumentRequest>()}};
}

enum class Harm { drop, twice, delay };

struct Command {
  int number = 0;
  Harm harm = Harm::drop;
  std::size_t type = 0;
  milliseconds delay{0};
};

/// A message on its way: from a worker, or to it.
struct Passing {
  Bytes worker;
  bool to_coordinator = false;
  std::vector<Bytes> frames;  ///< without the worker's identity
};

std::string describe(const LeaseId& lease) {
  return fmt::format("{} {} {} {} {} {}", lease.job.hex(), static_cast<int>(lease.task.kind),
                     lease.task.position, lease.task.tile, lease.attempt, lease.epoch);
}

/// What the record says of a message after the worker: a text for each lease that it is about.
std::vector<std::string> describe(const Message& message) {
  std::vector<std::string> texts;
  if (const auto* hello = std::get_if<WorkerHello>(&message)) {
    for (const LeaseId& lease : hello->running) texts.push_back("WorkerHello " + describe(lease));
  }
  if (const auto* grant = std::get_if<LeaseGrant>(&message))
    texts.push_back("LeaseGrant " + describe(grant->lease));
  if (const auto* revoke = std::get_if<LeaseRevoke>(&message))
    texts.push_back("LeaseRevoke " + describe(revoke->lease));
  if (const auto* failed = std::get_if<TaskFailed>(&message))
    texts.push_back("TaskFailed " + describe(failed->lease));
  if (const auto* received = std::get_if<ReportReceived>(&message))
    texts.push_back("ReportReceived " + describe(received->lease));
  if (const auto* done = std::get_if<TaskDone>(&message)) {
    std::string text = "TaskDone " + describe(done->lease);
    for (const BlobRef& output : done->made.outputs) {
      if (output.is_held()) continue;  // no bytes that anybody could compare
      text += fmt::format(" {}:{}:{}", static_cast<int>(output.kind), output.position,
                          output.digest.hex());
    }
    texts.push_back(text);
  }
  return texts;
}

class Proxy {
 public:
  Proxy(Socket front, std::string coordinator, std::FILE* record)
      : front_(std::move(front)), coordinator_(std::move(coordinator)), record_(record) {}

  void run() {
    ::fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    while (read_commands()) {
      turn();
      std::fflush(record_);
    }
  }

 private:
  struct Line {
    Socket socket;
    int number = 0;
    Clock::time_point last_heard;
  };
  struct Late {
    Clock::time_point due;
    Passing message;
    int number = 0;  ///< of the command
  };

  void turn() {
    // What has come, from either side.
    std::optional<std::vector<Bytes>> frames = front_.receive(kTurn);
    for (; frames; frames = front_.receive(milliseconds(0))) {
      Bytes worker = std::move(frames->front());
      frames->erase(frames->begin());
      if (Line* const line = line_of(worker)) {
        const auto now = Clock::now();
        const auto silence = std::chrono::duration_cast<milliseconds>(now - line->last_heard);
        if (silence > kSilence)
          fmt::print(record_, "{} {} back {}\n", now_ms(), line->number, silence.count());
        line->last_heard = now;
        pass({std::move(worker), true, std::move(*frames)}, line->number);
      }
    }
    for (auto& [worker, line] : lines_) {
      while (auto answer = line.socket.receive(milliseconds(0)))
        pass({worker, false, std::move(*answer)}, line.number);
    }

    // What was kept back.
    const auto now = Clock::now();
    for (auto late = late_.begin(); late != late_.end();) {
      if (late->due > now) {
        ++late;
        continue;
      }
      fmt::print(record_, "{} struck {}\n", now_ms(), late->number);
      send(late->message);
      late = late_.erase(late);
    }
    std::erase_if(lines_,
                  [&](const auto& line) { return now - line.second.last_heard > kForgotten; });
  }

  Line* line_of(const Bytes& worker) {
    const auto found = lines_.find(worker);
    if (found != lines_.end()) return &found->second;
    Result<Socket> socket = Socket::connect(coordinator_, milliseconds(0));
    if (!socket) return nullptr;
    Line line{std::move(socket).value(), next_number_++, Clock::now()};
    return &lines_.emplace(worker, std::move(line)).first->second;
  }

  /// Records a message, and lets it through unless a command waits for its type.
  void pass(Passing message, int worker) {
    const Result<Message> decoded = decode_message(message.frames);
    if (!decoded) return send(message);
    if (const auto* const welcome = std::get_if<WorkerWelcome>(&*decoded))
      fmt::print(record_, "{} {} epoch {}\n", now_ms(), worker, welcome->epoch);
    for (const std::string& text : describe(*decoded))
      fmt::print(record_, "{} {} {}\n", now_ms(), worker, text);

    if (!command_ || command_->type != decoded->index()) return send(message);
    fmt::print(record_, "{} struck {}\n", now_ms(), command_->number);
    const Command command = *std::exchange(command_, std::nullopt);
    if (command.harm == Harm::twice) send(message);
    if (command.harm != Harm::drop)
      late_.push_back({Clock::now() + command.delay, std::move(message), command.number});
  }

  void send(const Passing& message) {
    if (message.to_coordinator) {
      if (Line* const line = line_of(message.worker)) line->socket.send(message.frames);
      return;
    }
    std::vector<Bytes> frames = message.frames;
    frames.insert(frames.begin(), message.worker);
    front_.send(frames);
  }

  /// False when nobody is there any more to give commands.
  bool read_commands() {
    std::array<char, 256> buffer;
    const ssize_t count = ::read(STDIN_FILENO, buffer.data(), buffer.size());
    if (count == 0) return false;
    if (count > 0) input_.append(buffer.data(), static_cast<std::size_t>(count));
    for (std::size_t end = input_.find('\n'); end != std::string::npos; end = input_.find('\n')) {
      obey(input_.substr(0, end));
      input_.erase(0, end + 1);
    }
    return true;
  }

  void obey(const std::string& line) {
    std::istringstream text(line);
    Command command;
    std::string harm, type;
    std::int64_t delay_ms = 0;
    text >> command.number >> harm >> type >> delay_ms;
    command.delay = milliseconds(delay_ms);
    command_.reset();
    if (harm == "none") return;
    command.harm = harm == "drop" ? Harm::drop : harm == "double" ? Harm::twice : Harm::delay;
    for (const MessageType& known : message_types()) {
      if (known.name != type) continue;
      command.type = known.index;
      command_ = command;
    }
    if (!command_) fmt::print(stderr, "faulty_proxy: not understood: {}\n", line);
  }

  static std::int64_t now_ms() {
    return std::chrono::duration_cast<milliseconds>(Clock::now().time_since_epoch()).count();
  }

  Socket front_;
  std::string coordinator_;
  std::FILE* record_;
  std::map<Bytes, Line> lines_;  ///< by the worker's connection
  int next_number_ = 0;
  std::optional<Command> command_;
  std::list<Late> late_;
  std::string input_;
};

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  using namespace baton;
  if (argc != 4) {
    fmt::print(stderr, "usage: {} LISTEN COORDINATOR RECORD\n", argv[0]);
    return 64;
  }
  std::FILE* const record = std::fopen(argv[3], "a");
  Result<Socket> front = Socket::bind(argv[1], milliseconds(0));
  if (record == nullptr || !front) {
    fmt::print(stderr, "{}\n", front ? std::string(argv[3]) : front.error().message);
    return 1;
  }
  fmt::print(record, "0 ready {}\n", front->endpoint());
  Proxy(std::move(front).value(), argv[2], record).run();
  std::fclose(record);
  return 0;
}
