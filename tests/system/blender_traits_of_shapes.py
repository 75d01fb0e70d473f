"""Traits of shapes: modifiers, particles, curves, instances, nodes, and what of them renders show."""

import math

import bpy
from blender_stage import keyed
from blender_trait import trait


def modifier(stage, kind, **values):
    made = stage.ball.modifiers.new(kind.lower(), kind)
    for name, value in values.items():
        setattr(made, name, value)
    return made


def nodes_of(stage):
    """A tree of geometry nodes on the ball, from its mesh to its output: tree, start, end."""
    tree = stage.ball.modifiers.new("nodes", "NODES").node_group = bpy.data.node_groups.new("nodes", "GeometryNodeTree")
    tree.inputs.new("NodeSocketGeometry", "Geometry")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def is_viewport(tree, true, false, kind="FLOAT"):
    """The output of a switch."""
    switch = tree.nodes.new("GeometryNodeSwitch")
    switch.input_type = kind
    tree.links.new(tree.nodes.new("GeometryNodeIsViewport").outputs[0], switch.inputs["Switch"])
    inputs = [socket for socket in switch.inputs if socket.enabled and socket.name in ("False", "True")]
    inputs[0].default_value, inputs[1].default_value = false, true
    return next(socket for socket in switch.outputs if socket.enabled)


def by_render(draw):
    """Whether the viewport and renders show something: never the same."""
    in_render = draw.random() < 0.5
    return not in_render, in_render


@trait("shape")
def is_viewport_node(stage, _draw):
    tree, start, end = nodes_of(stage)
    scaled = tree.nodes.new("GeometryNodeTransform")
    combine = tree.nodes.new("ShaderNodeCombineXYZ")
    size = is_viewport(tree, 0.3, 1.3)
    for socket in combine.inputs:
        tree.links.new(size, socket)
    tree.links.new(combine.outputs[0], scaled.inputs["Scale"])
    tree.links.new(start.outputs[0], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], end.inputs[0])


@trait("shape")
def nodes_that_make_instances(stage, draw):
    tree, start, end = nodes_of(stage)
    placed, brick = tree.nodes.new("GeometryNodeInstanceOnPoints"), tree.nodes.new("GeometryNodeMeshCube")
    brick.inputs["Size"].default_value = (0.3, 0.2, 0.2)
    tree.links.new(start.outputs[0], placed.inputs["Points"])
    tree.links.new(brick.outputs[0], placed.inputs["Instance"])
    last = placed
    if draw.random() < 0.5:
        last = tree.nodes.new("GeometryNodeRealizeInstances")
        tree.links.new(placed.outputs[0], last.inputs[0])
    tree.links.new(last.outputs[0], end.inputs[0])


@trait("shape")
def nodes_that_set_a_material(stage, _draw):
    tree, start, end = nodes_of(stage)
    given = tree.nodes.new("GeometryNodeSetMaterial")
    given.inputs["Material"].default_value = stage.diffuse("given", (0.7, 0.2, 0.1))
    tree.links.new(start.outputs[0], given.inputs[0])
    tree.links.new(given.outputs[0], end.inputs[0])


@trait("shape")
def subdivision(stage, draw):
    modifier(stage, "SUBSURF", levels=draw.randint(0, 1), render_levels=draw.randint(2, 3))


@trait("shape")
def adaptive_subdivision(stage, _draw):
    stage.scene.cycles.feature_set = "EXPERIMENTAL"
    modifier(stage, "SUBSURF", levels=0, render_levels=0)
    stage.ball.cycles.use_adaptive_subdivision = True


@trait("shape")
def screw(stage, draw):
    stage.ball.data = bpy.data.meshes.new("profile")
    stage.ball.data.from_pydata([(0.2, 0, -0.8), (0.9, 0, -0.3), (0.3, 0, 0.8)], [(0, 1), (1, 2)], [])
    stage.ball.data.materials.append(stage.plaster)
    modifier(stage, "SCREW", steps=3, render_steps=draw.randint(5, 24), use_smooth_shade=False)


@trait("shape")
def modifier_that_one_shows(stage, draw):
    viewport, render = by_render(draw)
    modifier(stage, "SIMPLE_DEFORM", deform_method="STRETCH", factor=0.5, show_viewport=viewport, show_render=render)


