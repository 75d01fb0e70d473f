"""What a comparison says: tables for the screen and the page, numbers as JSON, a sheet of pictures."""

import json

import numpy as np

import errors
import pictures

GOALS = {"still": 10, "at rest": 25, "in motion": 12}
CROP = 160


def kind_of(placed):
    if len(placed["frames"]) == 1:
        return "still"
    return "in motion" if placed["moves"] else "at rest"


def digits(value, count=2):
    """A number with so many digits that count, without exponents."""
    if value <= 0 or value >= 10**count:
        return f"{value:.0f}"
    return f"{value:.{max(0, count - 1 - int(np.floor(np.log10(value))))}f}"


def start_of(settings):
    """CPU seconds without a sample: the line through the two cheapest settings."""
    a, b = settings[0], settings[1]
    return a.cpu() - (b.cpu() - a.cpu()) / (b.level - a.level) * a.level


class Scene:
    """The settings of one job, measured."""

    def __init__(self, placed, cycles, variants, beyond_noise):
        """cycles: settings from cheap to dear; variants: lists of such by name; beyond_noise: of their finest pictures."""
        self.beyond_noise = beyond_noise
        self.placed, self.kind, self.cycles, self.variants = placed, kind_of(placed), cycles, variants
        errors.draw([*cycles, *(s for curve in variants.values() for s in curve)])
        self.ratios = {measure: [self.best_ratio(other, measure) for other in cycles] for measure in errors.MEASURES}
        self.difference = errors.difference(cycles[-1], finest(variants))

    def baton(self):
        return [setting for curve in self.variants.values() for setting in curve]

    def best_ratio(self, other, measure):
        """The variant that is cheapest at the error of `other`, and its ratio; one that was measured down to it, if any."""
        ratios = {name: errors.ratio_at_error(curve, other, measure) for name, curve in self.variants.items()}
        name = max(ratios, key=lambda variant: (not ratios[variant].extrapolated, ratios[variant].value))
        return name, ratios[name]

    def triangles(self):
        return max(mesh["triangles"] for mesh in self.placed["meshes"])


def finest(variants):
    """The last setting of the first variant, which is the job as it is."""
    return next(iter(variants.values()))[-1]


def ratio_text(ratio, goal):
    word = "at least " if ratio.bound else "about " if ratio.extrapolated else ""
    text = f"{word}{digits(ratio.value)} [{digits(ratio.low)}, {digits(ratio.high)}]"
    return f"**{text}**" if ratio.value < goal else text


def rmse_text(setting, measure="mse"):
    low, high = errors.interval(np.sqrt(setting.draws[measure]))
    return f"{digits(np.sqrt(setting.mse(measure)))} [{digits(low)}, {digits(high)}]"


def main_table(scenes):
    lines = ["| scene | goal | Cycles: spp | CPU s | RMSE | Baton at this error | CPU s | times cheaper | as shown: RMSE | "
             "Baton at this error | times cheaper |", "|---|---|---|---|---|---|---|---|---|---|---|"]
    for scene in scenes:
        goal = GOALS[scene.kind]
        for k, other in enumerate(scene.cycles):
            name, ratio = scene.ratios["mse"][k]
            shown_name, shown_ratio = scene.ratios["shown"][k]
            lines.append(f"| {scene.placed['name']} | {goal} | {other.level} | {digits(other.cpu())} | {rmse_text(other)} | "
                         f"{name} | {digits(ratio.cpu)} | {ratio_text(ratio, goal)} | {rmse_text(other, 'shown')} | "
                         f"{shown_name} | {ratio_text(shown_ratio, goal)} |")
    return lines


