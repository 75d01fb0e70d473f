#!/usr/bin/env python3
"""Images of tiles (UDIM): each tile is seen where its number says, for any tiling; a missing one is one error; all are part
of the job."""


from assets import png
from farm import check, check_equal, run_tests
from jobs import make_job, write_job

# Four squares, from the lower left on.
COLOURS = {1001: (255, 0, 0), 1002: (0, 255, 0), 1011: (0, 0, 255), 1012: (255, 255, 0)}


def card_job(folder, tile_size=64):
    """A standing card of 2 x 2 tiles under an even sky, seen from straight ahead."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, colour in COLOURS.items():
        size = 1 if number == 1001 else 4
        (folder / f"card.{number}.png").write_bytes(png(size, 2 * size, lambda _x, _y, colour=colour: colour))
    places = [(x, y) for y in range(3) for x in range(3)]
    lines = [f"v {x - 1} {y} 0" for x, y in places] + [f"vt {x} {y}" for x, y in places]
    for row in range(2):
        for column in range(2):
            corners = [row * 3 + column + step for step in (1, 2, 5, 4)]
            lines.append("f " + " ".join(f"{c}/{c}" for c in corners))
    (folder / "card.obj").write_text("\n".join(lines) + "\n", encoding="ascii")
    job = make_job(folder, frames="1", image={"width": 40, "height": 40, "sites": 4, "tileSize": tile_size},
                   sampling={"method": "pool", "numParticles": 4, "numCandidates": 32}, output={"pixelType": "float"})
    job["camera"] = {"position": [0, 1, 5], "lookAt": [0, 1, 0], "verticalFovDeg": 20}
    job["scene"] = {"materials": {"paper": {"type": "diffuse", "color": [1, 1, 1], "colorTexture": "card.<UDIM>.png"}},
                    "meshes": {"card": "card.obj"}, "objects": [{"mesh": "card", "material": "paper"}]}
    job["output"]["aovs"] = ["albedo"]
    return write_job(folder / "job.json", job)


def tiles_lie_where_their_numbers_say(programs, folder):
    whole, small = folder / "whole", folder / "small"
    programs.render(card_job(whole), whole / "work")
    programs.render(card_job(small, 16), small / "work", workers=2)
    check_equal(programs.pixels(small / "frames"), programs.pixels(whole / "frames"), "pixels in small tiles")
    frame = whole / "frames/frame.0001.exr"
    albedo = list(zip(*(programs.values(frame, f"albedo.{c}") for c in "RGB")))
    for number, colour in COLOURS.items():
        column, row = (number - 1001) % 10, (number - 1001) // 10
        for x in (10, 19) if column == 0 else (20, 29):
            for y in (29, 20) if row == 0 else (19, 10):
                seen = albedo[40 * y + x]
                check(all(abs(s - c / 255) < 1e-3 for s, c in zip(seen, colour)), f"{number} at {x}, {y}: {seen}")


def a_missing_tile_is_one_error(programs, folder):
    path = card_job(folder)
    (folder / "card.1011.png").unlink()
    for command in (["check", path], ["render", path]):
        lines = programs.refuses(*command, says="card.1011.png, which is missing").splitlines()
        told = [line for line in lines if "card.1011.png, which is missing" in line]
        check_equal(len(told), 1, f"lines of {command}: {lines}")
        check('material "paper": colorTexture needs' in told[0], told[0])
    for number in COLOURS:
        (folder / f"card.{number}.png").unlink(missing_ok=True)
    programs.refuses("check", path, says="card.<UDIM>.png: none of the tiles 1001 to 1100 is there")


def tiles_are_part_of_the_job(programs, folder):
    path = card_job(folder)
    programs.render(path, folder / "work")
    (folder / "card.1012.png").write_bytes(png(1, 1, lambda _x, _y: (9, 9, 9)))
    failed = programs.render(path, folder / "work", expect=None)
    check(failed.returncode != 0 and "card.1012.png" in failed.stderr, failed.stderr)


if __name__ == "__main__":
    run_tests()