@trait("shape")
def modifiers(stage, draw):
    draw.choice((lambda: modifier(stage, "ARRAY", count=2, relative_offset_displace=(0, 0.8, 0.3)),
                 lambda: modifier(stage, "MIRROR", use_axis=(True, False, True)),
                 lambda: modifier(stage, "BEVEL", width=0.1, segments=2),
                 lambda: modifier(stage, "DECIMATE", ratio=0.4),
                 lambda: modifier(stage, "REMESH", voxel_size=0.3),
                 lambda: modifier(stage, "WIREFRAME", thickness=0.15),
                 lambda: modifier(stage, "OCEAN", viewport_resolution=2, resolution=6, size=0.3, spatial_size=10),
                 lambda: modifier(stage, "MULTIRES"),
                 lambda: modifier(stage, "SOLIDIFY", thickness=0.3),
                 lambda: modifier(stage, "TRIANGULATE"),
                 lambda: modifier(stage, "EDGE_SPLIT"),
                 lambda: modifier(stage, "CAST", factor=0.7, cast_type="CUBOID")))()


@trait("shape")
def simplify(stage, draw):
    render = stage.scene.render
    render.use_simplify, render.simplify_subdivision, render.simplify_subdivision_render = True, 3, draw.randint(0, 1)
    modifier(stage, "SUBSURF", levels=3, render_levels=3)


@trait("shape")
def shaded(stage, draw):
    """Smooth, by angles, or in part."""
    data = stage.ball.data
    kind = draw.choice(("smooth", "auto", "part"))
    for number, face in enumerate(data.polygons):
        face.use_smooth = kind != "part" or number % 2 == 0
    data.use_auto_smooth = kind == "auto"
    stage.ball.cycles.shadow_terminator_geometry_offset = stage.ball.cycles.shadow_terminator_offset = 0


