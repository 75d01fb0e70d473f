"""The camera of a scene as that of a job; runs inside Blender."""

import math

from mathutils import Vector

from . import conventions, keys

SHEAR = 1e-4  # cosine between two axes
TOLERANCE = 2e-6  # of the picture's height and of the distance to what is looked at


class Camera:
    """Collects the camera frame by frame."""

    def __init__(self, scene, report):
        self.scene, self.report = scene, report
        self.rows = []      # position, lookAt, up, verticalFovDeg
        self.statics = []   # what a job has once: orthographic height, shift, aperture
        self.reach = 1.0

    def where(self):
        return f'camera "{self.scene.camera.name}"'

    def take(self, depsgraph):
        scene, shown = self.scene, self.scene.camera.evaluated_get(depsgraph)
        data = shown.data
        width, height = picture_size(scene)
        matrix = shown.matrix_world
        right, up, back = (matrix.to_3x3().col[axis].normalized() for axis in range(3))
        self.check_axes(right, up, back)
        self.check_clipping(data, matrix.translation, back, depsgraph)
        eye = matrix.translation
        distance = self.focus_distance(data, eye, back, depsgraph)
        if not self.rows:
            self.reach = max(1.0, eye.length)
        ahead = eye - back * (distance or self.reach)
        is_orthographic = data.type == "ORTHO"
        fit = (width, height, data.sensor_fit)
        fov = 40.0
        if not is_orthographic:
            fov = conventions.vertical_fov_deg(*fit, data.sensor_width, data.sensor_height, data.lens)
        self.rows.append([*conventions.to_baton(eye), *conventions.to_baton(ahead), *conventions.to_baton(up), fov])
        self.statics.append({
            "orthographicHeight": [conventions.orthographic_height(*fit, data.ortho_scale)] if is_orthographic else [],
            "verticalFovDeg": [] if is_orthographic else [fov],
            "shift": conventions.shift_in_heights(*fit, data.shift_x, data.shift_y),
            "aperture": [conventions.aperture(is_orthographic, data.lens, data.dof.aperture_fstop) if distance else 0.0],
            "focusDistance": [distance or 0.0]})

    def check_axes(self, right, up, back):
        """Cycles takes them as they are; a camera of a job has upright ones."""
        if right.dot(up.cross(back)) < 0:
            self.report.add(self.where(), "it is mirrored", "make the scale of it and its parents positive")
        if max(abs(right.dot(up)), abs(up.dot(back)), abs(back.dot(right))) > SHEAR:
            self.report.add(self.where(), "it is sheared", "apply the scale of its parents (Object > Apply > Scale)")

    def check_clipping(self, data, eye, back, depsgraph):
        """Whether a box around an object reaches beyond the clip end, or lies ahead of the camera, but before the clip start."""
        for instance in depsgraph.object_instances:
            if not instance.show_self or instance.object.type != "MESH":
                continue
            place = instance.matrix_world
            depths = [back.dot(eye - place @ Vector(corner)) for corner in instance.object.bound_box]
            for is_cut, what in ((max(depths) > data.clip_end, "End"), (0 < min(depths) < data.clip_start, "Start")):
                if is_cut:
                    self.report.add(self.where(), f"its Clip {what}, which cuts objects", f"change its Clip {what}")

    def focus_distance(self, data, eye, back, depsgraph):
        """Along the view; None without depth of field."""
        if not data.dof.use_dof:
            return None
        target = data.dof.focus_object
        if target is None:
            return max(data.dof.focus_distance, 1e-4)
        place = target.evaluated_get(depsgraph).matrix_world
        if target.type == "ARMATURE" and data.dof.focus_subtarget in target.pose.bones:
            place = place @ target.evaluated_get(depsgraph).pose.bones[data.dof.focus_subtarget].matrix
        return max(abs(Vector(back).dot(place.translation - eye)), 1e-4)

    def job(self, frames):
        """`camera` of the job."""
        first = self.statics[0]
        moved = {name for name in first for s in self.statics if not keys.is_constant([first[name], s[name]], 1e-6)}
        camera = {}
        if first["orthographicHeight"]:
            camera.update(projection="orthographic", orthographicHeight=number(first["orthographicHeight"][0]))
        if any(first["shift"]):
            camera["shift"] = numbers(first["shift"])
        if first["aperture"][0] > 0:
            camera["aperture"] = number(first["aperture"][0])
            if "focusDistance" not in moved:  # else as far as lookAt, which has keys
                camera["focusDistance"] = number(first["focusDistance"][0])
        for name, what in (("orthographicHeight", "its orthographic scale"), ("shift", "its shift"),
                           ("aperture", "its aperture, by f-stop or focal length,")):
            if name in moved:
                self.report.add(self.where(), f"{what} changes, but stays as in the first frame",
                                "keep it constant, or export parts of the shot")
        scale = max(1.0, *(abs(value) for row in self.rows for value in row[:6]))
        # Angles of view count in degrees: as shares of a radian they weigh as directions do.
        weighed = [[*(v / scale for v in r[:6]), *r[6:9], math.radians(r[9])] for r in self.rows]
        kept = keys.reduce_linear(frames, weighed, TOLERANCE)
        said = [self.key(row, with_fov="verticalFovDeg" in moved) for row in self.rows]
        if first["verticalFovDeg"] and "verticalFovDeg" not in moved:
            camera["verticalFovDeg"] = number(first["verticalFovDeg"][0])
        if len(kept) == 1:
            return {**camera, **said[0]}
        return {**camera, "keys": [{"frame": frames[i], **said[i]} for i in kept]}

    @staticmethod
    def key(row, with_fov):
        key = {"position": numbers(row[0:3]), "lookAt": numbers(row[3:6]), "up": numbers(row[6:9])}
        return {**key, "verticalFovDeg": number(row[9])} if with_fov else key


def picture_size(scene):
    render = scene.render
    share = render.resolution_percentage
    return max(1, render.resolution_x * share // 100), max(1, render.resolution_y * share // 100)


def number(value):
    """Short, and the same as a 32-bit number."""
    return float(f"{value:.9g}")


def numbers(values):
    return [number(value) for value in values]
