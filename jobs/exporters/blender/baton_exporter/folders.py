"""Folders of submitted jobs. Standard library only."""


def new_numbered(parent):
    """Makes `parent` and its next folder, 0001, 0002, ...: a job that is rendered reads its own until it ends."""
    parent.mkdir(parents=True, exist_ok=True)
    number = max((int(path.name) for path in parent.iterdir() if path.name.isdecimal()), default=0)
    while True:
        number += 1
        try:
            (parent / f"{number:04}").mkdir()
        except FileExistsError:  # another Blender was faster
            continue
        return parent / f"{number:04}"
