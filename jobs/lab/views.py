"""How CSV files of commands become the tables of pages: functions from rows to cells, the header first."""

import math
import re
from decimal import Decimal

SCENES = {"bunny-chalk-courtyard": "courtyard", "bunny-phong-forest": "forest", "elephant-gold-studio": "gold",
          "armadillo-mirror-night": "mirror", "elephant-chalk-interior": "interior", "armadillo-key-framed-sky": "sky",
          "moving-camera": "moving camera", "moving-object": "moving object"}
CHART_METHODS = {"environment": "`environment`", "mis": "`mis`", "bidirectional": "`bidirectional`",
                 "bidirectional-512": "`bidirectional`, M = 512", "sequential": "`sequential`", "restir": "`restir`",
                 "ratio": "`ratio`, M = 256", "pool-64": "`pool`, M = 64", "pool": "`pool`, M = 256", "auto": "`auto`"}


def digits(value, count=2):
    """A number with so many digits that count, without an exponent."""
    return format(Decimal(f"{value:#.{count}g}"), "f").rstrip(".")


def at_16(rows):
    """(scene, method) -> row, of the renderings with N = 16."""
    return {(row["scene"], row["method"]): row for row in rows if row["budget"] == "16"}


def chart(rows, methods, cell):
    by_key = at_16(rows)
    yield ["", *(CHART_METHODS[method] for method in methods)]
    for scene, name in SCENES.items():
        yield [name, *(cell(by_key[scene, method]) for method in methods)]


def over_bidirectional(row):
    return float(row["efficiencyOverBidirectional"])


def charts_efficiency(rows):
    return list(chart(rows, [m for m in CHART_METHODS if m != "bidirectional"], lambda row: digits(over_bidirectional(row))))


def charts_rmse(rows):
    return list(chart(rows, [m for m in CHART_METHODS if m != "auto"], lambda row: digits(float(row["rmse"]))))


def charts_time(rows):
    return list(chart(rows, [m for m in CHART_METHODS if m != "auto"],
                      lambda row: f"{float(row['cpuMicrosecondsPerPixel']):.1f}"))


def charts_pool(rows, finer):
    """`pool` over `bidirectional`, and over the best other unbiased method; finer: scenes with references of their own."""
    by_key, finer = at_16(rows), {row["scene"]: row for row in finer}
    others = ("environment", "mis", "bidirectional", "bidirectional-512", "sequential", "restir")
    table = [["", "over `bidirectional`", "over the best other"]]
    for scene, name in SCENES.items():
        if name in finer:
            table.append([f"{name}, by finer references", finer[name]["over bidirectional"], finer[name]["over the best other"]])
            continue
        pool = by_key[scene, "pool"]
        low, high = (digits(float(pool[key])) for key in ("overBidirectionalLow", "overBidirectionalHigh"))
        best = max(over_bidirectional(by_key[scene, method]) for method in others)
        most = max(over_bidirectional(by_key[scene, method]) for method in ("pool", "pool-64"))
        table.append([name, f"{digits(over_bidirectional(pool))} [{low}, {high}]", digits(most / best)])
    return table


ABLATION = [("", "**`mis`**"), ("mis", "as it is"), ("mis-compensated", "compensated"), ("mis-half-brdf", "half from the BRDF"),
            ("", "**`bidirectional`, M = 128, N = 16**"), ("bidirectional", "as it is"), ("M-32", "M = 32"), ("M-64", "M = 64"),
            ("M-256", "M = 256"), ("M-800", "M = 800"), ("N-8", "N = 8"), ("N-32", "N = 32"),
            ("brdf-fraction-0", "no BRDF candidates"), ("brdf-fraction-half", "half from the BRDF"),
            ("", "**`bidirectional` with the second pass**"), ("second-pass", "cross-fold"),
            ("second-pass-same", "same-samples (biased mask)"), ("second-pass-split", "split"),
            ("second-pass-dilated", "dilated by 1"), ("second-pass-published", "published form"),
            ("extra-samples", "extra samples instead"), ("", "**`sequential`, P = 5, refresh 8**"), ("sequential", "as it is"),
            ("P-1", "P = 1"), ("P-10", "P = 10"), ("P-1-moves-5", "P = 1, 5 moves"), ("local-deg-1", "local moves of 1 degree"),
            ("local-deg-16", "local moves of 16 degrees"), ("local-only", "local moves only"),
            ("independent-only", "independent moves only"), ("path-sampling", "path sampling, trapezoid"),
            ("path-left", "path sampling, left"), ("ess-never", "never resampled"), ("ess-always", "always resampled"),
            ("multinomial", "multinomial"), ("stratified", "stratified"), ("residual", "residual"),
            ("refresh-never", "never refreshed"), ("refresh-3", "refresh each 3 frames"),
            ("refresh-ratio-2", "refresh 8 and `refreshRatio` 2")]


