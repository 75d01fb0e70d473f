#!/usr/bin/env python3
"""Values of options from files, and what the programs say of themselves: manual, completion, an installed tree."""

import json
import os
import re
import shutil
import subprocess

from farm import BAD_INPUT, DEADLINE_S, OK, USAGE, check, check_equal, check_says, run_tests
from test_cli_errors import CUBE_JOB, Desk, command_help, write_job

PROGRAMS = ["baton", "baton-coordinator", "baton-worker"]


def what_is_typed_beats_environment_and_files(programs, folder):
    desk = Desk(programs, folder)
    conf = folder / "baton.conf"
    conf.write_text("# the farm\n\nBATON_COORDINATOR = 'file://here'\nBATON_KEY=file.key\n")
    inside = {"BATON_CONFIG_DIR": str(folder)}
    check_says(desk.baton("job", "list", **inside).stderr, "file.key")
    check_says(desk.baton("job", "list", **inside, BATON_KEY="").stderr, "file://here")
    check_says(desk.baton("job", "list", **inside, BATON_KEY="environment.key").stderr, "environment.key")
    check_says(desk.baton("job", "list", "--key", "typed.key", **inside, BATON_KEY="environment.key").stderr, "typed.key")
    # What is typed may rule out what is not.
    check_says(desk.baton("job", "list", "--insecure", **inside, BATON_KEY="environment.key").stderr, "file://here")
    # What stands in for other commands' options is none of this one's.
    check_says(desk.baton("job", "list", **inside, BATON_STORE_LIMIT="abc").stderr, "file.key")
    check_equal(desk.baton("view", "x", BATON_STORE_LIMIT="abc").returncode, desk.baton("view", "x").returncode, "of another command")
    check_says(desk.baton("render", "x", BATON_STORE_LIMIT="abc").stderr, "--store-limit")
    shown = json.loads(desk.baton("config", "--json", **inside, BATON_KEY="environment.key").stdout)
    found = {setting["name"]: (setting["value"], setting["from"]) for setting in shown["settings"]}
    check_equal(found["BATON_COORDINATOR"], ("file://here", f"{conf}:3"), "of the file")
    check_equal(found["BATON_KEY"], ("environment.key", "environment"), "of the environment")
    check_equal(found["BATON_STORE_LIMIT"], ("", ""), "of nobody")
    check_says(desk.baton("config", **inside).stdout, f"{conf}:4", f"{conf}: read")
    check(desk.baton("config").stdout.count("not set") == len(found), "a file counts that is not asked for")
    # A user's file goes before that of the machine; here there is only the first.
    shutil.copytree(folder, folder / "home/.config/baton", ignore=shutil.ignore_patterns("home"))
    home = {k: v for k, v in os.environ.items() if not k.startswith(("BATON_", "XDG_"))} | {"HOME": str(folder / "home")}
    own = subprocess.run([desk.program, "config"], env=home, capture_output=True, text=True, timeout=DEADLINE_S, check=True)
    check_says(own.stdout, ".config/baton/baton.conf:4", "/etc/baton/baton.conf: ")


def faults_of_a_file_are_named(programs, folder):
    desk = Desk(programs, folder)
    for text, says in [("BATON_KEEY=a\n", '1: BATON_KEEY: no such setting; did you mean "BATON_KEY"?'),
                       ("\nBATON_KEY\n", "2: expected NAME=VALUE, got 'BATON_KEY'"),
                       ("BATON_KEY=a\nBATON_KEY=b\n", "2: BATON_KEY: set already in line 1"),
                       ("BATON_KEY=\x1b[2J\n", "expected NAME=VALUE, got 'BATON_KEY=\\x1b[2J'"),
                       ("BATON_THREADS=2\n", "1: BATON_THREADS: no such setting")]:
        (folder / "baton.conf").write_text(text)
        for words in (["job", "list"], ["config"], ["check", "job.json"]):
            done = desk.baton(*words, BATON_CONFIG_DIR=str(folder))
            check_equal(done.returncode, BAD_INPUT, f"exit code for {text!r}")
            check_says(done.stderr, f"{folder / 'baton.conf'}:", says)
    (folder / "baton.conf").write_text("BATON_KEY=a\n")
    (folder / "baton.conf").chmod(0o666)
    check_says(desk.baton("config", BATON_CONFIG_DIR=str(folder)).stderr, "others may write it")
    # What is wrong with a value is said as of one that is typed.
    (folder / "baton.conf").write_text("BATON_STORE_LIMIT=much\n")
    (folder / "baton.conf").chmod(0o600)
    done = desk.baton("render", "job.json", BATON_CONFIG_DIR=str(folder))
    check_equal(done.returncode, USAGE, "exit code")
    check_says(done.stderr, "--store-limit")


