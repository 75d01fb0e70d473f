#include "coordinator/service/evidence.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cerrno>

#include "common/base/file_descriptor.h"
#include "common/base/file_stamp.h"
#include "common/base/limits.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// The job of a task that is not done; null: there is none.
const Scheduler::Job* job_of_open_task(const FarmCore& farm, const LeaseId& lease) {
  const Scheduler::Job* job = farm.scheduler.find_job(lease.job);
  const auto task = job ? job->tasks.graph().find(lease.task) : std::nullopt;
  return task && job->tasks.book().status(*task) != TaskStatus::done ? job : nullptr;
}

/// The blobs that a leased task of an open job reads; none where one is being made again.
std::vector<BlobRef> leased_inputs(const FarmCore& farm, const LeaseId& lease) {
  const Scheduler::Job* job = job_of_open_task(farm, lease);
  if (job == nullptr) return {};
  const TaskIndex task = *job->tasks.graph().find(lease.task);
  const TaskBook& book = job->tasks.book();
  if (book.status(task) != TaskStatus::leased || !book.has_inputs(task)) return {};
  std::vector<BlobRef> inputs = job->tasks.ledger().inputs(job->tasks.view(), task);
  std::erase_if(inputs, [](const BlobRef& input) { return input.is_held(); });
  return inputs;
}

/// Whether the first byte of a plain file can be read; also of one that is not there.
bool is_readable(const fs::path& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) return errno == ENOENT || errno == ENOTDIR;
  std::byte first{};
  return ::pread(file.number(), &first, 1, 0) >= 0;
}

/// Nothing can be written into a folder, or into the one where it would be made; nullopt: it can.
std::optional<Hindrance> closed_folder(fs::path folder) {
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    return Hindrance{"a folder in the place of " + folder.string()};
  if (::access(folder.c_str(), R_OK | W_OK | X_OK) == 0) return std::nullopt;
  return Hindrance{"a folder that can be written: " + folder.string()};
}

std::optional<Hindrance> frame_hindrance(const fs::path& frame) {
  const auto stamp = stamp_of(frame);
  if (!stamp) return Hindrance{"a frame's place: " + stamp.error().message, /*stays=*/true};
  if (!is_readable(frame))
    return Hindrance{"a frame's place: what is in " + frame.string() + " cannot be read",
                     /*stays=*/true};
  return closed_folder(frame.parent_path());
}

/// Blobs and documents lie one folder deeper.
std::optional<Hindrance> store_hindrance(const fs::path& store) {
  if (auto closed = closed_folder(store)) return closed;
  std::error_code error;
  for (fs::directory_iterator entry(store, error), end; !error && entry != end;
       entry.increment(error)) {
    if (!BlobStore::is_folder(entry->path())) continue;
    std::error_code gone;
    if (!entry->is_directory(gone) &&
        entry->symlink_status(gone).type() != fs::file_type::not_found)
      return Hindrance{"a folder in the place of " + entry->path().string()};
    if (auto closed = closed_folder(entry->path())) return closed;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Digest> find_missing_blob(const FarmCore& farm, const TaskDone& report) {
  // Blobs of a task that was done before may have served their purpose.
  if (job_of_open_task(farm, report.lease) == nullptr) return std::nullopt;
  for (const BlobRef& output : report.made.outputs) {
    if (output.kind != BlobKind::image && !output.is_held() && !farm.store.contains(output.digest))
      return output.digest;
  }
  return std::nullopt;
}

std::optional<ReportedFrame> find_reported_frame(const FarmCore& farm, const TaskDone& report) {
  const Scheduler::Job* job = job_of_open_task(farm, report.lease);
  if (job == nullptr || report.lease.task.kind != TaskKind::assemble ||
      report.made.outputs.size() != 1)
    return std::nullopt;
  const BlobRef& image = report.made.outputs.front();
  ReportedFrame frame{frame_path(job->spec, report.lease.task.frame()), image.digest,
                      std::optional<FileStamp>()};
  frame.stamp = stamp_of(frame.path);
  if (frame.stamp && *frame.stamp && (*frame.stamp)->size_bytes != image.size_bytes)
    frame.stamp = std::optional<FileStamp>();
  frame.is_as_written = frame.stamp && *frame.stamp && **frame.stamp == report.frame;
  return frame;
}

std::optional<Hindrance> find_hindrance(const FarmCore& farm, const LeaseId& lease) {
  const Scheduler::Job* job = job_of_open_task(farm, lease);
  if (job == nullptr) return std::nullopt;
  std::optional<Hindrance> found;
  if (lease.task.kind == TaskKind::assemble)
    found = frame_hindrance(frame_path(job->spec, lease.task.frame()));
  return found ? found : store_hindrance(farm.store_directory);
}

std::optional<std::vector<BlobRef>> find_bad_inputs(const FarmCore& farm, FileTable& files,
                                                    const LeaseId& lease) {
  std::vector<BlobRef> bad;
  const Scheduler::Job* job = job_of_open_task(farm, lease);
  if (job == nullptr) return std::nullopt;
  const TaskIndex task = *job->tasks.graph().find(lease.task);
  if (job->tasks.book().status(task) != TaskStatus::leased) return std::nullopt;
  if (!job->tasks.book().has_inputs(task)) return bad;
  std::error_code error;
  if (!fs::is_directory(farm.store_directory, error)) return std::nullopt;
  for (const BlobRef& input : leased_inputs(farm, lease)) {
    const fs::path path = farm.store.path(input.digest);
    const FileState state = files.judge(path, input).state;
    if (state != FileState::right && state != FileState::unknown) bad.push_back(input);
    files.forget(path);
  }
  if (bad.empty()) return std::nullopt;
  return bad;
}

Status wait_for_disk(FarmCore& farm, const std::string& worker, const LeaseId& lease,
                     const Hindrance& hindrance, const std::string& why) {
  const std::string told = why.substr(0, limits::kMaxTextLength);
  const std::string waits = hindrance.lacks.ends_with(told)
                                ? hindrance.lacks
                                : fmt::format("{}: {}", hindrance.lacks, told);
  const Scheduler::Job* const job = farm.scheduler.find_job(lease.job);
  const bool pauses = job != nullptr && hindrance.stays && job->waits.starts_with(hindrance.lacks);
  if (!pauses) spdlog::warn("job {} waits for {}", farm.history.name_of(lease.job), waits);
  BATON_TRY(farm.step(SpaceLacking{worker, lease, waits}));
  return pauses ? farm.step(JobPaused{lease.job, waits}) : Status();
}

std::vector<FileToRead> unread_inputs(const FarmCore& farm, const FileTable& files,
                                      const LeaseId& lease) {
  std::vector<FileToRead> unread;
  for (const BlobRef& input : leased_inputs(farm, lease)) {
    fs::path path = farm.store.path(input.digest);
    if (files.judge(path, input).state == FileState::unknown) unread.push_back({std::move(path)});
  }
  return unread;
}

}  // namespace baton
