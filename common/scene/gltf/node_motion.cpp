#include "common/scene/gltf/node_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/suggest.h"
#include "common/scene/gltf/accessor.h"
#include "common/scene/gltf/names.h"

namespace baton::gltf {
namespace {

/// How far apart two numbers are that stand for one time, as a share of it: exporters multiply and
/// round in float32, and write 23.976 frames a second for 24000/1001.
constexpr double kSameTime = 0x1p-19;

/// The keys around a time: `share` of the way from key `from` to key `to`.
struct Span {
  std::size_t from = 0, to = 0;
  double share = 0;    ///< [0, 1)
  double seconds = 0;  ///< between the keys
};

/// A key a rounding after `seconds` is there already.
Span find_span(const std::vector<float>& times, double seconds) {
  const double latest = seconds + std::fabs(seconds) * kSameTime;
  const auto next = std::upper_bound(times.begin(), times.end(), latest,
                                     [](double s, float time) { return s < double{time}; });
  if (next == times.begin()) return {};
  const auto from = static_cast<std::size_t>(next - times.begin()) - 1;
  if (next == times.end()) return {from, from, 0, 0};
  const double length = double{*next} - double{times[from]};
  return {from, from + 1, std::max((seconds - double{times[from]}) / length, 0.0), length};
}

/// Component c of a curve of `width` numbers, each by itself.
double component_at(const Curve& curve, const Span& span, std::size_t width, std::size_t c) {
  const bool cubic = curve.interpolation == Interpolation::cubic_spline;
  const std::size_t row = cubic ? 3 * width : width;
  const std::size_t middle = cubic ? width : 0;
  const auto value = [&](std::size_t key, std::size_t part) {
    return double{curve.values[key * row + part + c]};
  };
  const double a = value(span.from, middle), b = value(span.to, middle), t = span.share;
  if (curve.interpolation == Interpolation::step || span.from == span.to) return a;
  if (!cubic) return a + (b - a) * t;
  // [glTF 2.0, appendix C.4]
  const double out = value(span.from, 2 * width) * span.seconds,
               in = value(span.to, 0) * span.seconds;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * a + (t3 - 2 * t2 + t) * out + (3 * t2 - 2 * t3) * b +
         (t3 - t2) * in;
}

Quaternion unit(const std::array<double, 4>& q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0)) return {};
  return {q[0] / length, q[1] / length, q[2] / length, q[3] / length};
}

/// All nodes, parents first: a list that grows while it is walked.
std::vector<int> parents_first(const Document& document) {
  std::vector<int> order;
  for (std::size_t n = 0; n < document.nodes.size(); ++n) {
    if (document.nodes[n].parent < 0) order.push_back(static_cast<int>(n));
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Node& node = document.nodes[static_cast<std::size_t>(order[i])];
    order.insert(order.end(), node.children.begin(), node.children.end());
  }
  return order;
}

/// From each node to the world; local(node): to its parent.
template <class Local>
std::vector<Matrix> chain(const Document& document, const std::vector<int>& order,
                          const Local& local) {
  std::vector<Matrix> world(document.nodes.size(), kIdentity);
  for (const int n : order) {
    const auto node = static_cast<std::size_t>(n);
    const int parent = document.nodes[node].parent;
    world[node] = local(node);
    if (parent >= 0) world[node] = multiply(world[static_cast<std::size_t>(parent)], world[node]);
  }
  return world;
}

Matrix rest_of(const Node& node) {
  return node.has_matrix ? node.matrix : compose(node.translation, unit(node.rotation), node.scale);
}

/// Whether a channel moves weights that nothing has.
bool is_idle(const Document& document, const Channel& channel) {
  if (channel.path != Path::weights) return false;
  const Node& node = document.nodes[static_cast<std::size_t>(channel.node)];
  return node.mesh < 0 || document.mesh_of(node).num_targets() == 0;
}

