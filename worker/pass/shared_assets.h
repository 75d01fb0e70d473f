#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "common/base/file_stamp.h"
#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "common/job/text/job_json.h"
#include "worker/accel/accel.h"
#include "worker/light/map_cache.h"
#include "worker/pass/memory_budget.h"

namespace baton {

/// What is slow to load, and the same for all jobs that show one scene with one set of files:
/// a study's jobs differ in their sampling alone. Immutable but for the maps, which guard
/// themselves.
struct SharedAssets {
  Scene scene;
  std::shared_ptr<const Accel> accel;  ///< ray tracer of `scene`
  std::shared_ptr<MapCache> maps;

  /// What scene and ray tracer take.
  std::uint64_t size_bytes() const { return scene.size_bytes() + accel->size_bytes(); }
};

/// Loads meshes and materials and builds the ray tracer; maps are read when they are asked for.
/// memory: whose share the maps use. Errors name the file and what was expected; several faults are
/// joined by newlines; a scene that takes more than max_scene_bytes is refused with the numbers.
/// beside: FilesBeside::listed where others have submitted the job.
Result<std::shared_ptr<const SharedAssets>> load_shared_assets(const JobSpec& job,
                                                               const MemoryBudget& memory,
                                                               std::uint64_t max_scene_bytes,
                                                               FilesBeside beside);
/// The same with what is usual on this machine.
Result<std::shared_ptr<const SharedAssets>> load_shared_assets(const JobSpec& job);

/// A file of a job, and how it stood when it had that digest.
struct KnownAsset {
  AssetDigest file;
  FileStamp stamp;
};

/// A file that has been read is the one that the job was submitted with. It is read again only if
/// it stands otherwise. files: those of the job; one that is not among them may be any. Errors:
/// those of stamp_of() and verify_assets().
Status verify_asset(const std::vector<KnownAsset>& files, const std::string& path);

/// The assets of those jobs that are still in use. Any number of threads may ask; one loads at a
/// time.
class AssetShelf {
 public:
  /// Like load_shared_assets().
  using Loader = std::function<Result<std::shared_ptr<const SharedAssets>>(
      const JobSpec& job, const MemoryBudget& memory, std::uint64_t max_scene_bytes)>;

  AssetShelf();
  explicit AssetShelf(Loader load) : load_(std::move(load)) {}

  /// The assets of a living job of equal scene and digests of files, or newly loaded ones. files:
  /// every asset of the job, already verified.
  Result<std::shared_ptr<const SharedAssets>> get(const JobSpec& job,
                                                  const std::vector<KnownAsset>& files,
                                                  const MemoryBudget& memory,
                                                  std::uint64_t max_scene_bytes);

 private:
  struct Entry {
    SceneSpec scene;
    std::vector<AssetDigest> files;
    std::weak_ptr<const SharedAssets> assets;
  };

  const Loader load_;
  std::mutex mutex_;
  std::list<Entry> entries_;
};

}  // namespace baton
