"""What of a scene, its objects and its camera is not carried over, beside world and materials; runs inside Blender."""

SHAPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
UNSEEN = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT_PROBE"}
RAYS = {"camera": "the camera", "diffuse": "diffuse rays", "glossy": "glossy rays", "shadow": "shadow rays"}
LINEAR_VIEWS = {"Standard", "Raw"}


def check_scene(scene, view_layer, report):
    check_render(scene, view_layer, report)
    check_camera(scene, report)


def check_objects(objects, scene, report):
    """objects: what any frame shows."""
    for item in sorted(objects, key=lambda item: item.name):
        check_object(item, report)
        if scene.cycles.feature_set == "EXPERIMENTAL" and is_diced(item):
            report.add(f'object "{item.name}"', "adaptive subdivision: the levels of its modifier are taken",
                       "switch it off, and set Levels Render")


def check_render(scene, view_layer, report):
    render = scene.render

    def add(what, remedy):
        report.add(f'scene "{scene.name}"', what, remedy)

    if render.use_motion_blur:
        add("motion blur", "switch it off, or add it in a compositor from the AOV `motion`")
    if render.pixel_aspect_x != render.pixel_aspect_y:
        add("pixels that are not square", "set Aspect X and Y to 1")
    if render.use_multiview:
        add("stereoscopy", "render each eye as a shot of its own")
    if render.use_freestyle:
        add("Freestyle lines", "render them with Blender")
    if render.frame_map_old != render.frame_map_new:
        add("time remapping", "set Old and New to the same")
    if render.use_compositing and scene.use_nodes and scene.node_tree and composites(scene.node_tree):
        add("the compositor", "load the frames into it with an Image node")
    if render.use_sequencer and scene.sequence_editor and scene.sequence_editor.sequences_all:
        add("the video sequencer", "load the frames into it")
    if sum(layer.use for layer in scene.view_layers) > 1:
        add(f'view layers other than "{view_layer.name}"', "export a file for each")
    if view_layer.material_override:
        add("the material override of the view layer", "remove it")
    if any(c.holdout or c.indirect_only for c in layer_tree(view_layer.layer_collection) if not c.exclude):
        add("holdout or indirect-only collections", "hide them from the render")
    check_view(scene, add)
    check_cycles(scene, add)


def check_view(scene, add):
    """The frames are linear EXR, so it matters only where Blender would write something else."""
    if scene.render.image_settings.file_format in ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR"):
        return
    view = scene.view_settings
    if view.view_transform not in LINEAR_VIEWS or view.look != "None" or view.exposure or view.gamma != 1 \
            or view.use_curve_mapping:
        add(f'the view transform "{view.view_transform}" with look, exposure and gamma: frames are linear EXR',
            "apply it when the frames are viewed, or set Output > File Format to OpenEXR as Baton writes")


def check_cycles(scene, add):
    cycles = scene.cycles
    if scene.render.engine != "CYCLES":
        add(f"what only {scene.render.engine} shows", "judge by Cycles")
    fewest, most = sorted(min(n, cycles.max_bounces) for n in (cycles.diffuse_bounces, cycles.glossy_bounces))
    if fewest < most:
        add(f"{fewest} bounces of one kind of light: {most} of all are taken", "set those of diffuse and glossy light to the same")
    if cycles.pixel_filter_type == "BOX":
        return
    if abs(cycles.filter_width - 1.5) > 1e-3:
        add(f"a pixel filter {cycles.filter_width:g} wide: 1.5 is taken", "set its width to 1.5")


def composites(tree):
    """Whether the compositor does more than to pass the picture on."""
    return any(node.type not in ("R_LAYERS", "COMPOSITE", "VIEWER", "FRAME", "REROUTE") for node in tree.nodes)


def layer_tree(layer):
    yield layer
    for child in layer.children:
        yield from layer_tree(child)


def check_camera(scene, report):
    data = scene.camera.data
    where = f'camera "{scene.camera.name}"'
    if data.type == "PANO":
        report.add(where, "a panorama", "use a perspective or orthographic camera")
    dof = data.dof
    if dof.use_dof and (dof.aperture_blades or dof.aperture_ratio != 1):
        report.add(where, "the form of its aperture: it is round", "set Blades to 0 and Ratio to 1")
    if any(marker.camera for marker in scene.timeline_markers):
        report.add(f'scene "{scene.name}"', "cameras bound to markers: the scene's camera is taken",
                   "export a job for each camera, by --frames")


def check_object(item, report):
    where = f'object "{item.name}"'
    if item.type == "LIGHT":
        report.add(f'light "{item.name}"', f"a {item.data.type.lower()} lamp: the world alone lights",
                   "put it into the world's image")
    elif item.type == "VOLUME":
        report.add(where, "a volume", "hide it from the render")
    elif item.type not in SHAPES | UNSEEN:
        report.add(where, f"an object of type {item.type.lower()}", "convert it to a mesh")
    for system in item.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            report.add(where, f'hair "{system.name}"', "convert it to a mesh with a thickness")
        elif system.settings.type == "EMITTER" and system.settings.render_type not in ("OBJECT", "COLLECTION", "NONE"):
            report.add(where, f'particles "{system.name}" without a shape', "render them as objects")
    if item.type in SHAPES:
        check_rays(item, where, report)


def is_diced(item):
    """Whether Cycles subdivides an object as finely as the picture needs it."""
    last = item.modifiers[-1] if item.modifiers else None
    return last is not None and last.type == "SUBSURF" and last.show_render and item.cycles.use_adaptive_subdivision


def check_rays(item, where, report):
    if item.is_holdout:
        report.add(where, "a holdout", "hide it from the render")
    for name, rays in RAYS.items():
        if not getattr(item, f"visible_{name}"):
            report.add(where, f"it is hidden from {rays}", "let all rays see it, or hide it from the render")
