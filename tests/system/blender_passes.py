"""Run by Blender: opens an EXR file as a compositor does and prints its type, passes and Cryptomatte layers as JSON; then
renders the pass that is named through the compositor into an EXR file of one layer."""

import json
import sys

import bpy

source, wanted, width, height, output = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
scene.use_nodes = True
tree = scene.node_tree
tree.nodes.clear()
image = bpy.data.images.load(source)
node = tree.nodes.new("CompositorNodeImage")
node.image = image
crypto = tree.nodes.new("CompositorNodeCryptomatteV2")
crypto.source, crypto.image = "IMAGE", image
layers = []
for name in ("ViewLayer.CryptoObject", "ViewLayer.CryptoMaterial", "CryptoObject", "CryptoMaterial"):
    try:
        crypto.layer_name = name
        layers.append(name)
    except TypeError:
        pass
passes = [socket.name for socket in node.outputs if socket.enabled]
print("PASSES " + json.dumps({"type": image.type, "passes": passes, "crypto": layers}))

tree.links.new(node.outputs[wanted], tree.nodes.new("CompositorNodeComposite").inputs[0])
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.image_settings.exr_codec = "ZIP"
scene.render.filepath = output
bpy.ops.render.render(write_still=True)
