"""Writes the shapes as a .glb by Blender's own exporter, then their motion; runs inside Blender."""

import bpy
from mathutils import Matrix

from . import gltf_materials
from .glb import Glb, tracks_of

SHEAR = 1e-4


def write(path, geometry, frames, fps, diffuse, report):
    """geometry: shapes with a matrix for each frame. Frame n is at n / fps seconds, as Blender has it.

    The job's materials for those named in `diffuse`, which glTF says less exactly."""
    shapes = list(geometry.shapes.values())
    names = put_in_scene(shapes, report)
    bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_active_scene=True, export_yup=True,
                              export_animations=False, export_cameras=False, export_lights=False, export_skins=False,
                              export_morph=False, export_apply=False, export_colors=False, export_extras=False)
    file = Glb.read(path)
    nodes = {node["name"]: index for index, node in enumerate(file.document.get("nodes", []))}
    missing = [name for name in names if name not in nodes]
    if missing:
        raise RuntimeError(f"the glTF exporter left out {', '.join(missing[:5])}")
    tracks = []
    for name, shape in zip(names, shapes):
        if is_moving(shape):
            tracks += tracks_of(nodes[name], [gltf_place(matrix) for matrix in shape.matrices])
    file.animate("shot", tracks, [frame / fps for frame in frames])
    gltf_materials.mend(file.document)
    file.write(path)
    return {material["name"]: gltf_materials.diffuse(file.document, material, path.name)
            for material in file.document.get("materials", []) if material["name"] in diffuse}


def is_moving(shape):
    first = shape.matrices[0]
    size = max(1.0, max(abs(value) for row in first for value in row))
    return any(abs(a - b) > 1e-7 * size for matrix in shape.matrices[1:]
               for row, other in zip(matrix, first) for a, b in zip(row, other))


def gltf_place(matrix):
    """Translation, quaternion x y z w and scale in glTF's axes."""
    moved, turned, scaled = matrix.decompose()
    return ((moved.x, moved.z, -moved.y), (turned.x, turned.z, -turned.y, turned.w), (scaled.x, scaled.z, scaled.y))


def is_sheared(matrix):
    moved, turned, scaled = matrix.decompose()
    again = Matrix.LocRotScale(moved, turned, scaled)
    size = max(abs(value) for row in matrix.to_3x3() for value in row)
    return any(abs(a - b) > SHEAR * size for row, other in zip(again.to_3x3(), matrix.to_3x3())
               for a, b in zip(row, other))


def put_in_scene(shapes, report):
    """A scene of its own, without parents; the names of the objects."""
    for item in bpy.data.objects:
        if item.library:
            continue
        item.name = "source of " + item.name[:50]
    scene = bpy.data.scenes.new("baton")
    names = []
    for shape in shapes:
        mesh, matrix = shape.mesh, shape.matrices[0]
        if any(map(is_sheared, shape.matrices)):
            # Nodes of glTF turn and scale only: what stands still is sheared in its mesh.
            if is_moving(shape):
                report.add(f'object "{shape.name}"', "it is sheared while it moves, which is not exact",
                           "apply the scale of its parents (Object > Apply > Scale)")
            else:
                mesh = mesh.copy()
                mesh.transform(matrix)
                if matrix.is_negative:
                    mesh.flip_normals()
                matrix = Matrix.Identity(4)
                shape.matrices = [matrix] * len(shape.matrices)
        item = bpy.data.objects.new(shape.name, mesh)
        scene.collection.objects.link(item)
        item.rotation_mode = "QUATERNION"
        item.matrix_world = matrix
        names.append(item.name)
    bpy.context.window.scene = scene
    bpy.context.view_layer.update()
    return names

