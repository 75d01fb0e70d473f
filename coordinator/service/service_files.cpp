#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <set>

#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"
#include "coordinator/service/service.h"

// Messages that wait until files are read.

namespace baton {

namespace fs = std::filesystem;

/// Handles what need not wait any more; who waits on is told that it does.
Status Service::handle_read() {
  for (const Incoming& message : waits_->take_ready(files_)) BATON_TRY(handle(message));
  for (const FileWaits::Notice& notice : waits_->take_notices(std::chrono::steady_clock::now()))
    BATON_TRY(refuse(notice.peer, {ErrorKind::timeout, notice.text}));
  return {};
}

/// Whether a report of a failure waits: inputs of its task must be read before anybody is blamed.
/// One for which there is no place is forgotten: the worker repeats it.
bool Service::await_inputs(const std::string& worker, const TaskFailed& message) {
  const auto peer = peers_.peer_of(worker);
  const TimePoint now = std::chrono::steady_clock::now();
  const Incoming incoming{peer.value_or(PeerId()), Message(message), speaker_};
  if (waits_->join(message.lease, incoming, now)) return true;
  std::vector<fs::path> unread;
  for (const BlobRef& input : leased_inputs(message.lease)) {
    fs::path path = store_.path(input.digest);
    if (files_.must_be_read(path, input)) unread.push_back(std::move(path));
  }
  if (unread.empty()) return false;
  waits_->start(message.lease, {}, std::move(unread), incoming, now);
  return true;
}

/// Whether the message about a job waits: frames must be read that it would replace or keep.
Result<bool> Service::await_frames(const PeerId& peer, const Message& message, const Digest& job,
                                   const JobSpec& spec) {
  const TimePoint now = std::chrono::steady_clock::now();
  const Incoming incoming{peer, message, speaker_};
  if (waits_->join(job, incoming, now)) return true;
  BATON_ASSIGN(std::vector<fs::path> unread, unread_frames(spec));
  if (unread.empty()) return false;
  const std::string text = fmt::format("job '{}': looking at {} frames in {}", spec.name,
                                       unread.size(), spec.output.directory);
  spdlog::info("{}", text);
  if (!waits_->start(job, text, std::move(unread), incoming, now))
    BATON_TRY(refuse(peer, {ErrorKind::timeout, text + ", after those of other jobs"}));
  return true;
}

/// The files of the job's frames that jobs of its folder have recorded, as far as only their bytes
/// can tell whether they are as they were written.
Result<std::vector<fs::path>> Service::unread_frames(const JobSpec& job) {
  std::set<fs::path> wanted, unread;
  for (std::size_t i = 0; i < job.frames.size(); ++i)
    wanted.insert(frame_path(job, FrameIndex(static_cast<std::int32_t>(i))).lexically_normal());
  BATON_ASSIGN(const std::vector<Digest> neighbours, journal_.jobs_in(folder_of(job)));
  for (const Digest& digest : neighbours) {
    BATON_ASSIGN(const std::optional<std::string> text, journal_.document(digest));
    const Result<ParsedJobDocument> document = parse_job_document(text.value_or(""));
    if (!document) continue;
    BATON_TRY(journal_.for_each_completion(digest, [&](const Completion& done) -> Status {
      if (done.task.kind != TaskKind::assemble || done.outputs.size() != 1) return {};
      const fs::path path = frame_path(document->job, done.task.frame()).lexically_normal();
      if (wanted.contains(path) && files_.must_be_read(path, done.outputs.front()))
        unread.insert(path);
      return {};
    }));
  }
  return std::vector<fs::path>(unread.begin(), unread.end());
}

}  // namespace baton
