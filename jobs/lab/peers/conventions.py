"""From Baton's axes and angles to Blender's. Standard library only: the script inside Blender uses it, too.

Baton: y up; the centre of a lat-long map shows +z, u = 1/2 - atan2(x, z) / (2 pi), v = angle from +y / pi downwards.
Cycles: z up; the centre shows +x, u = 1/2 - atan2(y, x) / (2 pi), v = 1/2 + asin(z) / pi upwards.
So Baton's (x, y, z) is Blender's (z, x, y): a rotation that takes one map to the other, texel by texel.
"""

import math

SENSOR_MM = 24.0


def to_blender(v):
    """A point or direction."""
    x, y, z = v
    return (z, x, y)


def flat_to_blender(values):
    """The same for an array of x, y, z, x, y, z, ... of array.array."""
    out = values[:]
    out[0::3], out[1::3], out[2::3] = values[2::3], values[0::3], values[1::3]
    return out


def permuted(matrix):
    """A row-major 3 x 3 matrix between Baton's directions as one between Blender's."""
    order = (2, 0, 1)  # Blender's axis k is Baton's axis order[k]
    return [[matrix[3 * row + column] for column in order] for row in order]


def object_matrix(matrix):
    """A row-major 3 x 4 matrix of an object as Blender's 4 x 4."""
    linear = permuted([matrix[4 * row + column] for row in range(3) for column in range(3)])
    offset = to_blender((matrix[3], matrix[7], matrix[11]))
    return [[*row, moved] for row, moved in zip(linear, offset)] + [[0.0, 0.0, 0.0, 1.0]]


def camera_matrix(camera):
    """Where the camera is: columns right, up, back, position. Both renderers look along -z with y up."""
    columns = [to_blender(camera[name]) for name in ("right", "up", "back", "position")]
    return [[column[row] for column in columns] for row in range(3)] + [[0.0, 0.0, 0.0, 1.0]]


def lens_mm(vertical_fov_deg):
    """Focal length for a sensor SENSOR_MM high."""
    return 0.5 * SENSOR_MM / math.tan(math.radians(0.5 * vertical_fov_deg))


def map_euler(rotation):
    """Angles about x, y, z (radians; first x, last z) of the map's lookup: Blender's direction in the world to that in
    the map. rotation: row-major, Baton's direction in the map to that in the world."""
    world_to_map = [list(column) for column in zip(*permuted(rotation))]
    return euler_xyz(world_to_map)


def euler_xyz(m):
    """Angles with m = Rz(c) Ry(b) Rx(a), as Blender's 'XYZ'."""
    level = math.hypot(m[0][0], m[1][0])
    if level > 1e-6:
        return (math.atan2(m[2][1], m[2][2]), math.atan2(-m[2][0], level), math.atan2(m[1][0], m[0][0]))
    return (math.atan2(-m[1][2], m[1][1]), math.atan2(-m[2][0], level), 0.0)


def cycles_texel(direction, width, height):
    """Column and row (from the top) where Cycles 3.4 looks up a lat-long map along a unit direction."""
    x, y, z = direction
    u = 0.5 - math.atan2(y, x) / (2 * math.pi)
    v = 1 - math.acos(max(-1.0, min(1.0, z))) / math.pi
    return u * width, (1 - v) * height


def baton_texel(direction, width, height):
    """The same of Baton."""
    x, y, z = direction
    return (0.5 - math.atan2(x, z) / (2 * math.pi)) * width, math.atan2(math.hypot(x, z), y) / math.pi * height
