"""From Blender's axes, cameras and worlds to Baton's. Standard library only, so that tests need no Blender.

Blender: z up; Cycles' lat-long map has +x in its centre and +y a quarter to the left.
Baton, as glTF: y up; the centre of a map is +z, +x a quarter to the left.
Blender's (x, y, z) is Baton's (x, z, -y), as Blender's glTF exporter writes it.
Matrices are lists of three rows.
"""

import math
import struct

TO_BATON = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
ROUNDING = 1e-5


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transposed(a):
    return [list(column) for column in zip(*a)]


def to_baton(v):
    """A point or direction."""
    return [v[0], v[2], -v[1]]


def turn(axis, angle):
    """Right-handed about x, y or z (0, 1, 2); radians."""
    c, s = math.cos(angle), math.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    m = [[float(row == column) for column in range(3)] for row in range(3)]
    m[i][i], m[i][j], m[j][i], m[j][j] = c, -s, s, c
    return m


def euler_matrix(angles):
    """Blender's 'XYZ': first about x, last about z; radians."""
    return product(turn(2, angles[2]), product(turn(1, angles[1]), turn(0, angles[0])))


# ---- the world ----------------------------------------------------------------------------------------------


class NotARotation(ValueError):
    """What a Mapping node does beyond turning the map."""


def mapping_lookup(vector_type, location, angles, scale):
    """The rotation from a direction in the world to one in the map that a Mapping node makes of its inputs.

    NotARotation where it also moves, mirrors or stretches."""
    if vector_type in ("POINT", "TEXTURE") and any(abs(value) > ROUNDING for value in location):
        raise NotARotation("its location distorts the map")
    if min(scale) <= 0 and not min(scale) == max(scale) == 0:
        raise NotARotation("its scale mirrors the map")
    if max(scale) - min(scale) > ROUNDING * max(scale) or max(scale) == 0:
        raise NotARotation("its scale stretches the map")
    rotation = euler_matrix(angles)
    return transposed(rotation) if vector_type == "TEXTURE" else rotation


def map_rotation(lookup):
    """Baton's rotation, a direction in the map to one in the world, of a lookup in Blender's axes."""
    turned = product(TO_BATON, product(transposed(lookup), transposed(TO_BATON)))
    return product(turned, turn(1, math.pi / 2))


def up_angle(rotation):
    """Degrees about y of a rotation that is one about y; None of any other."""
    if rotation[1][1] < 1 - 1e-6:
        return None
    return math.degrees(math.atan2(rotation[0][2] - rotation[2][0], rotation[0][0] + rotation[2][2]))


def axis_angle(rotation):
    """Unit axis and degrees in [0, 180]; the axis of no rotation is up."""
    m = rotation
    # The quaternion's largest element first, which loses least [Shepperd 1978].
    trace = m[0][0] + m[1][1] + m[2][2]
    squares = [1 + trace] + [1 + 2 * m[i][i] - trace for i in range(3)]
    largest = squares.index(max(squares))
    if largest == 0:
        q = [squares[0], m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [m[k][j] - m[j][k], 0, 0, 0]
        q[1 + i], q[1 + j], q[1 + k] = squares[largest], m[i][j] + m[j][i], m[i][k] + m[k][i]
    if q[0] < 0:
        q = [-value for value in q]
    sine = math.hypot(*q[1:])
    if sine <= 1e-9 * math.hypot(*q):
        return [0.0, 1.0, 0.0], 0.0
    return [value / sine for value in q[1:]], math.degrees(2 * math.atan2(sine, q[0]))


def uv_mapping(vector_type, location, angle, scale):
    """What a Mapping node does to UVs as location, angle and scale of a Point: first scaled, then turned, then moved.

    None where there is no such thing: a Texture that turns, then stretches."""
    if vector_type != "TEXTURE":
        return tuple(location), angle, tuple(scale)
    if 0 in scale:
        return None
    c, s = math.cos(angle), math.sin(angle)
    columns = (c / scale[0], -s / scale[1]), (s / scale[0], c / scale[1])
    if abs(columns[0][0] * columns[1][0] + columns[0][1] * columns[1][1]) > ROUNDING * math.hypot(*columns[0]) * math.hypot(*columns[1]):
        return None
    turned = math.atan2(columns[0][1], columns[0][0])
    stretched = math.hypot(*columns[0]), math.cos(turned) * columns[1][1] - math.sin(turned) * columns[1][0]
    moved = [-columns[0][i] * location[0] - columns[1][i] * location[1] for i in range(2)]
    return tuple(moved), turned, stretched


# ---- the camera ---------------------------------------------------------------------------------------------


def fitted_px(width, height, sensor_fit):
    """The side of the picture that the sensor's size, the orthographic scale and the shift refer to."""
    if sensor_fit == "AUTO":
        return max(width, height)
    return width if sensor_fit == "HORIZONTAL" else height


def vertical_fov_deg(width, height, sensor_fit, sensor_width, sensor_height, lens):
    """Angle between the upper and the lower border. 'AUTO' measures the longer side by the sensor's width."""
    sensor = sensor_height if sensor_fit == "VERTICAL" else sensor_width
    return math.degrees(2 * math.atan(0.5 * sensor / lens * height / fitted_px(width, height, sensor_fit)))


def orthographic_height(width, height, sensor_fit, scale):
    return scale * height / fitted_px(width, height, sensor_fit)


def shift_in_heights(width, height, sensor_fit, shift_x, shift_y):
    """[right, up] in heights of the picture."""
    side = fitted_px(width, height, sensor_fit) / height
    return [shift_x * side, shift_y * side]


def aperture(is_orthographic, lens_mm, fstop):
    """Diameter of the lens in scene units, as Cycles takes it: a focal length in thousandths of a unit, whatever the
    scene's unit; 1 for an orthographic camera."""
    return (1.0 if is_orthographic else lens_mm * 1e-3) / max(fstop, 1e-5)


def region(width, height, left, right, bottom, top):
    """x, y, width, height from the upper left corner of a border in shares of the picture from the lower left one.

    Blender multiplies as 32-bit numbers, then cuts: 0.95 of 300 pixels are 285."""
    def pixels(share, size):
        return int(as_float(as_float(share) * size))

    x0, x1, y0, y1 = pixels(left, width), pixels(right, width), pixels(bottom, height), pixels(top, height)
    return [x0, height - y1, x1 - x0, y1 - y0]


def as_float(value):
    return struct.unpack("f", struct.pack("f", value))[0]