def short(value):
    """Two digits that count, one where there are many zeros."""
    return digits(value, 2 if value >= 0.001 else 1)


def ablation(rows):
    by_key = {(row["scene"], row["method"]): row for row in rows}
    table = [["", "forest: RMSE", "µs", "efficiency", "gold: RMSE", "µs", "efficiency", "state"]]
    for method, name in ABLATION:
        if not method:
            table.append([name] + [""] * 7)
            continue
        line = [name]
        for scene in ("bunny-phong-forest", "elephant-gold-studio"):
            row = by_key[scene, method]
            star = "*" if float(row["biasLow"]) > 0 or float(row["biasHigh"]) < 0 else ""
            line += [f"{float(row['rmse']):.2g}{star}", f"{float(row['cpuMicrosecondsPerPixel']):.1f}", short(over_bidirectional(row))]
        state = float(by_key["bunny-phong-forest", method]["stateBytesPerPixel"])
        table.append(line + ([f"{state:.0f}"] if state else [""]))
    return table


VERDICTS = ("holds", "degrades", "fails")
SUITE = {"pool": "`pool`", "bidirectional": "`bidirectional`", "ratio": "`ratio`", "reference": "`reference`",
         "environment": "`environment`", "brdf": "`brdf`", "mis": "`mis`", "mis compensated": "`mis`, compensated",
         "restir": "`restir` (`historyLimit` 20)", "sequential": "`sequential` (`refreshEvery` 8)",
         "published refresh rule": "published, `refreshRatio` 1.5", "published P=5": "published, P = 5",
         "published P=1": "published, P = 1", "published path trapezoid": "published, path sampling, trapezoid",
         "published path left": "published, path sampling, left sum"}


def verdicts(grid):
    """Cases by verdict, methods with the same numbers in one row, the steadiest first."""
    counts = {}
    for row in grid:
        counts.setdefault(row["method"], dict.fromkeys(VERDICTS, 0))[row["verdict"]] += 1
    rows = {}
    for method, count in counts.items():
        rows.setdefault(tuple(count[verdict] for verdict in VERDICTS), []).append(method)
    return [["method", *VERDICTS]] + [["; ".join(SUITE.get(method, method) for method in methods), *map(str, count)] for count, methods in
                                      sorted(rows.items(), key=lambda item: (-item[0][0], item[0][2]))]


ACCURACY = [("`pool`, M = 256", "pool", "pool", "a memory", "yes"),
            ("`bidirectional`, M = 512", "bidirectional-512", "", "nothing", "yes"),
            ("`bidirectional`", "bidirectional", "bidirectional", "nothing", "yes"),
            ("`ratio`, M = 256", "ratio", "ratio", "nothing", "consistent only"),
            ("`restir`", "restir", "restir", "samples", "yes"), ("`mis`", "mis", "mis", "nothing", "yes"),
            ("`environment`", "environment", "environment", "nothing", "yes"), ("`brdf`", "", "brdf", "nothing", "yes"),
            ("`sequential`, refresh 8", "sequential", "sequential", "samples", "with limits"),
            ("`sequential` as published, P = 5", "", "published P=5", "samples", "with limits")]


def accuracy(charts, grid, finer):
    """One row a method: efficiency over that of `bidirectional`, least to most, gold apart; verdicts of the suite."""
    by_key = at_16(charts)
    counts = {}
    for row in grid:
        counts.setdefault(row["method"], dict.fromkeys(VERDICTS, 0))[row["verdict"]] += 1
    fine = {row["scene"]: row["over bidirectional"].split(" ")[0] for row in finer}
    table = [["method", "carries", "unbiased", "eight real scenes", *VERDICTS]]
    for name, chart_name, case_name, carries, unbiased in ACCURACY:
        scenes = [scene for scene, called in SCENES.items() if chart_name != "pool" or called not in fine]
        values = [over_bidirectional(by_key[scene, chart_name]) for scene in scenes] if chart_name else []
        text = f"{short(min(values))} to {digits(max(values))}" if values else "not measured"
        if chart_name == "bidirectional":
            text = "1"
        if chart_name == "pool":
            text += "".join(f", {scene} {value}" for scene, value in fine.items())
        table.append([name, carries, unbiased, text, *(str(counts[case_name][v]) if case_name else "" for v in VERDICTS)])
    return table


