"""Walks node trees; runs inside Blender."""


def source(socket):
    """The socket that feeds an input, reroutes skipped; None where it has a value of its own."""
    while socket.is_linked and socket.links[0].is_valid and not socket.links[0].is_muted:
        socket = socket.links[0].from_socket
        if socket.node.type != "REROUTE":
            return socket
        socket = socket.node.inputs[0]
    return None


def active_output(tree, kind):
    """The output node that Cycles renders: 'OUTPUT_MATERIAL' or 'OUTPUT_WORLD'."""
    found = tree.get_output_node("CYCLES") if tree else None
    return found if found and found.type == kind else None


def feeding(socket):
    """All nodes that feed an input, each once."""
    found, waiting = [], [socket]
    while waiting:
        given = source(waiting.pop())
        if given is not None and given.node not in found:
            found.append(given.node)
            waiting += list(given.node.inputs)
    return found


def keep_output(tree, output):
    """Removes all other outputs of a material, so that every reader takes this one."""
    for node in [node for node in tree.nodes if node.type == output.type and node != output]:
        tree.nodes.remove(node)
    output.target, output.is_active_output = "ALL", True


def constants(socket):
    """The sockets that hold the constants of a value: its own, that of a node, or those that a node works on."""
    given = source(socket)
    if given is None:
        return [socket]
    if given.node.type in ("RGB", "VALUE"):
        return [given]
    if given.node.type in ("MIX", "MATH"):
        kind = "VALUE" if given.node.type == "MATH" else given.type
        inputs = [item for item in given.node.inputs if item.enabled and item.type == kind and item.name != "Factor"]
        return [holder for item in inputs for holder in constants(item)]
    return []


def is_taken(sockets, given):
    """Whether one of these inputs, or a node behind them, takes an output."""
    behind = [socket for root in sockets for node in feeding(root) for socket in node.inputs]
    return any(source(socket) == given for socket in [*sockets, *behind])


def is_identity(mapping):
    """Of the mapping in the properties of texture nodes, which no panel shows."""
    return (tuple(mapping.translation) == (0, 0, 0) and tuple(mapping.rotation) == (0, 0, 0)
            and tuple(mapping.scale) == (1, 1, 1)
            and (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z) == ("X", "Y", "Z"))


def is_animated(owner):
    """Whether keys or drivers change an ID or its node tree."""
    for item in (owner, getattr(owner, "node_tree", None)):
        data = item.animation_data if item else None
        if data and (data.action or data.drivers or data.nla_tracks):
            return True
    return False
