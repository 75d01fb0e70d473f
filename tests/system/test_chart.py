#!/usr/bin/env python3
"""`baton chart`: a small study gives its tables, charts and report; killed in the middle it goes on; a bad entry is
named. `"method": "auto"` is settled by a small study."""

import csv
import json
import re
import shutil

from farm import BAD_INPUT, Process, check, check_equal, run_tests, wait_until
from jobs import make_job, write_job


def make_study(folder, **changes):
    """A study of one scene, two methods, two budgets, three seeds."""
    job = make_job(folder, frames="1-3", image={"width": 48, "height": 32, "tileSize": 16})
    write_job(folder / "job.json", job)
    study = {
        "name": "tiny",
        "seeds": 3,
        "referenceSamples": 256,
        "measureFrames": "2-3",
        "scenes": [{"name": "lamp", "job": "job.json", "crop": [8, 8, 24, 16]}],
        "methods": [
            {"name": "mis", "patch": {"sampling": {"method": "mis"}}},
            {"name": "sequential", "patch": {"sampling": {"method": "sequential"}}},
        ],
        "budgets": [4, 16],
        **changes,
    }
    return write_job(folder / "study.json", study)


def chart(programs, study, output, **options):
    return programs.run("baton", "chart", study, "--output", output, **options)


def records(output):
    return sorted((output / ".work" / "records").glob("*.json"))


def a_killed_study_goes_on(programs, folder):
    # The witness: the same study without any harm.
    study = make_study(folder)
    witness = folder / "witness"
    chart(programs, study, witness)
    table = (witness / "measurements.csv").read_text(encoding="utf-8")
    check_equal(len(table.splitlines()), 1 + 2 * 2 * 3 * 2, "lines of measurements.csv")
    check("nan" not in table, "measurements.csv holds a NaN")

    # Kill the whole process group once some runs are kept.
    output = folder / "out"
    process = Process([programs.path("baton"), "chart", str(study), "--output", str(output)], folder / "chart.log")
    wait_until(lambda: len(records(output)) >= 2, "the first runs are kept")
    check(process.alive(), f"the study ended too early:\n{process.log()}")
    process.kill()
    kept = {path: path.stat().st_mtime_ns for path in records(output)}
    check(len(kept) < 12, "every run was done before the kill")

    # Once more: what was kept stays, the rest is made equal.
    chart(programs, study, output)
    check_equal((output / "measurements.csv").read_text(encoding="utf-8"), table, "measurements after the kill")
    for path, time in kept.items():
        check_equal(path.stat().st_mtime_ns, time, f"time of {path.name}")

    # And again, with nothing to do: the same report without a farm.
    log = (output / ".work/farm/coordinator.log").read_text(encoding="utf-8")
    chart(programs, study, output)
    check_equal((output / ".work/farm/coordinator.log").read_text(encoding="utf-8"), log, "the coordinator's log")
    check_equal((output / "measurements.csv").read_text(encoding="utf-8"), table, "measurements of the third run")


def the_report_needs_no_other_file(programs, folder):
    study = make_study(folder, seeds=1)
    done = chart(programs, study, folder / "out")
    check(re.search(r"^lamp: +`\w+`.*, [\d.]+ \[.*times the next \(`\w+`.*\), one seed: no interval", done.stdout),
          f"no verdict:\n{done.stdout}")
    report = (folder / "out/report.html").read_text(encoding="utf-8")
    processor = next(line for line in open("/proc/cpuinfo", encoding="utf-8") if line.startswith("model name"))
    for expected in ["<svg", "data:image/png;base64,", "Fewer than 20 seeds", "sequential", "times the next",
                     processor.split(": ", 1)[1].strip()]:
        check(expected in report, f"report.html: expected {expected}")
    shown = re.sub("<details>.*?</details>", "", report, flags=re.DOTALL)
    check_equal(shown.count("<svg"), 6, "charts that are not folded")
    check(report.count("<svg") > 15, "the others are gone")
    for forbidden in ["src=\"http", "href=", "<script"]:
        check(forbidden not in report, f"report.html holds {forbidden}")
    names = {path.name for path in (folder / "out").iterdir()}
    for name in ["costs.csv", "references.csv", "efficiency.csv", "lamp-rmse-cpu.svg", "lamp-flip-rays-frame3.svg",
                 "lamp-frames-lns.svg", "lamp-crops.png"]:
        check(name in names, f"expected {name} among {sorted(names)}")


