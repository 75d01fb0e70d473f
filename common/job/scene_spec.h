#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/math/vec3.h"

namespace baton {

/// The scene of a job (job_spec.h).

/// Row-major 3 x 4: an affine map of points.
using Matrix34 = std::array<float, 12>;

/// A node or camera of a glTF file whose animations give the keys: frame f is at (f - start_frame)
/// / fps seconds.
struct GltfMotion {
  std::string file;  ///< .gltf .glb
  std::string node;  ///< the node's name in the file
  float fps = 24;
  /// The frame at time 0; Blender writes frame f at f / fps seconds.
  int start_frame = 0;
  std::string animation{};  ///< as of GltfSceneSpec

  bool operator==(const GltfMotion&) const = default;
};

/// How an image goes on past its edges.
enum class TextureWrap : std::uint8_t { repeat, clamp, mirror };
/// How texels are blended that are larger than what a site sees.
enum class TextureFilter : std::uint8_t { linear, nearest };

/// An image on a surface: at texture coordinates (u, v) lies the image's place
/// offset + R(rotate_deg) (scale * (u, v)), with (0, 0) its upper left corner, (1, 1) its lower
/// right [KHR_texture_transform].
struct TextureSpec {
  /// An image, its tiles (udim.h), or a .gltf or .glb file that contains one.
  std::string file;
  /// Place in the list of images of a .gltf or .glb file; else -1.
  int image = -1;
  int uv = 0;  ///< set of texture coordinates, 0 or 1
  std::array<float, 2> offset{0, 0};
  std::array<float, 2> scale{1, 1};
  float rotate_deg = 0;  ///< counter-clockwise, of the coordinates
  TextureWrap wrap_u = TextureWrap::repeat, wrap_v = TextureWrap::repeat;
  TextureFilter filter = TextureFilter::linear;
  float strength = 1;  ///< normal maps: factor on x and y

  bool operator==(const TextureSpec&) const = default;
};

enum class MaterialKind : std::uint8_t { diffuse, phong, metallic_roughness, measured };

/// diffuse: base_color is the albedo. phong: kd * base_color diffuse + ks * specular_color
/// normalised lobe of `exponent`. metallic_roughness: GGX with base_color, metallic, roughness
/// (glTF 2.0). measured: a table in the MERL binary format. Textures are factors; not of measured.
struct MaterialSpec {
  MaterialKind kind = MaterialKind::diffuse;
  Rgb base_color{0.8f, 0.8f, 0.8f};
  /// phong; metallic_roughness: factor on F0 of what is no metal.
  Rgb specular_color{1, 1, 1};
  float kd = 0.5f;         ///< phong, [0, 1]
  float ks = 0.5f;         ///< phong, [0, 1]; kd + ks <= 1
  float exponent = 50;     ///< phong, [1, 100000]
  float metallic = 0;      ///< [0, 1]
  float roughness = 0.5f;  ///< [0.02, 1]; alpha = roughness^2
  /// metallic_roughness: index of refraction of what is no metal, [1, 100].
  float ior = 1.5f;
  /// metallic_roughness: strength of the reflection of what is no metal, [0, 1].
  float specular = 1;
  /// metallic_roughness: share of the coat, [0, 1]; none: no coat.
  std::optional<float> clearcoat{};
  std::optional<float> clearcoat_roughness{};  ///< the coat's, [0.02, 1]; none: 0.02
  std::string file{};                          ///< measured: .binary

  std::optional<TextureSpec> color_texture{};               ///< on base_color; its alpha on `alpha`
  std::optional<TextureSpec> metallic_roughness_texture{};  ///< B on metallic, G on roughness
  std::optional<TextureSpec> clearcoat_texture{};           ///< R on clearcoat
  std::optional<TextureSpec> clearcoat_roughness_texture{};  ///< G on clearcoat_roughness
  std::optional<TextureSpec> clearcoat_normal_texture{};     ///< bends the coat alone
  std::optional<TextureSpec> normal_texture{};               ///< bends what is below a coat
  /// Radiance that the camera sees; it lights nothing.
  Rgb emission{0, 0, 0};
  std::optional<TextureSpec> emission_texture{};  ///< on emission
  float alpha = 1;                                ///< [0, 1]
  /// Where alpha is below, there is no surface; [0, 1].
  float alpha_cutoff = 0;
  /// Where there is a surface, the share 1 - alpha of all rays passes.
  bool alpha_blend = false;

  bool operator==(const MaterialSpec&) const = default;
};

/// Those that a material has.
std::vector<const TextureSpec*> textures_of(const MaterialSpec& material);
std::vector<TextureSpec*> textures_of(MaterialSpec& material);

/// Whether a file name ends in .gltf or .glb.
bool is_gltf(const std::string& path);

/// Which time of a file's animations a frame shows.
struct FileClock {
  float fps = 24;
  int start_frame = 0;      ///< the frame at time 0
  std::string animation{};  ///< as of GltfSceneSpec

  double seconds_at(double frame) const {
    return (frame - static_cast<double>(start_frame)) / static_cast<double>(fps);
  }
  double frame_at(double seconds) const {
    return seconds * static_cast<double>(fps) + static_cast<double>(start_frame);
  }
  bool operator==(const FileClock&) const = default;
};

/// Where a node of a glTF file is below its parent, in place of the file's and its animation.
struct PlacedNode {
  int node = 0;  ///< place in the file's list
  Matrix34 matrix{};

