#include "worker/run/job_cache.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/base/file_stamp.h"
#include "common/base/limits.h"
#include "common/base/patiently.h"
#include "common/base/trace.h"
#include "common/job/plan/estimate.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "common/scene/material/detail_loader.h"
#include "common/store/folder_token.h"
#include "worker/pass/primary.h"

namespace baton {
namespace {

/// In traces.
constexpr const char* kLoading = "loading the job";

/// What the tiles in work and a frame that is assembled take, about.
std::uint64_t work_bytes(const JobSpec& job, int num_threads) {
  const JobEstimate e = estimate_job(job);
  const std::int64_t side = TileGrid(job.image).tile_size();
  const std::int64_t pixels = std::min(job.image.rendered().area(), side * side);
  const bool any_detail = std::ranges::any_of(
      job.scene.materials, [](const auto& material) { return has_detail(material.second); });
  const auto sites_of = [&](int of_pixel) { return static_cast<std::size_t>(pixels * of_pixel); };
  const std::size_t num_sites =
      std::max(sites_of(job.image.sites),
               std::min(sites_of(job.image.most_sites()), limits::kMaxSitesAtOnce));
  const auto surface_bytes =
      static_cast<std::int64_t>(TileSurfaces::size_bytes(num_sites, any_detail));
  const std::int64_t tile_bytes = surface_bytes + pixels * 4 * e.film_channels + e.tile_state_bytes;
  const std::int64_t plate_bytes =
      has_plate(job.output) ? std::int64_t{12} * job.image.width * job.image.height : 0;
  return static_cast<std::uint64_t>(num_threads * tile_bytes + e.film_bytes + e.frame_bytes +
                                    plate_bytes);
}

/// The files of a job, once each is seen to be the one that it was submitted with. Errors: those of
/// all files together; io where looking again helps.
Result<std::vector<KnownAsset>> look_at(const std::vector<AssetDigest>& files) {
  std::vector<KnownAsset> known;
  std::string faults;
  ErrorKind kind = ErrorKind::io;
  Patience patience;  // of all: a folder that is away is waited for once
  for (const AssetDigest& file : files) {
    const auto look = [&]() -> Result<KnownAsset> {
      BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(file.path));
      BATON_TRY(verify_assets({file}));  // which says where there is none
      return KnownAsset{file, stamp.value_or(FileStamp())};
    };
    const Result<KnownAsset> seen = patiently(look, patience);
    if (seen) {
      known.push_back(*seen);
      continue;
    }
    if (seen.error().kind != ErrorKind::io) kind = seen.error().kind;
    faults += (faults.empty() ? "" : "\n") + seen.error().message;
  }
  if (!faults.empty()) return Error{kind, faults};
  return known;
}

/// Error (io): a file has changed since it was looked at.
Status expect_unchanged(const std::vector<KnownAsset>& files) {
  for (const KnownAsset& known : files) {
    BATON_ASSIGN(const std::optional<FileStamp> stamp,
                 patiently([&] { return stamp_of(known.file.path); }));
    if (stamp != known.stamp)
      return Error{ErrorKind::io, known.file.path + ": changes while it is read"};
  }
  return {};
}

/// What the worker's memory leaves to the job's scene. Error: nothing.
Result<std::uint64_t> room_for_scene(const JobSpec& job, const Machine& machine) {
  const std::uint64_t work = work_bytes(job, machine.num_threads);
  const MemoryBudget& memory = machine.memory;
  if (work < memory.scene_bytes) return memory.scene_bytes - work;
  return Error{ErrorKind::bad_input,
               fmt::format("the job does not fit into memory: {} tiles in work and a frame take {} "
                           "MiB; {} MiB are for them and the scene of {} MiB (--memory)",
                           machine.num_threads, work >> 20, memory.scene_bytes >> 20,
                           memory.total_bytes >> 20)};
}

}  // namespace

Result<LoadedJobPtr> load_job_document(const JobDocument& document, const Machine& machine,
                                       AssetShelf& shelf) {
  BATON_ASSIGN(const ParsedJobDocument parsed, parse_job_document(document.json));
  if (parsed.digest != document.job) {
    return Error{ErrorKind::corrupt, fmt::format("job document {}: digest is {}",
                                                 document.job.hex(), parsed.digest.hex())};
  }
  // As this machine sees it. Frames name their maps as the job does.
  const ParsedJobDocument here{map_paths(parsed.job, machine.maps),
                               map_paths(parsed.assets, machine.maps), parsed.digest,
                               parsed.picture};
  auto loaded = std::make_shared<LoadedJob>(LoadedJob{.job = parsed.job,
                                                      .digest = document.job,
                                                      .picture = parsed.picture,
                                                      .context = nullptr,
                                                      .token = document.token,
                                                      .id = document.id,
                                                      .plates = machine.memory.pictures(),
                                                      .roots = machine.roots});
  loaded->job.output.directory = here.job.output.directory;
  // The coordinator has let it in: it is this worker that may not see all of it.
  if (const Status may = check_roots(here, machine.roots); !may) {
    loaded->unseen = "all files of the job: " + may.error().message;
    return LoadedJobPtr(std::move(loaded));
  }
  if (const Status seen = expect_output_folder(*loaded); !seen) {
    loaded->unseen = seen.error().message;
    return LoadedJobPtr(std::move(loaded));
  }

  // What changes while it is read is looked at again, and then told of.
  {
    const Span span(SpanKind::read, "digests of files");
    BATON_ASSIGN(loaded->assets, look_at(here.assets));
  }
  BATON_ASSIGN(const std::uint64_t room, room_for_scene(here.job, machine));
  BATON_ASSIGN(const auto assets, patiently([&] {
                 return shelf.get(here.job, loaded->assets, machine.memory, room);
               }));
  BATON_TRY(expect_unchanged(loaded->assets));
  BATON_ASSIGN(loaded->context,
               make_render_context(here.job, parsed.picture, assets, machine.memory));
  loaded->scene_bytes = assets->size_bytes();
  return LoadedJobPtr(std::move(loaded));
}