def the_second_pass_is_paid_for(programs, folder):
    """Its rays and its time are part of what a method costs, from the worker's task to the tables."""
    plain = {"sampling": {"method": "bidirectional"}}
    methods = [{"name": "plain", "patch": plain},
               {"name": "corrected", "patch": {**plain, "visibility": {"correlated": True}}}]
    study = make_study(folder, methods=methods, budgets=[16], seeds=1)
    chart(programs, study, folder / "out")
    with (folder / "out/costs.csv").open(encoding="utf-8") as file:
        first, both = csv.DictReader(file)
    check_equal((first["method"], both["method"]), ("plain", "corrected"), "methods")
    check_equal(float(first["secondsSecondPass"]), 0.0, "seconds of a second pass that is not there")
    check(0 < float(both["secondsSecondPass"]) < float(both["cpuSeconds"]), f"seconds of the second pass in {both}")
    check(float(first["raysPerPixel"]) <= 16, f"rays in {first}")
    check(float(both["raysPerPixel"]) > 18, f"rays of both passes in {both}")


def a_reference_that_is_not_what_it_says_stops_a_study(programs, folder):
    """Frames of one half of the reference are exchanged for others: nothing is judged by it."""
    study = make_study(folder, seeds=1)
    chart(programs, study, folder / "out")
    frames = folder / "out/.work/frames"
    halves = [place for place in frames.iterdir() if programs.values(place / "frame.0002.exr", "lns")
              and b"\x09\0\0\0reference" in (place / "frame.0002.exr").read_bytes()[:4000]]
    check_equal(len(halves), 2, "halves of the reference")
    other = next(place for place in frames.iterdir() if place not in halves)
    job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
    job.update(frames="2-3", output={"directory": str(folder / "dark"), "aovs": ["lns", "variance"],
                                     "background": "transparent", "pixelType": "float"},
               environment={**job["environment"], "scale": 0.5}, sampling={"method": "reference", "referenceSamples": 64})
    programs.run("baton", "render", write_job(folder / "dark.json", job))
    shutil.copy(folder / "dark/frame.0002.exr", halves[0] / "frame.0002.exr")
    (folder / "study.json").write_text((folder / "study.json").read_text().replace('"seeds": 1', '"seeds": 2'))
    done = chart(programs, study, folder / "out", expect=None)
    check(done.returncode != 0, "the study went on")
    for expected in ["scene 'lamp', frame 2", "halves of the reference differ", str(halves[0])]:
        check(expected in done.stderr, f"expected {expected!r} in {done.stderr!r}")
    check(other.exists(), "frames of a run are gone")


def a_bad_entry_is_named(programs, folder):
    methods = [{"name": "mis", "patch": {"sampling": {"method": "mis"}}},
               {"name": "bad", "patch": {"sampling": {"metod": "mis"}}}]
    study = make_study(folder, methods=methods)
    done = chart(programs, study, folder / "out", expect=BAD_INPUT)
    expected = f"{study}: $.methods[1].patch.sampling.metod: unknown key; did you mean \"method\"?"
    check(expected in done.stderr, f"expected {expected!r} in {done.stderr!r}")
    check(not (folder / "out").exists(), "a refused study leaves nothing behind")

    # An asset that is gone is found before anything is rendered.
    study = make_study(folder)
    job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
    job["environment"]["keys"][0]["map"] = str(folder / "none.hdr")
    write_job(folder / "job.json", job)
    done = chart(programs, study, folder / "out", expect=None)
    check("none.hdr" in done.stderr and done.returncode != 0, f"expected none.hdr in {done.stderr!r}")


def auto_is_settled_once_and_repeatably(programs, folder):
    def render(place):
        place.mkdir(parents=True)
        job = make_job(folder, frames="1-2", image={"width": 48, "height": 32, "tileSize": 16},
                       sampling={"method": "auto", "numParticles": 8, "targetError": 0.2})
        job["output"]["directory"] = str(place / "frames")
        return programs.render_in(place, job, extra=["--json"])

    def told(done):
        return [line for line in done.stderr.splitlines() if line.startswith(("pilot", "chosen", "because"))]

    first, second = render(folder / "a"), render(folder / "b")
    check_equal(json.loads(first.stdout)["status"], "done", "status")
    check(any(line.startswith("because    the cheapest that reaches") for line in told(first)), first.stderr)
    check_equal(told(second), told(first), "what another pilot saw")
    check_equal(programs.pixels(folder / "b/frames"), programs.pixels(folder / "a/frames"), "pixels")

    # The same command again is the same job, with nothing left to render.
    again = programs.render(folder / "a/job.json", folder / "a/work", extra=["--json"])
    check_equal(json.loads(again.stdout)["id"], json.loads(first.stdout)["id"], "job of the second run")
    check(" kept" in again.stderr and "rendered" not in again.stderr, again.stderr)


if __name__ == "__main__":
    run_tests()
