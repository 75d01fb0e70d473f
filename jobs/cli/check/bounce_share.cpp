#include "jobs/cli/check/bounce_share.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include "common/image/image_io.h"
#include "common/job/aov.h"
#include "common/job/plan/sequence.h"
#include "jobs/auto/pilot_windows.h"
#include "jobs/cli/farm_job_runner.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Materials that are seen in a smaller share of the lit pixels tell little.
constexpr double kLeastSeen = 0.01;

struct Sums {
  double direct = 0, indirect = 0;
  std::size_t pixels = 0;
};

JobSpec job_to_look_at(const JobSpec& job, const fs::path& folder) {
  JobSpec look = small_job(job, {job.frames[job.frames.size() / 2]});
  look.image.sites = look.image.max_sites = 1;
  look.sampling = {};
  look.sampling.method = Method::bidirectional;
  look.visibility = {};
  look.quality = {};
  look.quality.rounds = 4;
  look.state.carry = false;
  look.output.aovs = {Aov::material, Aov::direct, Aov::indirect};
  look.output.directory = (folder / "frames").string();
  return look;
}

double luminance_at(const FilmTile& film, Aov aov, std::size_t pixel) {
  Rgb color{};
  float* const to[] = {&color.x, &color.y, &color.z};
  for (std::size_t c = 0; c < 3; ++c) {
    const float* const plane = film.find(traits(aov).channels[c]);
    *to[c] = plane != nullptr ? plane[pixel] : 0;
  }
  return luminance(color);
}

BounceShare share_in(const FilmTile& film, const std::vector<std::string>& materials) {
  const float* const material = film.find("material");
  Sums all;
  std::vector<Sums> of(materials.size() + 1);
  for (std::size_t pixel = 0; material != nullptr && pixel < film.num_pixels(); ++pixel) {
    const auto number = static_cast<std::size_t>(std::max(material[pixel], 0.0f));
    if (number == 0 || number >= of.size()) continue;
    for (Sums* const sums : {&all, &of[number]}) {
      sums->direct += luminance_at(film, Aov::direct, pixel);
      sums->indirect += luminance_at(film, Aov::indirect, pixel);
      ++sums->pixels;
    }
  }
  BounceShare share;
  const auto ratio = [](const Sums& sums) {
    return sums.direct > 0 ? std::max(sums.indirect / sums.direct, 0.0) : 0;
  };
  share.whole = ratio(all);
  for (std::size_t number = 1; number < of.size(); ++number) {
    const bool is_seen =
        static_cast<double>(of[number].pixels) > kLeastSeen * static_cast<double>(all.pixels);
    if (!is_seen || ratio(of[number]) <= share.of_material) continue;
    share.of_material = ratio(of[number]);
    share.material = materials[number - 1];
  }
  return share;
}

}  // namespace

Result<BounceShare> bounce_share(const JobSpec& job) {
  std::string made = (fs::temp_directory_path() / "baton-check-XXXXXX").string();
  if (::mkdtemp(made.data()) == nullptr)
    return Error{ErrorKind::io, fmt::format("{}: cannot make a folder", made)};
  const fs::path folder = made;
  const auto render = [&]() -> Result<BounceShare> {
    const JobSpec look = job_to_look_at(job, folder);
    FarmJobRunner runner(FarmOptions{
        .workers = 1,
        .threads_per_worker = std::max(1, static_cast<int>(std::thread::hardware_concurrency())),
        .work_directory = folder / "work"});
    runner.be_quiet();
    BATON_TRY(runner.run({look}, [](std::size_t, const JobSummary&) { return Status(); }));
    BATON_ASSIGN(const FilmTile film, read_exr(frame_path(look, FrameIndex())));
    return share_in(film, material_names(look));
  };
  Result<BounceShare> share = render();
  std::error_code left;
  fs::remove_all(folder, left);
  return share;
}

std::string text_of(const BounceShare& share) {
  std::string text = share_text(share.whole);
  if (!share.material.empty())
    text += fmt::format(", most on `{}` ({})", share.material, share_text(share.of_material));
  return text;
}

}  // namespace baton