Status expect_output_folder(const LoadedJob& loaded, const std::stop_token& stop) {
  if (loaded.token.empty()) return {};
  const std::filesystem::path mark =
      output_token_file(loaded.job.output.directory, loaded.digest, loaded.token);
  Patience patience(stop);
  return expect_token(mark, loaded.token, &patience);
}

Status expect_unlocked(const LoadedJob& loaded, FrameIndex frame, const std::stop_token& stop) {
  if (loaded.token.empty()) return {};
  const std::filesystem::path mark =
      output_token_file(loaded.job.output.directory, loaded.digest, loaded.token);
  Patience patience(stop);
  BATON_ASSIGN(const std::string locked, read_after_token(mark, loaded.token, &patience));
  if (locked.empty()) return {};
  BATON_ASSIGN(const std::vector<FrameNumber> frames, parse_frames(locked));
  const FrameNumber number = loaded.job.frames.at(frame.index());
  if (!std::ranges::binary_search(frames, number)) return {};
  return Error{ErrorKind::cancelled, fmt::format("frame {} is locked", number.value())};
}

void JobEntry::provide(const JobDocument& document) {
  const std::lock_guard lock(mutex_);
  if (document_) return;
  document_ = document;
  changed_.notify_all();
}

std::optional<JobDocument> JobEntry::document() const {
  const std::lock_guard lock(mutex_);
  return document_;
}

bool JobEntry::failed() const {
  const std::lock_guard lock(mutex_);
  return result_ && (!result_->ok() || !result_->value()->unseen.empty());
}

LoadedJobPtr JobEntry::loaded() const {
  const std::lock_guard lock(mutex_);
  return result_ && result_->ok() ? result_->value() : nullptr;
}

Result<LoadedJobPtr> JobEntry::load(const std::stop_token& stop) {
  // Wait until there is something to do or to return.
  std::unique_lock lock(mutex_);
  const auto is_ready = [this] { return result_ || (document_ && !loading_); };
  const bool ready = is_ready() || [&] {
    const Span wait(SpanKind::wait, kLoading);
    return changed_.wait(lock, stop, is_ready);
  }();
  if (!ready) return Error{ErrorKind::cancelled, "stopped while waiting for the job to load"};
  if (result_) return *result_;

  // Load without the lock: it may take long, and others only wait.
  const Span span(SpanKind::make, kLoading);
  loading_ = true;
  lock.unlock();
  Result<LoadedJobPtr> result = loader_(*document_);

  lock.lock();
  if (!result && result.error().kind == ErrorKind::io) {
    spdlog::warn("waits {} s: {}", file_patience_.count() / 1000, result.error().message);
    changed_.wait_for(lock, stop, file_patience_, [] { return false; });
    lock.unlock();
    if (!stop.stop_requested()) result = loader_(*document_);
    lock.lock();
  }
  if (result) {
    LoadedJob job = **result;
    job.states = states_;
    result = LoadedJobPtr(std::make_shared<const LoadedJob>(std::move(job)));
  }
  result_ = result;
  changed_.notify_all();
  return result;
}

bool JobCache::has_room_for_another() const {
  std::uint64_t scene_bytes = 0;
  for (const LoadedJobPtr& job : loaded()) scene_bytes += job->scene_bytes;
  return entries_.size() < limits::kMaxCachedJobs && scene_bytes <= max_idle_scene_bytes_;
}

std::vector<LoadedJobPtr> JobCache::loaded() const {
  std::vector<LoadedJobPtr> jobs;
  for (const std::shared_ptr<JobEntry>& entry : entries_) {
    if (LoadedJobPtr job = entry->loaded()) jobs.push_back(std::move(job));
  }
  return jobs;
}

bool JobCache::has_entry(const Digest& digest) const {
  return std::ranges::any_of(entries_,
                             [&](const auto& entry) { return entry->digest() == digest; });
}

/// Where one job lacks it, what those without a scene hold makes room.
void JobCache::make_room_for_states() {
  bool is_lacking = false;
  for (const auto& [job, states] : states_) is_lacking |= states->take_lack_of_room();
  if (!is_lacking) return;
  std::erase_if(states_, [&](const auto& of_job) { return !has_entry(of_job.first); });
}

std::shared_ptr<JobEntry> JobCache::entry(const Digest& digest) {
  make_room_for_states();

  // Move the job to the front.
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const auto& entry) { return entry->digest() == digest; });
  if (found != entries_.end()) {
    if (!(*found)->failed()) {
      entries_.splice(entries_.begin(), entries_, found);
      return entries_.front();
    }
    entries_.erase(found);
  }

  // Make room. A job that tasks still use stays: a document that arrives for it must find it.
  for (auto oldest = entries_.end(); oldest != entries_.begin() && !has_room_for_another();) {
    --oldest;
    if (oldest->use_count() > 1) continue;
    oldest = entries_.erase(oldest);
  }
  for (const auto& [job, states] : states_) states->drop_kept();
  std::erase_if(states_, [&](const auto& of_job) {
    return !has_entry(of_job.first) && !of_job.second->holds_any();
  });
  std::shared_ptr<JobStates>& states = states_[digest];
  if (states == nullptr) states = std::make_shared<JobStates>(state_memory_);
  entries_.push_front(std::make_shared<JobEntry>(digest, loader_, states, file_patience_));
  return entries_.front();
}

}  // namespace baton