/// Where several keys have one time the curve jumps from the first to the last of them; others are
/// left out. row: numbers a key. Returns how many have the time of another.
std::size_t drop_repeated(Curve& curve, std::size_t row) {
  std::size_t kept = 0, repeated = 0;
  for (std::size_t k = 0; k < curve.times.size(); ++k) {
    repeated += k > 0 && curve.times[k] == curve.times[k - 1] ? 1 : 0;
    if (kept > 1 && curve.times[k] == curve.times[kept - 2]) --kept;
    curve.times[kept] = curve.times[k];
    std::copy_n(curve.values.begin() + static_cast<std::ptrdiff_t>(k * row), row,
                curve.values.begin() + static_cast<std::ptrdiff_t>(kept * row));
    ++kept;
  }
  curve.times.resize(kept);
  curve.values.resize(kept * row);
  return repeated;
}

/// Makes tangents of a cubic curve 0 that are not finite; those before the first and behind the
/// last key say nothing.
void mend_slopes(Curve& curve, std::size_t width, KeyRepairs& repairs) {
  const std::size_t keys = curve.times.size();
  for (std::size_t k = 0; k < keys; ++k) {
    for (const std::size_t part : {std::size_t{0}, std::size_t{2}}) {
      if (is_finite(curve.values, width, 3 * k + part)) continue;
      std::fill_n(curve.values.begin() + static_cast<std::ptrdiff_t>((3 * k + part) * width), width,
                  0.0f);
      repairs.slopes += (part == 0 ? k > 0 : k + 1 < keys) ? 1 : 0;
    }
  }
}

/// Leaves keys out that are not finite, or rotations of zeros, and puts the others into the order
/// of their times. rows: of `width` numbers a key.
void sort_keys(Curve& curve, bool turns, std::size_t rows, std::size_t width, KeyRepairs& repairs) {
  const auto is_rotation = [&](std::size_t k) {
    const auto first =
        curve.values.begin() + static_cast<std::ptrdiff_t>((k * rows + rows / 2) * width);
    return std::any_of(first, first + static_cast<std::ptrdiff_t>(width),
                       [](float v) { return v != 0; });
  };
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < curve.times.size(); ++k) {
    if (!std::isfinite(curve.times[k]) || !is_finite(curve.values, rows * width, k) ||
        (turns && !is_rotation(k))) {
      ++repairs.unusable;
      continue;
    }
    if (!order.empty() && curve.times[k] < curve.times[order.back()]) ++repairs.unordered;
    order.push_back(k);
  }
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return curve.times[k]; });
  Curve sorted{curve.interpolation, {}, {}};
  for (const std::size_t k : order) {
    sorted.times.push_back(curve.times[k]);
    const auto first = curve.values.begin() + static_cast<std::ptrdiff_t>(k * rows * width);
    sorted.values.insert(sorted.values.end(), first,
                         first + static_cast<std::ptrdiff_t>(rows * width));
  }
  curve = std::move(sorted);
}

/// A curve without keys where the file has none that can be used. repairs: gets what was not
/// usable, added.
Result<Curve> read_curve(const Document& document, const Channel& channel, KeyRepairs& repairs) {
  const bool moves_weights = channel.path == Path::weights;
  std::size_t width = channel.path == Path::rotation ? 4 : 3;
  Curve curve{channel.interpolation, {}, {}};
  BATON_ASSIGN(curve.times, read_floats(document, channel.input, 1));
  BATON_ASSIGN(curve.values,
               read_floats(document, channel.output, moves_weights ? 1 : static_cast<int>(width)));
  if (curve.times.empty())
    return document.error(
        fmt::format("$.accessors[{}]: expected the times of an animation", channel.input));
  const std::size_t rows = channel.interpolation == Interpolation::cubic_spline ? 3 : 1;
  // A mesh may have other targets than the animation has weights.
  if (moves_weights)
    width = std::max<std::size_t>(curve.values.size() / (curve.times.size() * rows), 1);
  const std::size_t expected = curve.times.size() * rows * width;
  if (curve.values.size() != expected)
    return document.error(
        fmt::format("$.accessors[{}]: expected {} numbers for an animation, got {}", channel.output,
                    expected, curve.values.size()));
  if (rows > 1) mend_slopes(curve, width, repairs);
  sort_keys(curve, channel.path == Path::rotation, rows, width, repairs);
  repairs.repeated += drop_repeated(curve, rows * width);
  return curve;
}

}  // namespace