def hair_of(stage, **values):
    system = stage.ball.modifiers.new("particles", "PARTICLE_SYSTEM").particle_system.settings
    brick = stage.mesh("brick", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 2)],
                       [(3, 2, 1, 0), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    brick.data.materials.append(stage.plaster)
    brick.location.z = -10
    for name, value in {"render_type": "OBJECT", "instance_object": brick, "particle_size": 0.15, **values}.items():
        setattr(system, name, value)
    return system


@trait("shape")
def particles(stage, draw):
    hair_of(stage, type="EMITTER", count=60, frame_start=0, frame_end=1, physics_type="NO", display_percentage=20,
            use_render_adaptive=False, size_random=0.3)
    stage.ball.show_instancer_for_render = draw.random() < 0.7


@trait("shape")
def child_particles(stage, draw):
    hair_of(stage, type="HAIR", count=8, hair_length=0.6, child_type=draw.choice(("SIMPLE", "INTERPOLATED")), child_nbr=1,
            rendered_child_count=9, child_radius=0.5)


@trait("shape")
def simplified_children(stage, _draw):
    render = stage.scene.render
    render.use_simplify, render.simplify_child_particles, render.simplify_child_particles_render = True, 1, 0.3
    hair_of(stage, type="HAIR", count=8, hair_length=0.6, child_type="SIMPLE", child_nbr=2, rendered_child_count=12)


@trait("shape")
def hair(stage, _draw):
    hair_of(stage, type="HAIR", render_type="PATH", count=200, hair_length=0.5, root_radius=5)


@trait("shape")
def instancer(stage, draw):
    """A grid that shows a child at each face or vertex, and is itself shown here or there."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=3, y_subdivisions=3, size=3, location=(0, 0, 0.6))
    grid = bpy.context.object
    stage.ball.parent, stage.ball.location, stage.ball.scale = grid, (0, 0, 0.2), (0.3, 0.3, 0.3)
    grid.instance_type = draw.choice(("FACES", "VERTS"))
    grid.show_instancer_for_viewport, grid.show_instancer_for_render = by_render(draw)


@trait("shape")
def collections(stage, draw):
    """One that is excluded, hidden here or there, and shown by an instance."""
    made = bpy.data.collections.new("kit")
    stage.scene.collection.children.link(made)
    made.objects.link(stage.ball)
    stage.scene.collection.objects.unlink(stage.ball)
    shown = stage.add("kit", None)
    shown.instance_type, shown.instance_collection = "COLLECTION", made
    shown.location, shown.scale = (1, -1.5, 0), (0.5, 0.5, draw.choice((0.5, -0.5, 0.8)))
    layer = bpy.context.view_layer.layer_collection.children["kit"]
    if draw.random() < 0.5:
        layer.exclude = True
    else:
        made.hide_viewport, made.hide_render = by_render(draw)
    layer.hide_viewport = draw.random() < 0.3


@trait("shape")
def hidden(stage, draw):
    stage.ball.hide_viewport, stage.ball.hide_render = by_render(draw)
    stage.post.hide_set(True)


@trait("shape")
def hidden_from_rays(stage, draw):
    setattr(stage.ball, "visible_" + draw.choice(("camera", "shadow")), False)


@trait("shape")
def special_objects(stage, draw):
    setattr(stage.ball, draw.choice(("is_holdout", "is_shadow_catcher")), True)
    stage.scene.render.film_transparent = True


def curve_of(stage, kind, points, **values):
    data = bpy.data.curves.new("curve", "CURVE")
    data.dimensions, data.bevel_depth, data.resolution_u, data.render_resolution_u = "3D", 0.15, 2, 0
    for name, value in values.items():
        setattr(data, name, value)
    for place in points:
        spline = data.splines.new(kind)
        spline.points.add(3) if kind != "BEZIER" else spline.bezier_points.add(2)
        for point, (x, y, z) in zip(spline.points if kind != "BEZIER" else spline.bezier_points, place):
            point.co = (x, y, z) if kind == "BEZIER" else (x, y, z, 1)
            if kind == "BEZIER":
                point.handle_left_type = point.handle_right_type = "AUTO"
        if kind != "BEZIER":
            spline.use_endpoint_u = True
    data.materials.append(stage.plaster)
    stage.ball.hide_render = True
    return stage.add("curve", data)


@trait("shape")
def splines_of_own_resolution(stage, draw):
    rows = [[(x - 2.5, y, 0.2), (x - 1.6, y, 1.8), (x - 0.7, y, 0.2), (x, y, 1.5)] for x, y in ((0, 0), (1.2, -1))]
    item = curve_of(stage, draw.choice(("BEZIER", "NURBS")), rows)
    item.data.splines[0].resolution_u, item.data.splines[1].resolution_u = 1, 12
    item.data.render_resolution_u = draw.choice((0, 0, 3))


@trait("shape")
def texts(stage, draw):
    data = bpy.data.curves.new("text", "FONT")
    data.body, data.size, data.extrude, data.resolution_u = "Bat", 1.5, 0.1, 1
    data.render_resolution_u = draw.choice((0, 4))
    item = stage.add("text", data)
    item.location, item.rotation_euler.x = (-2, -0.5, 0.3), math.pi / 2
    data.materials.append(stage.plaster)
    stage.ball.hide_render = True


@trait("shape")
def metaballs(stage, _draw):
    data = bpy.data.metaballs.new("drops")
    data.resolution, data.render_resolution = 1.0, 0.15
    for x in (-1.2, -0.3):
        data.elements.new().co = (x, 0, 1)
    data.materials.append(stage.plaster)
    stage.add("drops", data)
    stage.ball.hide_render = True


@trait("shape")
def surfaces(stage, draw):
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(-0.9, -0.5, 1))
    data = bpy.context.object.data
    data.resolution_u = data.resolution_v = 1
    data.render_resolution_u = data.render_resolution_v = draw.choice((0, 6))
    stage.ball.hide_render = True


@trait("shape")
def sheared(stage, draw):
    parent = stage.add("bent", None)
    parent.scale = (1.5, 0.7, draw.choice((1, -1)))
    stage.post.rotation_euler = (0.3, 0.5, 0.4)
    stage.post.parent = parent


@trait("shape")
def scaled(stage, draw):
    stage.post.scale = draw.choice(((-0.9, 0.9, 1.8), (-0.9, -0.9, 1.8), (0.9, 0.9, -1.8), (0.9, 0.9, 0)))


@trait("motion")
def moves(stage, draw):
    stage.scene.frame_end = 3
    keyed(stage.post, draw.choice(("location", "rotation_euler", "scale")), {1: (0.5, 0.3, 0.9), 3: (1.6, 1, 1.2)})


@trait("motion")
def deforms(stage, _draw):
    stage.scene.frame_end = 3
    stage.post.shape_key_add(name="base")
    leaning = stage.post.shape_key_add(name="leaning")
    for point in leaning.data:
        point.co.x += 0.8 * (point.co.z > 0)
    keyed(leaning, "value", {1: 0, 3: 1})


@trait("motion")
def hidden_for_a_while(stage, draw):
    stage.scene.frame_end = 3
    keyed(stage.post, draw.choice(("hide_render", "hide_viewport")), {1: True, 3: False})


@trait("motion")
def subdivided_later(stage, draw):
    stage.scene.frame_end = 3
    made = stage.post.modifiers.new("cut", "SUBSURF")
    name, first, last = draw.choice((("render_levels", 0, 2), ("levels", 0, 2), ("show_render", False, True)))
    keyed(made, name, {1: first, 3: last})