CORRELATED = [("environment N=64", "`environment`, N = 64"), ("mis N=64", "`mis`, N = 64"),
              ("bidirectional N=20 M=800", "`bidirectional`, N = 20, M = 800"), ("bidirectional N=16 M=725", "`bidirectional`, N = 16"),
              ("bidirectional N=64 M=725", "`bidirectional`, N = 64"), ("corrected C=16, same", "corrected, `same-samples`"),
              ("corrected, split", "corrected, `split`"), ("corrected C=16", "corrected, `cross-fold`"),
              ("corrected, dilated 3x3", "`cross-fold`, mask dilated 3x3"), ("published, same samples", "published, `same-samples`"),
              ("published-kept, same", "published-kept, `same-samples`"), ("extra-samples C=1", "`extra-samples`, C = 1"),
              ("corrected after mis N=64", "corrected, C = 4, after `mis` N = 64")]


def correlated_error(*figures):
    figures = [{row["case"]: row for row in rows} for rows in figures]
    return [["method", "Fig. 1", "Fig. 5", "Fig. 7", "Fig. 8"]] + [
        [name, *(f"{math.sqrt(float(rows[case]['mseMask'])):.{places}f}" for rows, places in zip(figures, (5, 4, 5, 5)))]
        for case, name in CORRELATED]


def correlated_cost(rows):
    rows = {row["case"]: row for row in rows}

    def per_ray(case):
        return 1 / (float(rows[case]["mseMask"]) * float(rows[case]["rays"]))

    base, table = per_ray("bidirectional N=20 M=800"), [["method", "ms", "second pass", "rays", "per ray"]]
    wanted = [line for line in CORRELATED if not re.search(r"environment|mis|published", line[0])]
    for case, name in wanted:
        row = rows[case]
        share = 100 * float(row["shareOfSecondPass"])
        table.append([name, f"{float(row['milliseconds']):.0f}", f"{share:.0f} %" if share else "", f"{float(row['rays']):.0f}",
                      f"{per_ray(case) / base:.2f}"])
    return table


def correlated_exact(rows):
    """Bias of the worst of four pixels, with its standard error."""
    scenes, forms, cells = [], [], {}
    for row in rows:
        pairs = [(float(row[f"biasPercent{i}"]), float(row[f"standardError{i}"])) for i in range(1, 5)]
        bias, error = max(pairs, key=lambda pair: abs(pair[0]))
        cells[row["form"], row["scene"]] = f"{bias:+.2f} ({error:.2f})"
        scenes += [row["scene"]] if row["scene"] not in scenes else []
        forms += [row["form"]] if row["form"] not in forms else []
    return [["form", *scenes]] + [[form, *(cells[form, scene] for scene in scenes)] for form in forms]


def without_zero(value, digits_of=3):
    """As the paper prints errors: three digits that count, no 0 before the point."""
    places = max(0, digits_of - 1 - math.floor(math.log10(value))) if value >= 1 else digits_of
    return re.sub(r"^0\.", ".", f"{value:.{places}f}")


def sequential_moves(rows):
    error = {(row["kind"], int(row["count"])): float(row["logLnsError"]) for row in rows}
    counts = (1, 2, 4, 8, 16)
    kinds = {"moves": "that many moves, one distribution", "ratio": "that many distributions, ratio",
             "pathTrapezoid": "the same, path sampling, trapezoid", "pathLeft": "the same, left sum", "pathRight": "the same, right sum"}
    return [["RMS error of log Lns, *forest*; number of moves or distributions:", *map(str, counts)]] + [
        [name, *(without_zero(error[kind, count]) for count in counts)] for kind, name in kinds.items()]


