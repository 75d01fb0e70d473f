#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/job/job_spec.h"
#include "common/job/text/path_maps.h"
#include "common/job/text/roots.h"
#include "common/protocol/messages.h"
#include "worker/pass/memory_budget.h"
#include "worker/pass/shared_assets.h"
#include "worker/pass/tile_renderer.h"
#include "worker/run/job_states.h"

namespace baton {

/// A job with all its assets in memory; shared by every task of it.
struct LoadedJob {
  /// As submitted, but for its output folder, which is where this machine has it.
  JobSpec job;
  Digest digest, picture;
  std::shared_ptr<const RenderContext> context;
  /// Those of the process; with no memory nothing is kept.
  std::shared_ptr<JobStates> states = std::make_shared<JobStates>(std::make_shared<MemoryShare>(0));
  std::uint64_t scene_bytes = 0;
  /// What this machine does not see of the job, a line; then nothing of it is loaded.
  std::string unseen = {};
  std::string token = {};  ///< JobDocument::token
  JobId id = {};           ///< of which job it is a version
  /// Files that the job reads, where this machine has them.
  std::vector<KnownAsset> assets = {};
  PixelLimit plates = {};  ///< MemoryBudget::pictures
  Roots roots = {};        ///< Machine::roots
};

using LoadedJobPtr = std::shared_ptr<const LoadedJob>;
/// Turns a job document into a loaded job.
using JobLoader = std::function<Result<LoadedJobPtr>(const JobDocument& document)>;

/// What is particular to a worker's machine.
struct Machine {
  PathMaps maps = {};  ///< folders that lie elsewhere here
  /// Folders that jobs may read from and write to; empty: all.
  Roots roots = {};
  MemoryBudget memory = MemoryBudget::of_machine();
  int num_threads = 1;  ///< tiles that are in work at once
};

/// The loader of the worker: parses the document, checks its digest, the folders and the digests of
/// the assets, and loads the scene, or shares it with a job on the shelf.
Result<LoadedJobPtr> load_job_document(const JobDocument& document, const Machine& machine,
                                       AssetShelf& shelf);

/// Whether the job's output folder is the one that the coordinator has marked.
Status expect_output_folder(const LoadedJob& loaded, const std::stop_token& stop = {});
/// That, and the mark does not say that the frame is locked. Error of its own: cancelled.
Status expect_unlocked(const LoadedJob& loaded, FrameIndex frame, const std::stop_token& stop);

/// How long a file that cannot be read is waited for before the attempt counts as failed: a disk of
/// another machine may be away for a moment.
inline constexpr std::chrono::milliseconds kFilePatience{5000};

/// One job on its way from document to loaded scene. The first task that needs it loads it, the
/// others wait.
class JobEntry {
 public:
  /// states: that the process has of the job; not null.
  JobEntry(const Digest& digest, JobLoader loader, std::shared_ptr<JobStates> states,
           std::chrono::milliseconds file_patience = kFilePatience)
      : digest_(digest),
        loader_(std::move(loader)),
        states_(std::move(states)),
        file_patience_(file_patience) {}

  const Digest& digest() const { return digest_; }
  /// Hands over the document; a second one is ignored.
  void provide(const JobDocument& document);
  std::optional<JobDocument> document() const;
  /// True once loading has failed, or the machine has not seen the job's folders.
  bool failed() const;
  /// Null unless it is loaded.
  LoadedJobPtr loaded() const;
  /// Waits for the document, then loads once for all callers; once more after a while if a file
  /// could not be read (ErrorKind::io). Cancelled when `stop` is requested while waiting.
  Result<LoadedJobPtr> load(const std::stop_token& stop);

 private:
  const Digest digest_;
  const JobLoader loader_;
  const std::shared_ptr<JobStates> states_;
  const std::chrono::milliseconds file_patience_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<JobDocument> document_;
  bool loading_ = false;
  std::optional<Result<LoadedJobPtr>> result_;
};

/// The jobs that this process has seen last, most recent first, and all that are in use. Used by
/// the control thread alone; the entries it hands out are safe to share.
class JobCache {
 public:
  /// states: the memory of the states of all jobs. max_idle_scene_bytes: scenes of jobs that nobody
  /// uses go when they take more.
  JobCache(JobLoader loader, MemorySharePtr states,
           std::chrono::milliseconds file_patience = kFilePatience,
           std::uint64_t max_idle_scene_bytes = std::numeric_limits<std::uint64_t>::max())
      : loader_(std::move(loader)),
        state_memory_(std::move(states)),
        file_patience_(file_patience),
        max_idle_scene_bytes_(max_idle_scene_bytes) {}

  /// The entry of a job, made when there is none. A failed entry is replaced, so that the next
  /// attempt loads anew.
  std::shared_ptr<JobEntry> entry(const Digest& digest);
  /// Those that are loaded, most recent first.
  std::vector<LoadedJobPtr> loaded() const;
  /// The states of all jobs that have an entry, and what others hold.
  const std::map<Digest, std::shared_ptr<JobStates>>& states() const { return states_; }

 private:
  bool has_room_for_another() const;
  bool has_entry(const Digest& digest) const;
  void make_room_for_states();

  JobLoader loader_;
  MemorySharePtr state_memory_;
  std::chrono::milliseconds file_patience_;
  std::uint64_t max_idle_scene_bytes_;
  /// At most limits::kMaxCachedJobs, and beyond that those in use.
  std::list<std::shared_ptr<JobEntry>> entries_;
  /// What a job holds outlives its scene: nobody else has it. As nobody says which jobs have ended,
  /// it goes when one at work lacks room; a job that has not ended has it made again.
  std::map<Digest, std::shared_ptr<JobStates>> states_;
};

}  // namespace baton