std::array<double, 3> Curve::vector_at(double seconds) const {
  const Span span = find_span(times, seconds);
  std::array<double, 3> v{};
  for (std::size_t c = 0; c < 3; ++c) v[c] = component_at(*this, span, 3, c);
  return v;
}

std::vector<double> Curve::values_at(double seconds) const {
  const Span span = find_span(times, seconds);
  const std::size_t rows = interpolation == Interpolation::cubic_spline ? 3 : 1;
  const std::size_t width = values.size() / (times.size() * rows);
  std::vector<double> v;
  for (std::size_t c = 0; c < width; ++c) v.push_back(component_at(*this, span, width, c));
  return v;
}

Quaternion Curve::rotation_at(double seconds) const {
  const Span span = find_span(times, seconds);
  if (interpolation == Interpolation::linear) {
    const auto key = [&](std::size_t k) {
      return unit({double{values[4 * k]}, double{values[4 * k + 1]}, double{values[4 * k + 2]},
                   double{values[4 * k + 3]}});
    };
    return slerp(key(span.from), key(span.to), span.share);
  }
  std::array<double, 4> q{};
  for (std::size_t c = 0; c < 4; ++c) q[c] = component_at(*this, span, 4, c);
  return unit(q);
}

Result<NodeMotion> NodeMotion::read(std::shared_ptr<const Document> document,
                                    const std::string& animation) {
  NodeMotion motion;
  motion.document_ = std::move(document);
  const Document& file = *motion.document_;
  motion.curves_.resize(file.nodes.size());
  BATON_ASSIGN(const int chosen, find_animation(file, animation));
  for (const Channel& channel : file.channels) {
    if (chosen >= 0 && channel.animation != chosen) continue;
    if (is_idle(file, channel)) {
      ++motion.num_idle_channels_;
      continue;
    }
    Moved& moved = motion.curves_[static_cast<std::size_t>(channel.node)];
    std::optional<Curve>& curve = channel.path == Path::translation ? moved.translation
                                  : channel.path == Path::rotation  ? moved.rotation
                                  : channel.path == Path::scale     ? moved.scale
                                                                    : moved.weights;
    if (curve) {
      ++motion.num_second_channels_;
      continue;
    }
    BATON_ASSIGN(curve, read_curve(file, channel, motion.repairs_));
    if (curve->times.empty()) {
      ++motion.repairs_.empty_curves;
      curve.reset();
      continue;
    }
    if (channel.path != Path::weights &&
        file.nodes[static_cast<std::size_t>(channel.node)].has_matrix)
      return file.error(fmt::format("$.nodes[{}]: is animated, expected no matrix", channel.node));
  }
  motion.order_ = parents_first(file);
  motion.find_what_moves();
  return motion;
}

std::vector<std::string> NodeMotion::notes() const {
  std::vector<std::string> notes;
  const auto add = [&](std::size_t count, const char* what) {
    if (count > 0) notes.push_back(fmt::format("{} {}", count, what));
  };
  add(repairs_.repeated,
      "keys of its animations are at the time of another: the curve jumps there to the last");
  add(repairs_.unusable,
      "keys of its animations have a time or value that is not finite, or a rotation of zeros: "
      "they "
      "are left out");
  add(repairs_.slopes, "tangents of keys of its animations are not finite: they count as 0");
  add(repairs_.unordered,
      "keys of its animations are earlier than the one before: they are put into order");
  add(repairs_.empty_curves, "curves of its animations have no usable key: they move nothing");
  if (num_second_channels_ > 0)
    notes.push_back(fmt::format(
        "{} curves of its animations move what an earlier one moves, and are left out: `animation` "
        "chooses one of {}",
        num_second_channels_, shown_names(animation_names(*document_))));
  add(num_idle_channels_, "of its animations move weights of nodes without morph targets");
  return notes;
}