def sequential_sky(specular, mixed):
    kinds = {"sequential": "`sequential`, P = 5, trapezoid", "sequential, refreshRatio 1.5": "the same, `refreshRatio` 1.5",
             "bidirectional, M = 384": "`bidirectional`, M = 384", "bidirectional, M = 800": "`bidirectional`, M = 800"}
    table = [["RMS error", "specular, frame 5", "specular, frame 17", "mixed, frame 5", "mixed, frame 17", "ms a frame"]]
    for kind, name in kinds.items():
        of_kind = [[row for row in rows if row["kind"] == kind] for rows in (specular, mixed)]
        errors = {(i, row["frame"]): float(row["rmse"]) for i, rows in enumerate(of_kind) for row in rows}
        # The first frame starts afresh.
        times = [float(row["ms"]) for rows in of_kind for row in rows if row["frame"] != "1"]
        table.append([name, *(without_zero(errors[i, frame]) for i in (0, 1) for frame in ("5", "17")),
                      f"{min(times):.0f} to {max(times):.0f}"])
    return table


def sequential_chart(rows):
    by_key = {(row["scene"], row["method"], row["budget"]): row for row in rows}
    wanted = {("bidirectional", "M400"): "`bidirectional`, M = 400", ("sequential", "P5"): "`sequential`, P = 5, trapezoid",
              ("sequential refreshed", "P3"): "`sequential`, P = 3, `refreshRatio` 1.5", ("mis", "64"): "`mis`, N = 64"}
    table = [["frames 4, 5, 16, 17", "specular: us a pixel", "RMS", "flicker", "mixed: us a pixel", "RMS", "flicker"]]
    for (method, budget), name in wanted.items():
        line = [name]
        for scene in ("sky-specular", "sky-mixed"):
            row = by_key[scene, method, budget]
            line += [f"{float(row['cpuMicrosecondsPerPixel']):.1f}", without_zero(float(row["rmse"])),
                     without_zero(float(row["flicker"]), 2 if float(row["flicker"]) < 1 else 3)]
        table.append(line)
    return table


def sequential_speed_up(*tables):
    """Mean over frames 2 to 9: files in the order of the rows below."""
    names = ["forest, light turns 0.1 degrees", "forest, light turns 1.5 degrees", "forest, camera turns 2 degrees",
             "interior, light turns 0.1 degrees", "interior, light turns 1.5 degrees", "interior, camera turns 2 degrees"]
    kinds = {"P = 1": "P = 1", "P = 1, refreshEvery 4": "P = 1, `refreshEvery` 4", "P = 5": "P = 5",
             "P = 5, refreshRatio 1.5": "P = 5, `refreshRatio` 1.5"}
    table = [["", *kinds.values()]]
    for name, rows in zip(names, tables):
        mean = {row["kind"]: row for row in rows if row["frames"] == "2-9"}
        table.append([name, *(("< " if mean[kind]["bound"] else "") + f"{float(mean[kind]['speedUp']):.2f}" for kind in kinds)])
    return table


def sequential_drift(rows):
    kinds = {"ratio": "ratio", "path": "path, trapezoid", "path refreshEvery 8": "path, `refreshEvery` 8",
             "path refreshRatio 1.5": "path, `refreshRatio` 1.5"}
    last = [row for row in rows if row["frame"] == "261"]
    cells = {(row["kind"], float(row["degPerFrame"])): f"{float(row['median']):.3f} [{float(row['p05']):.3f}, {float(row['p95']):.3f}]"
             for row in last}
    return [["frame 261, median [5 %, 95 %]", "static", "0.1 degrees a frame", "1.5 degrees a frame"]] + [
        [name, *(cells[kind, turn] for turn in (0, 0.1, 1.5))] for kind, name in kinds.items()]


def pool_numbers(rows):
    scenes = {"bunny-chalk-courtyard": "courtyard", "bunny-phong-forest": "forest", "elephant-chalk-interior": "interior"}
    numbers, cells = [], {}
    for row in rows:
        key = (row["number"], row["factor"])
        numbers += [key] if key not in numbers else []
        cells[key, row["scene"]] = row
    table = [["number", "times", *(f"{'error: ' if i == 0 else ''}{name}" for i, name in enumerate(scenes.values())),
              *(f"{'efficiency: ' if i == 0 else ''}{name}" for i, name in enumerate(scenes.values()))]]
    for key in numbers:
        of_scene = [cells[key, scene] for scene in scenes]
        table.append([f"`{key[0]}`", f"{float(key[1]):g}", *(f"{float(row['squaredError']):.2f}" for row in of_scene),
                      *(f"{float(row['efficiency']):.2f} [{float(row['low']):.2f}, {float(row['high']):.2f}]" for row in of_scene)])
    return table