  bool operator==(const PlacedNode&) const = default;
};

/// What shapes a primitive of a glTF file: the morph weights and the skin of a node that shows it.
/// With a skin its vertices are in the world of the file.
struct ShapeSpec {
  int node = 0;  ///< place in the file's list
  /// The shape deforms as the file's animations say; none: it rests.
  std::optional<FileClock> animation{};
  std::vector<PlacedNode> places{};  ///< nodes of the file, such as bones

  bool operator==(const ShapeSpec&) const = default;
};

struct MeshSpec {
  std::string path;  ///< .ply .obj .off .gltf .glb
  /// Interpolate vertex normals (computed when the file has none).
  bool smooth_normals = true;
  /// One primitive of one mesh of a glTF file, by their places in its lists, flat where it has no
  /// normals; -1: all that the file shows.
  int mesh = -1;
  int primitive = 0;
  std::optional<ShapeSpec> shaped_by{};  ///< none: as the primitive is

  bool deforms() const { return shaped_by && shaped_by->animation; }
  bool operator==(const MeshSpec&) const = default;
};

/// A rigid motion, with scale, of an object that is already placed: scaled, turned by `rotate_deg`
/// (x, then y, then z; angles are joined as numbers, so 0 to 360 is a full turn), turned by
/// `quaternion`, each about the place that the object's `translate` names, then moved by
/// `translate`. With a scale of 0 the object is not there.
struct ObjectKey {
  double frame = 1;
  Vec3 translate{};
  Vec3 rotate_deg{};
  std::array<float, 4> quaternion{0, 0, 0, 1};  ///< x, y, z, w; need not be unit
  Vec3 scale{1, 1, 1};
  /// In place of all other members but frame; joined linearly.
  std::optional<Matrix34> matrix{};

  bool operator==(const ObjectKey&) const = default;
};

/// Which axis of a mesh's file points up.
enum class UpAxis : std::uint8_t { x, y, z };

/// A mesh placed in the world: first mapped by `matrix`, then turned so that its `up_axis` is y,
/// then scaled, then rotated (x, then y, then z), then translated. `fit_height` scales it to that
/// height before it is moved. Before `translate`, `center` moves the middle of its bounds to
/// x = z = 0 and `place_on_ground` its lowest point to y = 0.
struct ObjectSpec {
  std::string mesh;
  std::string material;
  /// For people (object_names); objects of one name are one to them.
  std::string name{};
  Vec3 translate{0, 0, 0};
  Vec3 rotate_deg{0, 0, 0};
  Vec3 scale{1, 1, 1};
  UpAxis up_axis = UpAxis::y;
  std::optional<float> fit_height{};
  bool center = false;
  bool place_on_ground = false;
  std::optional<Matrix34> matrix{};
  std::vector<ObjectKey> keys{};  ///< ascending frames; none: stands still
  std::optional<GltfMotion> gltf{};
  /// It is not in the image: what shadows take from it is in the channels `shadow`.
  bool catcher = false;

  bool operator==(const ObjectSpec&) const = default;
};

/// A horizontal square centred on the origin.
struct GroundSpec {
  std::string material;
  float height = 0;
  float size = 100;      ///< side length
  bool catcher = false;  ///< as of objects

  bool operator==(const GroundSpec&) const = default;
};

/// Where a node is below its parent: scaled, rotated (x, then y, then z), moved.
struct PlaceSpec {
  Vec3 translate{0, 0, 0};
  Vec3 rotate_deg{0, 0, 0};
  Vec3 scale{1, 1, 1};

  bool operator==(const PlaceSpec&) const = default;
};

/// What a job says of a node of its glTF file, and of all nodes below it.
struct GltfNodeSpec {
  bool visible = true;
  /// In place of the materials of the file; empty: those of the file.
  std::string material{};
  bool catcher = false;  ///< as of objects
  /// Place of the node alone, instead of the file's and its animation.
  std::optional<PlaceSpec> place{};

  bool operator==(const GltfNodeSpec&) const = default;
};

/// A glTF file whose scene is shown: its meshes, materials, and the animations of its nodes.
struct GltfSceneSpec {
  std::string file;  ///< .gltf .glb
  float fps = 24;
  int start_frame = 0;  ///< the frame at time 0
  /// The animation that plays, by its name or its place in the file's list; empty: all of them.
  std::string animation{};
  std::map<std::string, GltfNodeSpec> nodes{};  ///< by name

  bool operator==(const GltfSceneSpec&) const = default;
};

/// A file that others refer to.
struct FileSpec {
  std::string path;
  bool operator==(const FileSpec&) const = default;
};

/// gltf becomes materials, meshes and objects before a job is submitted
/// (common/scene/settle/settle_scene.h).
struct SceneSpec {
  std::optional<GltfSceneSpec> gltf;
  std::map<std::string, MaterialSpec> materials;
  std::map<std::string, MeshSpec> meshes;
  std::vector<ObjectSpec> objects;
  std::optional<GroundSpec> ground;
  /// Files beside those that meshes and materials name.
  std::vector<FileSpec> files;

  bool operator==(const SceneSpec&) const = default;
};

}  // namespace baton
