"""Faces that the glTF file cannot hold as Cycles shows them; runs inside Blender.

Bent faces that are shaded flat: Cycles shades each triangle of them by itself, the glTF exporter writes one normal for the
face: so they are cut. Faces without area: Baton refuses a part of a mesh that has only such ones."""

import bmesh
import numpy

BENT = 1e-4     # difference of unit normals
NO_AREA = 1e-7  # of the longest edge squared, as common/scene/mesh/mesh_builder.cpp has it


def drop_without_area(mesh):
    """Removes the faces of each material that has none with an area; vertices stay. How many faces."""
    if not len(mesh.polygons):
        return 0
    mesh.calc_loop_triangles()
    places = values(mesh.vertices, "co", 3).astype(numpy.float64)
    corners = places[values(mesh.loop_triangles, "vertices", 3, numpy.int32)]
    edges = numpy.roll(corners, 1, 1) - corners
    longest = (edges ** 2).sum(2).max(1)
    has_area = numpy.linalg.norm(numpy.cross(edges[:, 0], edges[:, 1]), axis=1) > NO_AREA * longest
    slots = values(mesh.polygons, "material_index", 1, numpy.int32).ravel()
    slot_of = slots[values(mesh.loop_triangles, "polygon_index", 1, numpy.int32).ravel()]
    unseen = ~numpy.isin(slots, slot_of[has_area])
    if unseen.any():
        edited = bmesh.new()
        edited.from_mesh(mesh)
        edited.faces.ensure_lookup_table()
        bmesh.ops.delete(edited, geom=[edited.faces[int(i)] for i in numpy.flatnonzero(unseen)], context="FACES_ONLY")
        write_back(edited, mesh)
    return int(unseen.sum())


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
    write_back(edited, mesh)


def write_back(edited, mesh):
    edited.to_mesh(mesh)
    edited.free()
    mesh.update()


def values(items, name, width, kind=numpy.float32):
    """(items, width)."""
    out = numpy.empty(len(items) * width, kind)
    items.foreach_get(name, out)
    return out.reshape(-1, width)
