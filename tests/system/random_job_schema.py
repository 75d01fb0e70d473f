"""Draws values from a JSON schema: what a key may be is read from the schema itself, so keys that are added to it take
part by themselves. Only what a schema cannot say (files, geometry, frames) comes from `hand`. Standard library only."""

import math

# Optional keys are given this often.
SHARE = 0.35


class NotDrawn(Exception):
    """A required text of which the schema does not say what is meaningful."""


class SchemaDraw:
    """Draws values of a schema. hand: path -> function() -> value, where "scene.objects[].mesh" and
    "scene.materials.*" are paths; None leaves the key out. not_drawn: paths of texts that nobody could draw."""

    def __init__(self, schema, rng, hand):
        self.schema, self.rng, self.hand = schema, rng, hand
        self.drawn, self.not_drawn = set(), set()

    def resolve(self, node):
        """The node itself, or what it refers to."""
        while "$ref" in node:
            target = self.schema
            for part in node["$ref"].removeprefix("#/").split("/"):
                target = target[part]
            node = target
        return node

    def value(self, node, path=""):
        """A legal value of the node, in itself; what keys demand of each other is for the caller to mend."""
        if path in self.hand:
            self.drawn.add(path)
            return self.hand[path]()
        node = self.resolve(node)
        kind = node.get("type")
        if "const" in node:
            value = node["const"]
        elif "enum" in node:
            value = self.rng.choice(node["enum"])
        elif kind == "object":
            value = self.object(node, path)
        elif "oneOf" in node:
            value = self.one_of(node["oneOf"], path)
        elif kind == "array":
            value = self.array(node, path)
        elif kind == "boolean":
            value = self.rng.random() < 0.5
        elif kind in ("integer", "number"):
            value = self.number(node, kind == "integer")
        else:
            self.not_drawn.add(path)
            raise NotDrawn(path)
        self.drawn.add(path)
        return value

    def one_of(self, forms, path):
        """One of the forms that can be drawn."""
        forms = list(forms)
        self.rng.shuffle(forms)
        for form in forms:
            try:
                return self.value(form, path)
            except NotDrawn:
                continue
        raise NotDrawn(path)

    def object(self, node, path, share=SHARE):
        """Required keys, and each optional one with probability `share`; further ones of free names: none to two."""
        value = {}
        for key, inner in node.get("properties", {}).items():
            required = key in node.get("required", [])
            at = f"{path}.{key}" if path else key
            if not required and at not in self.hand and self.rng.random() > share:
                continue
            try:
                drawn = self.value(inner, at)
            except NotDrawn:
                if required:
                    raise
                continue
            if drawn is not None:
                value[key] = drawn
        if isinstance(node.get("additionalProperties"), dict):
            for i in range(self.rng.randrange(3)):
                value[f"name {i}"] = self.value(node["additionalProperties"], f"{path}.*")
        return value

    def array(self, node, path):
        """Few items; all of them different where the schema says so."""
        items = self.resolve(node["items"])
        if node.get("uniqueItems") and "enum" in items:
            chosen = [item for item in items["enum"] if self.rng.random() < 0.4]
            self.rng.shuffle(chosen)
            return chosen
        least = node.get("minItems", 0)
        count = self.rng.randint(least, max(least, min(node.get("maxItems", 3), 3)))
        return [self.value(node["items"], f"{path}[]") for _ in range(count)]

    def number(self, node, integer):
        """Often at an edge or near the default, else anywhere; integers near their defaults, since they cost time."""
        low = node.get("minimum", node.get("exclusiveMinimum", 0))
        high = node.get("maximum", node.get("exclusiveMaximum", 1e9))
        default = node.get("default")
        default = default if isinstance(default, (int, float)) else low
        most = min(high, max(4 * abs(default), low + 8)) if integer else high
        chance = self.rng.random()
        if chance < 0.12:
            value = low
        elif chance < 0.2 and high <= 100:
            value = high
        elif chance < 0.6 and default > 0 and low >= 0:
            value = default * 2 ** self.rng.uniform(-2, 2)
        elif most - low > 1000 and low >= 0:
            value = low + math.expm1(self.rng.uniform(0, math.log1p(most - low)))
        else:
            value = self.rng.uniform(low, most) if integer else self.rng.uniform(max(low, -1000), min(most, 1000))
        if integer:
            return min(max(round(value), low), most)
        value = float(f"{min(max(value, low), high):.6g}")
        if value <= node.get("exclusiveMinimum", -math.inf):
            value = node["exclusiveMinimum"] + min(1e-3, (high - node["exclusiveMinimum"]) / 2)
        if value >= node.get("exclusiveMaximum", math.inf):
            value = node["exclusiveMaximum"] - 1e-3
        return value


def key_paths(schema):
    """The paths of all keys of a schema, as SchemaDraw names them."""
    walk = SchemaDraw(schema, None, {})
    paths = set()

    def visit(node, path):
        node = walk.resolve(node)
        if path:
            paths.add(path)
        for key, inner in node.get("properties", {}).items():
            visit(inner, f"{path}.{key}" if path else key)
        for form in node.get("oneOf", []):
            if "properties" in form or "$ref" in form:
                visit(form, path)
        if isinstance(node.get("additionalProperties"), dict):
            visit(node["additionalProperties"], f"{path}.*")
        items = walk.resolve(node.get("items", {}))
        if items.get("type") == "object":
            visit(items, f"{path}[]")

    visit(schema, "")
    return {path for path in paths if not path.endswith("[]")}
