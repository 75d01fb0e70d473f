"""What a Blender file may have: functions that give a stage one trait each. Standard library only."""

import random

GROUPS = {}  # names to functions(stage, draw), by what they change


def trait(group):
    """Registers a function. A file has one trait of a group at most."""
    def register(build):
        GROUPS.setdefault(group, {})[build.__name__] = build
        return build
    return register


def names():
    return [name for group in GROUPS.values() for name in group]


def draw_traits(seed, number):
    """Of one file: names, functions and a random source for each. Below 0: that trait of names() alone."""
    functions = {name: build for group in GROUPS.values() for name, build in group.items()}
    if number < 0:
        name = names()[number]
        return [(name, functions[name], random.Random(f"{seed}/{name}"))]
    draw = random.Random(f"{seed}/{number}")
    groups = draw.sample(sorted(GROUPS), draw.choice((1, 2, 2, 3)))
    chosen = [draw.choice(sorted(GROUPS[group])) for group in groups]
    return [(name, functions[name], random.Random(f"{seed}/{number}/{name}")) for name in chosen]
