"""Materials of a glTF document as a job says them. Standard library only."""

import math

WRAPS = {33071: "clamp", 33648: "mirror"}
NEAREST = 9728
REPEAT = 10497


# Cycles shows a quarter of the Principled BSDF's Clearcoat, and Blender's exporter writes all of it.
SHOWN_OF_COAT = 0.25


def mend(document):
    """Blender's exporter writes a reflection of 0 as a colour alone, which leaves that at grazing angles, and coats four
    times as strong as Cycles shows them."""
    for material in document.get("materials", []):
        coat = material.get("extensions", {}).get("KHR_materials_clearcoat")
        if coat:
            coat["clearcoatFactor"] = SHOWN_OF_COAT * coat.get("clearcoatFactor", 0)
        specular = material.get("extensions", {}).get("KHR_materials_specular")
        if specular and max(specular.get("specularColorFactor", [1])) == 0:
            specular.pop("specularColorFactor")
            specular["specularFactor"] = 0
            material["extensions"].pop("KHR_materials_ior", None)


def diffuse(document, material, file):
    """The material of the job for a glTF material that stands for a Diffuse BSDF: Lambert's law alone."""
    surface = material.get("pbrMetallicRoughness", {})
    out = {"type": "diffuse", "color": [round(c, 7) for c in surface.get("baseColorFactor", [1, 1, 1])[:3]]}
    if "baseColorTexture" in surface:
        out["colorTexture"] = texture(document, surface["baseColorTexture"], file)
    if "normalTexture" in material:
        info = material["normalTexture"]
        out["normalTexture"] = {**texture(document, info, file), "strength": info.get("scale", 1)}
    return out


def texture(document, info, file):
    """An image of the glTF file, and how it lies on the surface."""
    used = document["textures"][info["index"]]
    sampler = document["samplers"][used["sampler"]] if "sampler" in used else {}
    moved = info.get("extensions", {}).get("KHR_texture_transform", {})
    out = {"file": file, "image": used["source"]}
    for axis in "UV":
        wrap = WRAPS.get(sampler.get({"U": "wrapS", "V": "wrapT"}[axis], REPEAT))
        if wrap:
            out["wrap" + axis] = wrap
    if sampler.get("magFilter") == NEAREST:
        out["filter"] = "nearest"
    if moved.get("texCoord", info.get("texCoord", 0)):
        out["uv"] = moved.get("texCoord", info.get("texCoord"))
    if "offset" in moved:
        out["offset"] = moved["offset"]
    if "scale" in moved:
        out["scale"] = moved["scale"]
    if "rotation" in moved:
        out["rotateDeg"] = math.degrees(moved["rotation"])
    return out
