#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"

/// A glTF 2.0 file as plain data, as far as Baton renders it. Indices refer to the lists of
/// Document; -1: none. Every index is checked when the file is read, so that what follows one
/// needs no check; what lies in buffers is checked by accessor.h.
namespace baton::gltf {

struct View {
  int buffer = -1;
  std::uint64_t offset = 0, size = 0;  ///< bytes, within the buffer
  std::uint64_t stride = 0;            ///< bytes from element to element; 0: packed
};

enum class Component : std::uint8_t { i8, u8, i16, u16, u32, f32 };
/// Bytes of a component.
int size_of(Component component);

/// Elements that stand in place of others.
struct Sparse {
  std::uint64_t count = 0;  ///< 0: none
  int indices = -1;         ///< view
  std::uint64_t indices_offset = 0;
  Component indices_component = Component::u32;
  int values = -1;  ///< view
  std::uint64_t values_offset = 0;
};

struct Accessor {
  int view = -1;  ///< -1: zeros, but for what is sparse
  std::uint64_t offset = 0;
  std::uint64_t count = 0;
  Component component = Component::f32;
  /// Components of an element: 1 to 4, 9 or 16.
  int width = 1;
  bool normalized = false;
  Sparse sparse;
};

/// What a morph target adds, as accessors.
struct MorphTarget {
  int positions = -1, normals = -1, tangents = -1;
};

/// Four joints of each vertex and their weights, as accessors.
struct JointSet {
  int joints = -1, weights = -1;
};

struct Primitive {
  /// Topology as OpenGL counts: 4 triangles, 5 strip, 6 fan; others have no surface.
  int mode = 4;
  int material = -1;
  int indices = -1, positions = -1, normals = -1, tangents = -1;  ///< accessors
  std::array<int, 2> uvs{-1, -1};                                 ///< accessors of sets 0 and 1
  std::vector<JointSet> joint_sets{};  ///< JOINTS_0 with WEIGHTS_0 and so on
  std::vector<MorphTarget> targets{};
  int colors = -1;  ///< accessor of COLOR_0
  /// All attributes by name, as accessors.
  std::map<std::string, int> attributes{};
  /// Some targets are of attributes that are not read.
  bool morphs_more = false;
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
  std::vector<double> weights;  ///< one for each target, or none: zeros

