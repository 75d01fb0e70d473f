#include "common/job/text/picture.h"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "common/job/aov.h"
#include "common/job/motion.h"
#include "common/job/plan/sequence.h"

namespace baton {
namespace {

/// Beginnings of the paths that do not decide pixels.
constexpr std::array<std::string_view, 17> kSettings{"/name",
                                                     "/priority",
                                                     "/metadata",
                                                     "/frames",
                                                     "/image/tileSize",
                                                     "/output",
                                                     "/state/",
                                                     "/quality/sweeps",
                                                     "/quality/refinable",
                                                     "/quality/noiseThreshold",
                                                     "/quality/maxRounds",
                                                     "/quality/timeLimit",
                                                     "/maxRetriesPerTask",
                                                     "/maxFailedTasks",
                                                     "/maxFailuresPerWorker",
                                                     "/maxSecondsPerTask",
                                                     "/specificationVersion"};
/// Exceptions, which decide pixels: what is remembered of earlier frames says where rays go.
constexpr std::array<std::string_view, 2> kOfThePicture{"/state/carry", "/state/preroll"};
/// How the first frame is named among the differences.
constexpr const char* kFirstFrame = "$.frames (samples are carried from the first one on)";

bool is_setting(std::string_view path) {
  // What objects are called is in mattes alone.
  if (path.starts_with("/scene/objects/") && path.ends_with("/name")) return true;
  if (std::ranges::find(kOfThePicture, path) != kOfThePicture.end()) return false;
  return std::any_of(kSettings.begin(), kSettings.end(),
                     [&](std::string_view start) { return path.starts_with(start); });
}

/// Keys decide single frames (FrameComparison).
bool is_key(std::string_view path) {
  return path.starts_with("/environment/keys/") || path.starts_with("/environment/scaleKeys/") ||
         path.starts_with("/environment/rotation/keys/") || path.starts_with("/camera/keys/") ||
         (path.starts_with("/scene/objects/") && path.find("/keys/") != path.npos);
}

/// "/image/sites" as "$.image.sites", "/objects/3/mesh" as "$.objects[3].mesh".
std::string json_path(std::string_view pointer) {
  std::string path = "$";
  while (!pointer.empty()) {
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    const std::string_view key = pointer.substr(1, end - 1);
    const bool is_index = !key.empty() && key.find_first_not_of("0123456789") == key.npos;
    path += is_index ? "[" + std::string(key) + "]" : "." + std::string(key);
    pointer.remove_prefix(end);
  }
  return path;
}

/// Whether a value says nothing of this job: earlier pictures, which were without light between
/// surfaces, keep their names.
bool is_idle(std::string_view path, const JobSpec& job) {
  return path.starts_with("/light/") && job.light.bounces == 0;
}

using Facts = std::map<std::string, std::string>;

/// The job as its films are made.
JobSpec without_plate(JobSpec job) {
  if (job.output.background == Background::plate) job.output.background = Background::transparent;
  return job;
}

/// The job with two keys of each that moves: many take seconds to write, and none is a fact.
JobSpec with_few_keys(JobSpec job) {
  const auto shorten = [](auto& keys) { keys.resize(std::min<std::size_t>(keys.size(), 2)); };
  shorten(job.environment.keys);
  shorten(job.environment.scale_keys);
  shorten(job.environment.rotation_keys);
  shorten(job.camera.keys);
  for (ObjectSpec& object : job.scene.objects) shorten(object.keys);
  return job;
}

/// The values that decide all frames, and the contents of the files but the maps, by name.
Facts picture_facts(const JobSpec& job, const std::vector<AssetDigest>& assets) {
  Facts facts;
  const nlohmann::json all = nlohmann::json::parse(to_json(with_few_keys(job))).flatten();
  for (const auto& [path, value] : all.items()) {
    if (!is_setting(path) && !is_key(path) && !is_idle(path, job))
      facts.emplace(json_path(path), value.dump());
  }
  // Whether anything moves decides how all frames follow their history.
  if (!job.camera.keys.empty()) facts.emplace("$.camera.keys", "given");
  for (std::size_t i = 0; i < job.scene.objects.size(); ++i) {
    if (moves(job.scene.objects[i]))
      facts.emplace("$.scene.objects[" + std::to_string(i) + "].keys", "given");
  }
  if (carries_state(job)) facts.emplace(kFirstFrame, std::to_string(job.frames.front().value()));
  std::set<std::string> maps;
  for (const EnvironmentKey& key : job.environment.keys) maps.insert(key.map);
  maps.erase(job.environment.camera_map.file);  // which all frames show
  const std::vector<std::string> of_films = asset_paths(without_plate(job));
  for (const AssetDigest& asset : assets) {
    if (!maps.contains(asset.path) && std::ranges::binary_search(of_films, asset.path))
      facts.emplace(asset.path, asset.digest.hex());
  }
  return facts;
}

void put(ByteWriter& writer, const Vec3& v) {
  for (const float x : {v.x, v.y, v.z}) writer.put(x);
}

Digest light_facts(const EnvironmentSpec& environment, FrameNumber frame,
                   const std::map<std::string, Digest>& contents) {
  const EnvironmentFrame light = environment_at(environment, frame);
  ByteWriter writer;
  for (const std::int32_t map : {light.map_a, light.map_b}) {
    const std::string& path = environment.keys.at(static_cast<std::size_t>(map)).map;
    const auto found = contents.find(path);
    writer.put_string(found == contents.end() ? path : found->second.hex());
  }
  writer.put(light.mix);
  writer.put(light.scale);
  writer.put(rotation_deg_at(environment, frame));
  return digest_of(writer.bytes());
}

/// frames: at which the camera is looked at.
Digest camera_facts(const JobSpec& job, const std::vector<FrameNumber>& frames) {
  ByteWriter writer;
  for (const FrameNumber frame : frames) {
    const CameraSpec camera = camera_at(job, frame.value());
    for (const Vec3& v : {camera.position, camera.look_at, camera.up}) put(writer, v);
    writer.put(camera.vertical_fov_deg);
  }
  return digest_of(writer.bytes());
}

/// frames: at which objects that move are looked at.
Digest object_facts(const std::vector<const ObjectSpec*>& moving, KeyCurve curve,
                    const std::vector<FrameNumber>& frames) {
  ByteWriter writer;
  for (const ObjectSpec* object : moving) {
    for (const FrameNumber frame : frames) {
      const Transform pose = object_motion_at(*object, curve, frame.value());
      for (const float x : pose.linear.m) writer.put(x);
      put(writer, pose.offset);
    }
  }
  return digest_of(writer.bytes());
}

/// Digests by path.
std::map<std::string, Digest> contents_of(const ParsedJobDocument& document) {
  std::map<std::string, Digest> contents;
  for (const AssetDigest& asset : document.assets) contents.emplace(asset.path, asset.digest);
  return contents;
}

}  // namespace

Digest picture_digest(const JobSpec& job, const std::vector<AssetDigest>& assets) {
  ByteWriter writer;
  for (const auto& [name, value] : picture_facts(job, assets)) {
    writer.put_string(name);
    writer.put_string(value);
  }
  return digest_of(writer.bytes());
}

std::vector<std::string> picture_differences(const ParsedJobDocument& a,
                                             const ParsedJobDocument& b) {
  if (a.picture == b.picture) return {};
  const Facts left = picture_facts(a.job, a.assets), right = picture_facts(b.job, b.assets);
  std::set<std::string> differences;
  const auto compare = [&](const Facts& one, const Facts& other) {
    for (const auto& [name, value] : one) {
      const auto found = other.find(name);
      // A file that only one job reads, and whether samples are carried, have keys of their own.
      const bool has_key = name.front() == '/' || name == kFirstFrame;
      if (found == other.end() ? !has_key : found->second != value) differences.insert(name);
    }
  };
  compare(left, right);
  compare(right, left);
  return {differences.begin(), differences.end()};
}

std::vector<std::string> setting_differences(const JobSpec& a, const JobSpec& b) {
  const auto settings_of = [](JobSpec job) {
    job.scene.objects.clear();
    nlohmann::json settings = nlohmann::json::parse(to_json(with_few_keys(std::move(job))));
    for (const char* const known : {"name", "frames", "priority"}) settings.erase(known);
    return settings.flatten();
  };
  const nlohmann::json left = settings_of(a), right = settings_of(b);
  std::set<std::string> differences;
  for (const auto& [one, other] : {std::pair(&left, &right), std::pair(&right, &left)}) {
    for (const auto& [path, value] : one->items()) {
      const auto found = other->find(path);
      const bool is_same = found != other->end() && *found == value;
      const bool is_empty = value.is_null();  // a list or object: the other one says what it has
      if (!is_setting(path) || is_same || is_empty) continue;
      const std::string name = json_path(path);
      differences.insert(name.substr(0, name.find('[')));  // lists as a whole
    }
  }
  return {differences.begin(), differences.end()};
}

FrameComparison::Frames::Frames(const ParsedJobDocument& document)
    : document_(&document), contents_(contents_of(document)), facts_(document.job.frames.size()) {
  for (const ObjectSpec& object : document.job.scene.objects) {
    if (moves(object)) moving_.push_back(&object);
  }
}

std::size_t FrameComparison::Frames::num_sweeps() const {
  return static_cast<std::size_t>(document_->job.quality.sweeps);
}

const FrameComparison::Facts& FrameComparison::Frames::facts(FrameIndex frame, bool with_motion) {
  std::optional<Facts>& facts = facts_[frame.index()];
  if (facts) return *facts;
  const JobSpec& job = document_->job;
  const FrameNumber at = number(frame);
  std::vector<FrameNumber> poses{at};
  if (with_motion) poses = {at - 1, at, at + 1};
  facts = Facts{light_facts(job.environment, at, contents_), camera_facts(job, poses),
                object_facts(moving_, job.motion.curve, poses)};
  return *facts;
}

Digest FrameComparison::Frames::plate(FrameIndex frame) const {
  const OutputSpec& output = document_->job.output;
  if (!has_plate(output)) return {};
  const auto plate = contents_.find(file_at(*output.plate, number(frame)));
  return plate == contents_.end() ? Digest() : plate->second;
}

FrameComparison::FrameComparison(const ParsedJobDocument& a, const ParsedJobDocument& b)
    : a_(a),
      b_(b),
      with_motion_(has_aov(a.job, Aov::motion) && has_aov(b.job, Aov::motion)),
      carried_(carries_state(a.job) || carries_state(b.job)) {}

bool FrameComparison::show_the_same(FrameIndex frame_a, FrameIndex frame_b) const {
  return a_.number(frame_a) == b_.number(frame_b) &&
         a_.facts(frame_a, with_motion_) == b_.facts(frame_b, with_motion_);
}

/// Whether so many frames from the first on are the same.
bool FrameComparison::have_common(std::size_t num_frames) const {
  const std::size_t end = std::min({num_frames, a_.size(), b_.size()});
  while (num_common_ < end) {
    const FrameIndex next(static_cast<std::int32_t>(num_common_));
    if (!show_the_same(next, next)) return false;
    ++num_common_;
  }
  return num_common_ >= num_frames;
}

bool FrameComparison::are_all_common() const {
  return a_.size() == b_.size() && have_common(a_.size());
}

bool FrameComparison::are_equal(FrameIndex frame_a, FrameIndex frame_b) const {
  return a_.num_sweeps() == b_.num_sweeps() && are_alike(frame_a, frame_b);
}

bool FrameComparison::have_one_plate(FrameIndex frame_a, FrameIndex frame_b) const {
  return a_.plate(frame_a) == b_.plate(frame_b);
}

bool FrameComparison::are_alike(FrameIndex frame_a, FrameIndex frame_b) const {
  if (!carried_) return show_the_same(frame_a, frame_b);
  if (std::min(a_.num_sweeps(), b_.num_sweeps()) > 1 && !are_all_common()) return false;
  return frame_a == frame_b && have_common(frame_a.index() + 1);
}

std::int32_t FrameComparison::num_common_steps(Step end) const {
  const std::size_t sweeps = std::min(a_.num_sweeps(), b_.num_sweeps());
  const std::size_t num_wanted = static_cast<std::size_t>(end.value());
  if (sweeps > 1 && num_wanted > num_common_ && are_all_common())
    return static_cast<std::int32_t>(std::min(a_.size() * sweeps, num_wanted));
  have_common(num_wanted);
  return static_cast<std::int32_t>(std::min(num_common_, num_wanted));
}

std::string FrameComparison::difference(FrameIndex frame_a, FrameIndex frame_b) const {
  const Facts &a = a_.facts(frame_a, with_motion_), &b = b_.facts(frame_b, with_motion_);
  const FrameNumber frame = b_.number(frame_b);
  if (a_.number(frame_a) == frame && !(a == b)) {
    const char* const what = !(a.light == b.light)     ? "$.environment"
                             : !(a.camera == b.camera) ? "$.camera.keys"
                                                       : "$.scene.objects: keys";
    return std::string(what) + (with_motion_ ? " around frame " : " at frame ") +
           std::to_string(frame.value());
  }
  if (a_.num_sweeps() != b_.num_sweeps()) return "$.quality.sweeps";
  if (a_.num_sweeps() > 1)
    return "$.frames (samples are carried from the last frame to the first of the next sweep)";
  return "$.frames before frame " + std::to_string(frame.value()) + " (samples are carried)";
}

}  // namespace baton
