#include "worker/pass/shared_assets.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/base/trace.h"

namespace baton {

Result<std::shared_ptr<const SharedAssets>> load_shared_assets(const JobSpec& job,
                                                               const MemoryBudget& memory,
                                                               std::uint64_t max_scene_bytes,
                                                               FilesBeside beside) {
  auto assets = std::make_shared<SharedAssets>();
  {
    const Span span(SpanKind::read, "meshes, materials and textures");
    BATON_ASSIGN(assets->scene, load_scene(job, beside, max_scene_bytes));
  }
  const std::uint64_t scene_bytes = assets->scene.size_bytes();
  const std::uint64_t room = max_scene_bytes - std::min(max_scene_bytes, scene_bytes);
  Result<std::unique_ptr<Accel>> accel = [&] {
    const Span span(SpanKind::make, "hierarchies");
    return Accel::build(assets->scene, {.max_bytes = room});
  }();
  if (!accel && accel.error().kind == ErrorKind::bad_input) {
    return Error{ErrorKind::bad_input,
                 fmt::format("the scene does not fit into memory: meshes and textures take {} MiB, "
                             "the ray tracer's hierarchies more than {} MiB; {} MiB are left for "
                             "them of {} MiB (--memory)",
                             scene_bytes >> 20, room >> 20, max_scene_bytes >> 20,
                             memory.total_bytes >> 20)};
  }
  if (!accel) return accel.error();
  assets->accel = std::move(accel).value();
  assets->maps = std::make_shared<MapCache>(memory.maps, MapCache::read_within(memory.pictures()));
  return std::shared_ptr<const SharedAssets>(std::move(assets));
}

Result<std::shared_ptr<const SharedAssets>> load_shared_assets(const JobSpec& job) {
  const MemoryBudget memory = MemoryBudget::of_machine();
  return load_shared_assets(job, memory, memory.scene_bytes, FilesBeside::any);
}

Status verify_asset(const std::vector<KnownAsset>& files, const std::string& path) {
  const auto found =
      std::ranges::find_if(files, [&](const KnownAsset& known) { return known.file.path == path; });
  if (found == files.end()) return {};
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(path));
  return stamp == found->stamp ? Status() : verify_assets({found->file});
}

AssetShelf::AssetShelf()
    : AssetShelf([](const JobSpec& job, const MemoryBudget& memory, std::uint64_t most) {
        return load_shared_assets(job, memory, most, FilesBeside::listed);
      }) {}

Result<std::shared_ptr<const SharedAssets>> AssetShelf::get(const JobSpec& job,
                                                            const std::vector<KnownAsset>& files,
                                                            const MemoryBudget& memory,
                                                            std::uint64_t max_scene_bytes) {
  std::vector<AssetDigest> digests;
  for (const KnownAsset& known : files) digests.push_back(known.file);
  const std::lock_guard lock(mutex_);
  entries_.remove_if([](const Entry& entry) { return entry.assets.expired(); });
  for (const Entry& entry : entries_) {
    // It may have gone since.
    auto assets = entry.assets.lock();
    if (assets != nullptr && entry.scene == job.scene && entry.files == digests) return assets;
  }
  BATON_ASSIGN(auto assets, load_(job, memory, max_scene_bytes));
  assets->maps->check_with([files](const std::string& path) { return verify_asset(files, path); });
  entries_.push_front({job.scene, std::move(digests), assets});
  return assets;
}

}  // namespace baton