def other_programs_have_files_of_their_own(programs, folder):
    folder.mkdir(parents=True)
    (folder / "baton.conf").write_text("BATON_KEY=person.key\n")
    (folder / "baton-worker.conf").write_text("BATON_KEY=worker.key\nBATON_COORDINATOR=tcp://127.0.0.1:1\n")
    (folder / "baton-coordinator.conf").write_text(f"BATON_KEY=server.key\nBATON_WORK_DIR={folder / 'farm'}\nBATON_ROOT=/\n")
    for program in PROGRAMS[1:]:
        done = subprocess.run([programs.bin.resolve() / program], env=os.environ | {"BATON_CONFIG_DIR": str(folder)},
                              capture_output=True, text=True, timeout=DEADLINE_S, check=False)
        check(done.returncode != OK, f"{program} runs with a key that is not there")
        check_says(done.stderr, {"baton-worker": "worker.key", "baton-coordinator": "server.key"}[program])


def the_manual_has_every_command_and_option(programs, folder):
    desk = Desk(programs, folder)
    page = desk.baton("--manual").stdout.replace("\\-", "-")
    for command, text in command_help(desk):
        name = " ".join(["baton", *command])
        section = page if not command else re.split(r"^\.S[SH] ", page.split(f".SS {name}\n", 1)[1], 1, re.MULTILINE)[0]
        for option in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", text.partition("Options:")[2].partition("Subcommands:")[0], re.MULTILINE):
            check(f"\\fB{option}\\fR" in section, f"{name} {option} is not in the manual")
    for program in PROGRAMS[1:]:
        page = subprocess.run([programs.bin / program, "--manual"], capture_output=True, text=True, timeout=DEADLINE_S, check=True)
        check_says(page.stdout.replace("\\-", "-"), f".TH {program.upper()} 1", "--key", "BATON_KEY", f"/etc/baton/{program}.conf")


def completed(programs, *words, program="baton"):
    """What bash offers for the last word."""
    script = f'source <("$0" --completion bash); COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _{program}; printf "%s\\n" "${{COMPREPLY[@]}}"'
    done = subprocess.run(["bash", "-c", script, programs.bin.resolve() / program, program, *words], capture_output=True,
                          text=True, timeout=DEADLINE_S, check=True)
    check_equal(done.stderr, "", "stderr of bash")
    return done.stdout.split()


def words_are_completed(programs, folder):
    desk = Desk(programs, folder)
    for command, text in command_help(desk):
        names = re.findall(r"^  ([a-z]+)  ", text.partition("Subcommands:")[2].partition("\n\n")[0], re.MULTILINE)
        check_equal(sorted(completed(programs, *command, "")), sorted(names), f"commands of {command}")
        options = re.findall(r"(--[a-z-]+)", " ".join(re.findall(r"^  -.*?(?:  |$)", text.partition("Options:")[2], re.MULTILINE)))
        missing = set(options) - set(completed(programs, *command, "--"))
        check(not missing, f"{command} is not completed by {missing}")
    check_equal(completed(programs, "job", "list", "--sort", "p"), ["priority"], "a choice")
    check_equal(completed(programs, "job", "list", "--coordinator", "x", "--status", "rend"), ["rendering"], "a choice after others")
    check_equal(completed(programs, "render", "job.json", ""), [], "bash completes names of files")
    check_equal(completed(programs, "--mixed", program="baton-coordinator"), ["--mixed-builds"], "an option")
    script = desk.baton("--completion", "zsh").stdout
    check_says(script, "#compdef baton", "'list:The jobs that have not ended")
    check_equal(desk.baton("--completion", "fish").returncode, USAGE, "exit code for another shell")


def an_installed_tree_works(programs, folder):
    """As `./run install` makes it: moved elsewhere, found by links."""
    build, prefix = programs.bin.resolve().parent, folder / "made"
    subprocess.run(["cmake", "--install", str(build), "--prefix", str(prefix)], stdout=subprocess.DEVNULL, timeout=DEADLINE_S,
                   check=True)
    for file in ["share/man/man1/baton.1", "share/bash-completion/completions/baton-worker", "share/zsh/site-functions/_baton"]:
        check((prefix / file).stat().st_size > 500, f"{file} is empty")
    unit = (prefix / "lib/systemd/system/baton-coordinator.service").read_text()
    check_says(unit, f"ExecStart={prefix}/bin/baton-coordinator\n")
    moved = folder / "moved"
    prefix.rename(moved)
    shutil.copy(Desk(programs, folder / "desk").folder / "cube.obj", folder / "cube.obj")
    shutil.copy(folder / "desk/sky.hdr", folder / "sky.hdr")
    job = write_job(folder / "job.json", CUBE_JOB)
    done = subprocess.run([moved / "bin/baton", "render", job], capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    check_equal(done.returncode, OK, f"exit code of the installed program, which says\n{done.stderr}")


if __name__ == "__main__":
    run_tests()