  /// Primitives with fewer lack the last ones.
  std::size_t num_targets() const {
    std::size_t most = 0;
    for (const Primitive& primitive : primitives) most = std::max(most, primitive.targets.size());
    return most;
  }
};

struct Skin {
  std::vector<int> joints;  ///< nodes, no two alike, at least one
  /// Accessor of one matrix for each joint; -1: identities.
  int inverse_binds = -1;
};

/// Row-major 3 x 4.
using Matrix = std::array<double, 12>;

struct Node {
  std::string name;
  int parent = -1;
  std::vector<int> children;
  int mesh = -1, camera = -1, skin = -1;
  bool has_matrix = false;  ///< else the three below
  Matrix matrix{};
  std::array<double, 3> translation{0, 0, 0};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< x, y, z, w
  std::array<double, 3> scale{1, 1, 1};
  /// It shows its mesh once for each of these places (EXT_mesh_gpu_instancing), as accessors; -1:
  /// no such member. Without any it shows the mesh once.
  int instance_translations = -1, instance_rotations = -1, instance_scales = -1;
  /// A weight for each target of its mesh, or none: those of the mesh.
  std::vector<double> weights{};
};

struct Camera {
  bool perspective = true;
  double yfov = 0;  ///< radians, (0, pi)
  /// Orthographic: half the height of the picture.
  double ymag = 1;
};

enum class Path : std::uint8_t { translation, rotation, scale, weights };
enum class Interpolation : std::uint8_t { linear, step, cubic_spline };

/// A curve that moves a node.
struct Channel {
  int animation = 0;  ///< place in the file's list
  int node = -1;
  Path path = Path::translation;
  Interpolation interpolation = Interpolation::linear;
  int input = -1, output = -1;  ///< accessors: seconds; values
};

/// Where a texture lies on a surface (textureInfo and KHR_texture_transform).
struct TextureInfo {
  int texture = -1;
  int uv = 0;  ///< set
  std::array<double, 2> offset{0, 0}, scale{1, 1};
  double rotation = 0;  ///< radians
  double strength = 1;  ///< normal textures: how far they tilt
};

enum class Wrap : std::uint8_t { repeat, clamp, mirror };

struct Texture {
  int image = -1;  ///< -1: none that is read
  Wrap wrap_s = Wrap::repeat, wrap_t = Wrap::repeat;
  bool nearest = false;  ///< where it is seen larger than it is
};

/// An image is a file beside this one, a view or bytes of its own.
struct Image {
  std::string file;  ///< absolute, or empty
  int view = -1;
  Bytes bytes;
};

enum class AlphaMode : std::uint8_t { opaque, mask, blend };

struct Material {
  std::string name;
  /// What is wrong with the material, which counts where it is used; empty: nothing.
  std::string fault;
  std::array<double, 4> base_color{1, 1, 1, 1};
  double metallic = 1, roughness = 1;
  TextureInfo base_color_texture, metallic_roughness_texture, normal_texture, emissive_texture;
  std::array<double, 3> emission{0, 0, 0};  ///< factor times strength
  double ior = 1.5, specular = 1;
  std::array<double, 3> specular_color{1, 1, 1};
  /// Made of KHR_materials_pbrSpecularGlossiness.
  bool is_specular_glossy = false;
  bool specular_textured = false;  ///< by textures, which are not read
  bool occluded = false;           ///< by a texture, which is not read
  double clearcoat = 0, clearcoat_roughness = 0;
  TextureInfo clearcoat_texture, clearcoat_roughness_texture, clearcoat_normal_texture;
  AlphaMode alpha_mode = AlphaMode::opaque;
  double alpha_cutoff = 0.5;
};

struct Document {
  std::string path;  ///< goes first in every error
  std::vector<Bytes> buffers;
  /// Paths of buffers that are files of their own; absolute.
  std::vector<std::string> buffer_files;
  std::vector<View> views;
  std::vector<Accessor> accessors;
  std::vector<Mesh> meshes;
  std::vector<Node> nodes;
  std::vector<Skin> skins;
  std::vector<int> roots;  ///< nodes of the scene that is shown
  std::vector<Camera> cameras;
  std::vector<std::string> animations;  ///< their names, some empty or alike
  /// Channels of all animations, in the order of the file.
  std::vector<Channel> channels;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Image> images;
  std::vector<std::string> extensions_used;
  /// What is unusual and read in spite of that, a line each.
  std::vector<std::string> notes;

  /// The mesh of a node that has one.
  const Mesh& mesh_of(const Node& node) const {
    return meshes[static_cast<std::size_t>(node.mesh)];
  }
  /// What image `image` is: bytes of this file, else nothing and Image::file.
  ByteView bytes_of_image(std::size_t image) const;

  Error error(const std::string& what) const { return {ErrorKind::bad_input, path + ": " + what}; }
};

/// Reads a .gltf or .glb file and the buffers beside it. Errors name file and place in its JSON:
/// what is missing or cut, indices past their list, views past their buffer, nodes that are their
/// own ancestors, extensions that are required and not read.
/// listed: the files beside it that may be opened, another one is an error; null: any.
Result<std::shared_ptr<const Document>> read_document(
    const std::string& path, const std::set<std::string>* listed = nullptr);
/// The same of bytes in memory; buffers that are files lie beside `path`.
Result<std::shared_ptr<const Document>> parse_document(
    ByteView bytes, const std::string& path, const std::set<std::string>* listed = nullptr);
/// Why the file beside `path` is not opened: it is not one of those that the job was submitted
/// with.
Error not_listed(const std::string& path, const std::string& file);

/// The nodes of the scene that is shown, parents first.
std::vector<int> shown_nodes(const Document& document);

/// Extensions that are read; all others are reported where they are used.
bool is_read(std::string_view extension);

}  // namespace baton::gltf