void NodeMotion::let_go_of_buffers() {
  auto rest = std::make_shared<Document>();
  rest->path = document_->path;
  rest->meshes = document_->meshes;
  rest->nodes = document_->nodes;
  rest->skins = document_->skins;
  document_ = std::move(rest);
}

void NodeMotion::find_what_moves() {
  moves_.assign(curves_.size(), false);
  for (const int n : order_) {
    const auto node = static_cast<std::size_t>(n);
    const int parent = document_->nodes[node].parent;
    moves_[node] = curves_[node].any() || (parent >= 0 && moves_[static_cast<std::size_t>(parent)]);
  }
}

Result<int> NodeMotion::find(const std::string& name) const {
  int found = -1, count = 0;
  std::vector<std::string> names;
  for (std::size_t n = 0; n < document_->nodes.size(); ++n) {
    names.push_back(document_->nodes[n].name);
    if (document_->nodes[n].name != name) continue;
    found = static_cast<int>(n);
    ++count;
  }
  if (count == 1) return found;
  if (count > 1)
    return document_->error(fmt::format("{} nodes are named \"{}\", expected one", count, name));
  return document_->error(fmt::format("no node \"{}\"{}", name, suggestion(name, names)));
}

std::optional<std::array<double, 2>> NodeMotion::seconds() const {
  std::optional<std::array<double, 2>> range;
  for (const Moved& moved : curves_) {
    for (const auto* curve : {&moved.translation, &moved.rotation, &moved.scale, &moved.weights}) {
      if (!*curve) continue;
      const double first = (*curve)->times.front(), last = (*curve)->times.back();
      range = range ? std::array{std::min((*range)[0], first), std::max((*range)[1], last)}
                    : std::array{first, last};
    }
  }
  return range;
}

void NodeMotion::place(int node, const Matrix& local) {
  curves_[static_cast<std::size_t>(node)].placed = local;
  find_what_moves();
}

Matrix NodeMotion::local(std::size_t n, double seconds) const {
  const Node& node = document_->nodes[n];
  const Moved& moved = curves_[n];
  if (moved.placed) return *moved.placed;
  if (!moved.any()) return rest_of(node);
  return compose(moved.translation ? moved.translation->vector_at(seconds) : node.translation,
                 moved.rotation ? moved.rotation->rotation_at(seconds) : unit(node.rotation),
                 moved.scale ? moved.scale->vector_at(seconds) : node.scale);
}

std::vector<Matrix> NodeMotion::to_world(double seconds) const {
  return chain(*document_, order_, [&](std::size_t node) { return local(node, seconds); });
}

std::vector<Matrix> NodeMotion::at_rest() const {
  return chain(*document_, order_, [&](std::size_t node) {
    return curves_[node].placed.value_or(rest_of(document_->nodes[node]));
  });
}

std::vector<Matrix> NodeMotion::at_rest(const Document& document) {
  return chain(document, parents_first(document),
               [&](std::size_t node) { return rest_of(document.nodes[node]); });
}

std::vector<double> NodeMotion::weights(int node, double seconds) const {
  const std::optional<Curve>& curve = curves_[static_cast<std::size_t>(node)].weights;
  if (!curve) return weights_at_rest(*document_, node);
  std::vector<double> values = curve->values_at(seconds);
  values.resize(document_->mesh_of(document_->nodes[static_cast<std::size_t>(node)]).num_targets());
  return values;
}

std::vector<double> NodeMotion::weights_at_rest(const Document& document, int node) {
  const Node& given = document.nodes[static_cast<std::size_t>(node)];
  if (!given.weights.empty()) return given.weights;
  const Mesh& mesh = document.mesh_of(given);
  return mesh.weights.empty() ? std::vector<double>(mesh.num_targets()) : mesh.weights;
}

}  // namespace baton::gltf
