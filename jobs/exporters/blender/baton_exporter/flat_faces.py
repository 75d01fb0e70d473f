"""Bent faces that are shaded flat; runs inside Blender.

Cycles shades each triangle of them by itself, the glTF exporter writes one normal for the face: so they are cut."""

import bmesh
import numpy

BENT = 1e-4  # difference of unit normals


def cut_bent(mesh):
    """Cuts the faces as Cycles does. Where auto smooth is on, both use the same normals."""
    if mesh.use_auto_smooth or not len(mesh.polygons):
        return
    mesh.calc_loop_triangles()
    face_of = values(mesh.loop_triangles, "polygon_index", 1, numpy.int32).ravel()
    bent = numpy.abs(values(mesh.loop_triangles, "normal", 3) - values(mesh.polygons, "normal", 3)[face_of]).max(1) > BENT
    smooth = values(mesh.polygons, "use_smooth", 1, bool).ravel()
    wanted = set(face_of[bent & ~smooth[face_of]].tolist())
    if not wanted:
        return
    triangles = {}
    for triangle in mesh.loop_triangles:
        if triangle.polygon_index in wanted:
            start = mesh.polygons[triangle.polygon_index].loop_start
            triangles.setdefault(triangle.polygon_index, []).append([loop - start for loop in triangle.loops])

    edited = bmesh.new()
    edited.from_mesh(mesh)
    edited.faces.ensure_lookup_table()
    cut = [edited.faces[index] for index in sorted(wanted)]
    for face, index in zip(cut, sorted(wanted)):
        loops = list(face.loops)
        for corners in triangles[index]:
            corner_vertices = [loops[corner].vert for corner in corners]
            if edited.faces.get(corner_vertices):
                continue  # a face that lies on another
            new = edited.faces.new(corner_vertices, face)
            for loop, corner in zip(new.loops, corners):
                loop.copy_from(loops[corner])
    bmesh.ops.delete(edited, geom=cut, context="FACES_ONLY")
    edited.to_mesh(mesh)
    edited.free()
    mesh.update()


def values(items, name, width, kind=numpy.float32):
    """(items, width)."""
    out = numpy.empty(len(items) * width, kind)
    items.foreach_get(name, out)
    return out.reshape(-1, width)