def settings_table(scene):
    lines = [f"{scene.placed['name']}: {scene.triangles()} triangles, {scene.placed['width']} x "
             f"{scene.placed['height']} pixels, {len(scene.placed['frames'])} frames, {scene.kind}", "",
             "| | spp or rounds | pairs | CPU s | RMSE | efficiency | as shown: RMSE | darkest quarter | worst block | 99.9 % | "
             "black |",
             "|---|---|---|---|---|---|---|---|---|---|---|"]
    for name, curve in {"Cycles": scene.cycles, **scene.variants}.items():
        for s in curve:
            low, high = errors.interval(1 / (s.draws["mse"] * s.draws["cpu"]))
            lines.append(f"| {name} | {s.level} | {len(s.pairs)} | {digits(s.cpu(), 3)} | {rmse_text(s)} | "
                         f"{digits(s.efficiency(), 3)} [{digits(low, 3)}, {digits(high, 3)}] | {rmse_text(s, 'shown')} | "
                         f"{' | '.join(digits(s.seen(what)) for what in errors.SEEN[:-1])} | {100 * s.seen('black'):.2g} % |")
    return [*lines, ""]


def difference_table(scenes):
    lines = ["| scene | image mean | Cycles over it | z^2 of blocks | rms over blocks | mean square over pixels, of Cycles' "
             "least MSE |", "|---|---|---|---|---|---|"]
    for scene in scenes:
        d, least = scene.difference, scene.cycles[-1].mse()
        square, error = (100 * value / least for value in scene.beyond_noise)
        lines.append(f"| {scene.placed['name']} | {digits(d.mean, 3)} | {100 * d.relative:+.3f} % +- "
                     f"{196 * d.error:.3f} % | {digits(d.z_squared)} | {100 * d.systematic:.2f} % | "
                     f"{square:.1f} % +- {1.96 * error:.1f} % |")
    return lines


def text(scenes, said):
    """The whole comparison as Markdown; said: lines about machine and programs."""
    starts = []
    for scene in scenes:
        job = next(iter(scene.variants.values()))
        if len(scene.cycles) > 1 and len(job) > 1:
            starts.append(f"- {scene.placed['name']}, CPU s without samples: Cycles {digits(start_of(scene.cycles))}, Baton "
                          f"{digits(start_of(job))}")
    parts = [[*said, ""], main_table(scenes), ["", *starts, ""], difference_table(scenes), [""],
             *(settings_table(scene) for scene in scenes)]
    return "\n".join(line for part in parts for line in part)


def numbers(scenes):
    """The same for programs."""
    def of_setting(name, s):
        return {"renderer": name, "level": s.level, "pairs": len(s.pairs), "cpuSeconds": s.cpu(), "mse": s.mse(),
                "mseInterval": errors.interval(s.draws["mse"]), "efficiency": s.efficiency(), "shownMse": s.mse("shown"),
                **{f"shown{what.capitalize()}": s.seen(what) for what in errors.SEEN}}

    return json.dumps([{
        "scene": scene.placed["name"], "kind": scene.kind, "goal": GOALS[scene.kind], "triangles": scene.triangles(),
        "settings": [of_setting(name, s) for name, curve in {"Cycles": scene.cycles, **scene.variants}.items()
                     for s in curve],
        "ratios": [{"of": measure, "spp": other.level, "baton": name, **vars(ratio)}
                   for measure, ratios in scene.ratios.items() for other, (name, ratio) in zip(scene.cycles, ratios)],
        "difference": {**vars(scene.difference), "beyondNoise": scene.beyond_noise}} for scene in scenes], indent=1)


def cropped(picture):
    """A part of the lower left, where figures stand on the ground."""
    top, left = (max(0, round(share * (size - CROP))) for share, size in zip((0.9, 0.3), picture.shape[:2]))
    return pictures.to_srgb(picture[top:top + CROP, left:left + CROP])


def equal_time(scene, level):
    """The Cycles setting of that level, and the dearest of Baton's that takes no longer (or else its cheapest)."""
    other = next((s for s in scene.cycles if s.level == level), scene.cycles[0])
    affordable = [s for s in scene.baton() if s.cpu() <= other.cpu()] or [min(scene.baton(), key=errors.Setting.cpu)]
    return other, min(affordable, key=errors.Setting.mse)
