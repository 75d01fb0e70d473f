"""Values by frame: what is constant, linear or needs keys; frame numbers. Standard library only."""

import re


def is_constant(rows, tolerance):
    return all(abs(a - b) <= tolerance for row in rows for a, b in zip(row, rows[0]))


def reduce_linear(frames, rows, tolerance):
    """Indices of the rows from which straight lines between them give all rows within the tolerance.

    frames: ascending numbers; rows: as many equally long lists. At least the first; of one that is constant, only that.
    """
    if is_constant(rows, tolerance):
        return [0]
    kept, open_spans = {0, len(rows) - 1}, [(0, len(rows) - 1)]
    while open_spans:
        first, last = open_spans.pop()
        worst, where = tolerance, None
        for i in range(first + 1, last):
            share = (frames[i] - frames[first]) / (frames[last] - frames[first])
            error = max(abs(a + (b - a) * share - value) for a, b, value in zip(rows[first], rows[last], rows[i]))
            if error > worst:
                worst, where = error, i
        if where is not None:
            kept.add(where)
            open_spans += [(first, where), (where, last)]
    return sorted(kept)


def unwrapped(degrees):
    """Angles without jumps: each within half a turn of the one before."""
    out = []
    for angle in degrees:
        out.append(angle if not out else angle + 360 * round((out[-1] - angle) / 360))
    return out


def constant_speed(frames, values, tolerance):
    """Change per frame number where all values lie on one line, else None."""
    speed = (values[-1] - values[0]) / (frames[-1] - frames[0]) if len(frames) > 1 else 0.0
    on_line = all(abs(values[0] + speed * (f - frames[0]) - v) <= tolerance for f, v in zip(frames, values))
    return speed if on_line else None


def frame_text(first, last, step=1):
    """As `frames` of a job says it."""
    if last <= first or last - first < step:
        return str(first)
    return f"{first}-{last}" + (f"x{step}" if step > 1 else "")


def parse_frames(text):
    """The numbers of such a text, ascending: "1-24", "1-100x2", "1,5,9-12". ValueError if it is none."""
    numbers = []
    for part in text.split(","):
        match = re.fullmatch(r"(\d+)(?:-(\d+)(?:x(\d+))?)?", part)
        if not match:
            raise ValueError(f'frames "{text}": expected such as 12, 1-48, 1-100x2, 1,5,9-12, none below 0')
        first, last, step = (int(group) if group else None for group in match.groups())
        numbers += range(first, (first if last is None else last) + 1, step or 1)
    if numbers != sorted(set(numbers)) or not numbers:
        raise ValueError(f'frames "{text}": expected ascending numbers')
    return numbers


def sequence_number(frame, start, duration, offset, cyclic):
    """Number of the file that an image sequence of Blender shows in a frame of the scene."""
    number = frame - start + 1
    number = (number - 1) % duration + 1 if cyclic else min(max(number, 0), duration)
    return number + offset  # also of a cyclic one, which so may loop over 101 to 110


def numbered_file(name, number):
    """The name of a sequence's file with another number: its last digits, as many as there are."""
    match = re.search(r"(\d+)(\D*)$", name)
    if not match:
        return None
    return name[:match.start()] + str(number).zfill(len(match.group(1))) + match.group(2)