def auto_choice(rows):
    by_scene = {row["scene"]: row for row in rows}
    methods = {"pool": "`pool` M = 256", "pool-64": "`pool` M = 64", "ratio": "`ratio`"}
    table = [["scene", "chosen", "map", "over the best fixed", "best fixed", "over the worst fixed", "by square"]]
    for scene, name in SCENES.items():
        row = by_scene.get(scene)
        if not row:
            table.append([name, "", "", "not resolved", "", "", ""])
            continue
        method, candidates = re.match(r"(\w+) .*M=(\d+)", row["choice"]).groups()
        width = re.search(r"maps (\d+) wide", row["choice"])
        over = f"{float(row['overBest']):.2f} [{float(row['overBestLow']):.2f}, {float(row['overBestHigh']):.2f}]"
        table.append([name, f"`{method}` M = {candidates}", f"{width[1]} wide" if width else "", over,
                      methods.get(row["best"], row["best"]), digits(float(row["overWorst"])), f"{float(row['headroomByBlock']):.2f}"])
    return table


def over_rays(rows):
    """Ratios of both scenes, bold where the goal is missed."""
    names, cells, goals = [], {}, {}
    for row in rows:
        names += [row["method"]] if row["method"] not in names else []
        missed = row["goal"] and float(row["ratio"]) > float(row["goal"])
        cells[row["method"], row["scene"]] = f"**{row['ratio']}**" if missed else row["ratio"]
        goals[row["method"]] = row["goal"]
    return [["method", "demo", "crowd", "goal"]] + [
        [re.sub(r"^(\w+)", r"`\1`", name), cells.get((name, "demo"), ""), cells.get((name, "crowd"), ""), goals[name]] for name in names]


def speed(rays, smaller, larger):
    """One row a method: a pixel over its rays, and CPU seconds of a frame in two sizes, at rest and in motion."""
    ratio = {(row["method"], row["scene"]): row["ratio"] for row in rays}
    seconds = {(size, row["method"].replace("`", "")): row["CPU s"] for size, rows in enumerate((smaller, larger)) for row in rows}
    table = [["method", "pixel over its rays: demo", "crowd", "1920 x 1080, CPU s a frame: at rest", "in motion",
              "3840 x 2160: at rest", "in motion"]]
    for method in ("environment", "mis", "bidirectional, M = 128", "pool, M = 64", "pool, M = 128", "pool, M = 256", "sequential, P = 5"):
        name = method.split(",")[0]
        # The frames were rendered with 128 candidates.
        measured = "M = 64" not in method and "M = 256" not in method
        table.append([re.sub(r"^(\w+)", r"`\1`", method), ratio[method, "demo"], ratio[method, "crowd"],
                      *(seconds.get((size, f"{name}, {how}"), "") if measured else "" for size in (0, 1) for how in ("rest", "motion"))])
    return table


def cycles(rows):
    """How many times cheaper than Cycles, at the error of its 64 samples a pixel."""
    names = {"bunny-still": "diffuse, a still", "bunny-sky": "diffuse, 16 frames", "bunny-sky-moving": "the same, moving camera",
             "armadillo-still": "white metal, a still", "armadillo-sky": "white metal, 16 frames",
             "armadillo-sky-moving": "the same, moving camera"}
    of_scene = {row["scene"]: row for row in rows if row["Cycles: spp"] == "64"}
    return [["scene", "linear radiance", "as shown"]] + [
        [name, *(of_scene[scene][column].replace("*", "") for column in ("times cheaper", "times cheaper 2"))]
        for scene, name in names.items()]


def over_frames_time(rows):
    """CPU microseconds a pixel and frame, from the cheapest to the dearest scene."""
    methods = ("environment", "bidirectional", "sequential", "pool")
    times = {method: [float(row["cpuMicrosecondsPerPixel"]) for row in rows if row["method"] == method] for method in methods}
    return [[f"`{method}`" for method in methods], [f"{min(times[method]):.1f} to {max(times[method]):.1f}" for method in methods]]
