"""Writes the shapes as a .glb by Blender's own exporter, then their motion; runs inside Blender."""

import contextlib
import os
import sys

import bpy
import numpy
from mathutils import Matrix

from . import gltf_materials
from .glb import Glb, frames_of_targets, tracks_of, weights_of

SHEAR = 1e-4


class ExporterFailed(Exception):
    """What Blender's glTF exporter says when it fails."""


def write(path, geometry, frames, fps, diffuse, report):
    """geometry: shapes with a matrix for each frame. Frame n is at n / fps seconds, as Blender has it.

    The job's materials for those named in `diffuse`, which glTF says less exactly, and what it says of nodes."""
    shapes = list(geometry.shapes.values())
    names = put_in_scene(shapes, geometry.poses, report)
    for mesh in dict.fromkeys(shape.mesh for shape in shapes):
        if mesh in geometry.poses:
            add_targets(mesh, geometry.poses[mesh])
    run_exporter(path)
    file = Glb.read(path)
    nodes = {node["name"]: index for index, node in enumerate(file.document.get("nodes", []))}
    missing = [name for name in names if name not in nodes]
    if missing:
        raise RuntimeError(f"the glTF exporter left out {', '.join(missing[:5])}")
    tracks = []
    for name, shape in zip(names, shapes):
        if is_moving(shape):
            tracks += tracks_of(nodes[name], [gltf_place(matrix) for matrix in shape.matrices])
        if shape.mesh in geometry.poses:
            tracks.append((nodes[name], "weights", weights_of(geometry.poses[shape.mesh])))
    file.animate("shot", tracks, [frame / fps for frame in frames])
    gltf_materials.mend(file.document)
    file.write(path)
    own = {material["name"]: gltf_materials.diffuse(file.document, material, path.name)
           for material in file.document.get("materials", []) if material["name"] in diffuse}
    return own, {name: {"catcher": True} for name, shape in zip(names, shapes) if shape.catcher}


def run_exporter(path):
    # It would look for UV maps in these, too.
    shown = {item.data for item in bpy.context.scene.objects}
    for mesh in bpy.data.meshes:
        if mesh not in shown:
            mesh.materials.clear()
    try:
        with silence():
            bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_active_scene=True, export_yup=True,
                                      export_animations=False, export_cameras=False, export_lights=False, export_skins=False,
                                      export_morph=True, export_morph_normal=True, export_morph_tangent=False,
                                      export_apply=False, export_colors=False, export_extras=False)
    except RuntimeError as fault:  # its traceback
        said = [line.strip() for line in str(fault).splitlines() if line.strip() and not line.lower().startswith("location:")]
        raise ExporterFailed(f"Blender's glTF exporter failed: {said[-1]}") from None


@contextlib.contextmanager
def silence():
    """Of what Blender and its add-ons print: twice the traceback where one fails."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    nothing = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 1)
        os.dup2(nothing, 2)
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, copy in zip((1, 2), kept):
            os.dup2(copy, number)
            os.close(copy)
        os.close(nothing)


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


def add_targets(mesh, poses):
    """A shape key for each frame in which the mesh is another than in the first one."""
    holder = next(item for item in bpy.context.scene.objects if item.data == mesh)
    holder.shape_key_add(name="first")
    for frame in frames_of_targets(poses):
        key = holder.shape_key_add(name=f"frame {frame}", from_mix=False)
        key.data.foreach_set("co", poses[frame].ravel())


def transformed(matrix, places):
    rows = numpy.array(matrix)
    return (places @ rows[:3, :3].T + rows[:3, 3]).astype(numpy.float32)


def put_in_scene(shapes, poses, report):
    """A scene of its own, without parents; the names of the objects. poses: of meshes (geometry.py)."""
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
                if shape.mesh in poses:
                    poses[mesh] = [None if pose is None else transformed(matrix, pose) for pose in poses[shape.mesh]]
                shape.mesh = mesh
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

