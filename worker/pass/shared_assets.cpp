#include "worker/pass/shared_assets.h"

namespace baton {

Result<std::shared_ptr<const SharedAssets>> load_shared_assets(const JobSpec& job) {
  auto assets = std::make_shared<SharedAssets>();
  BATON_ASSIGN(assets->scene, load_scene(job));
  BATON_ASSIGN(assets->accel, Accel::build(assets->scene));
  assets->maps = std::make_shared<MapCache>();
  return std::shared_ptr<const SharedAssets>(std::move(assets));
}

Result<std::shared_ptr<const SharedAssets>> AssetShelf::get(const JobSpec& job,
                                                            const std::vector<AssetDigest>& files) {
  const std::lock_guard lock(mutex_);
  entries_.remove_if([](const Entry& entry) { return entry.assets.expired(); });
  for (const Entry& entry : entries_) {
    // It may have gone since.
    auto assets = entry.assets.lock();
    if (assets != nullptr && entry.scene == job.scene && entry.files == files) return assets;
  }
  BATON_ASSIGN(auto assets, load_shared_assets(job));
  entries_.push_front({job.scene, files, assets});
  return assets;
}

}  // namespace baton
