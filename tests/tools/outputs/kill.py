#!/usr/bin/env python3
"""Kills runs of the program with SIGKILL and looks at the files that they leave.

Each command runs once to learn its time and its outputs. Then it is killed at times spread over the whole run, one third of
the runs with no older output, one third over an older file, one third over the output of a whole run. Every second run has no
files without a name (--preload). After a kill, each output must be absent, or the old file, or the new one, byte for byte; the
only other files are temporary ones. After the next normal run the outputs are whole, and no temporary file is left in the
folder of the output or in the scratch folder.

--steps kills each command before the 1st, 2nd, 3rd, ... of its calls that touch files, instead of at random times.

    kill.py build/release/bin/facetree --kills 500 --preload build/release/tests/tools/libtest_tools_faults.so

Prints a table, and exits with 1 if a file was broken or left."""
import argparse
import json
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

OLD = b"an older file\n"
# Triangles of a mesh that does not fit into MEMORY, which is the least that cutting it into parts takes.
LARGE, MEMORY = 250000, "42M"
# Name, words, whether it gets a share of the random kills.
COMMANDS = [
    ("cluster", ["cluster", "ground.ply", "-o", "out/tree.fct"], True),
    ("cluster out of core", ["cluster", "large.ply", "-o", "out/tree.fct", "--max-memory", MEMORY,
                             "--temporary", "scratch"], True),
    ("cluster a folder", ["cluster", "meshes", "-o", "out"], True),
    ("bake a file", ["bake", "lit.json", "-o", "out/light.ply", "--quality", "draft"], True),
    ("bake a folder", ["bake", "lit.json", "-o", "out", "--quality", "draft"], True),
    ("simplify", ["simplify", "ground.ply", "--ratio", ".3", "-o", "out/less.glb"], True),
    ("boxes", ["boxes", "ground.fct", "-k", "2000", "-o", "out/boxes.json"], True),
    ("meshlets", ["meshlets", "ground.fct", "-o", "out/meshlets.bin"], True),
    ("partition", ["partition", "ground.fct", "-k", "500", "-o", "out/parts.ply"], True),
    ("convert", ["convert", "ground.ply", "-o", "out/ground.glb"], True),
    ("make", ["make", "terrain", "--triangles", "SIZE", "-o", "out/ground.obj"], False),
]


class Faults:
    def __init__(self):
        self.count = 0

    def note(self, name, text):
        self.count += 1
        print("FAULT: %s: %s" % (name, text), flush=True)


def make_inputs(program, size):
    """The inputs, in the current folder. size: triangles."""
    def run(*words):
        subprocess.run([program, *words, "--quiet"], check=True)

    run("make", "terrain", "-o", "ground.ply", "--triangles", str(size))
    run("make", "terrain", "-o", "large.ply", "--triangles", str(LARGE))
    run("make", "sphere", "-o", "ball.ply", "--triangles", str(size // 20), "--inside")
    run("cluster", "ground.ply", "-o", "ground.fct")
    os.mkdir("meshes")
    for i in range(4):
        run("make", "sphere", "-o", "meshes/%d.ply" % i, "--triangles", str(size // 8), "--seed", str(i))
    instances = [{"name": name, "model": "ball", "material": "lamp", "translate": [3 * i, 0, 0]}
                 for i, name in enumerate(["one", "two", "three"])]
    pathlib.Path("lit.json").write_text(json.dumps(
        {"models": {"ball": "ball.ply"}, "instances": instances,
         "materials": {"lamp": {"reflectance": [.5, .5, .5], "emission": [1, 1, 1]}}}))
    os.mkdir("scratch")


def read_folder(folder):
    return {p.name: p.read_bytes() for p in pathlib.Path(folder).iterdir()}


def wait_for_group(group):
    """Waits until no process of the group is left: those of `cluster FOLDER` end a moment after their parent."""
    for _ in range(1000):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(.01)
    return False


class Command:
    def __init__(self, options, faults, name, words):
        self.options, self.faults, self.name = options, faults, name
        self.words = [str(options.size) if w == "SIZE" else w for w in words]
        self.counts = {"absent": 0, "old": 0, "new": 0, "ended": 0, "temporary": 0}
        self.kills = 0
        self.whole = {}
        self.prepare("absent")
        times = []
        for _ in range(3):
            begin = time.monotonic()
            self.run_whole()
            times.append(time.monotonic() - begin)
        self.seconds = sorted(times)[1]
        self.whole = read_folder("out")

    def start(self, plain, **environment):
        variables = dict(os.environ, **environment)
        if self.options.preload and (environment or not plain):
            variables["LD_PRELOAD"] = self.options.preload
        return subprocess.Popen([self.options.program, *self.words, "--quiet", "--threads", "2"], env=variables,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)

    def run_whole(self):
        code = self.start(True).wait()
        if code:
            sys.exit("%s: exit code %d" % (" ".join(self.words), code))

    def prepare(self, state):
        """The outputs before the run: absent, old or whole."""
        shutil.rmtree("out", ignore_errors=True)
        os.mkdir("out")
        for name in self.whole if state != "absent" else []:
            pathlib.Path("out", name).write_bytes(OLD if state == "old" else self.whole[name])

    def check_after_kill(self, state):
        found = read_folder("out")
        for name, whole in self.whole.items():
            now = found.pop(name, None)
            kind = ("absent" if now is None else "new" if now == whole else "old" if now == OLD else "broken")
            allowed = {"absent": ("absent", "new"), "old": ("old", "new"), "whole": ("new",)}[state]
            if kind not in allowed:
                self.faults.note(self.name, "%s is %s after a kill, and was %s before" % (name, kind, state))
            else:
                self.counts[kind] += 1
        left = list(found) + os.listdir("scratch")
        self.counts["temporary"] += len(left)
        self.left = len(left)
        for name in left:
            if not (name.startswith(".facetree-") and name.endswith(".tmp")):
                self.faults.note(self.name, "the file %s after a kill" % name)

    def check_next_run(self):
        self.run_whole()
        found = read_folder("out")
        if found != self.whole:
            self.faults.note(self.name, "the next run left %s, expected %s" % (sorted(found), sorted(self.whole)))
        if os.listdir("scratch"):
            self.faults.note(self.name, "the next run left %s in the scratch folder" % os.listdir("scratch"))
            shutil.rmtree("scratch")
            os.mkdir("scratch")

    def kill_once(self, process, state, wait):
        """Kills after `wait` seconds; None: the process kills itself. Returns whether it was killed."""
        if wait is not None:
            time.sleep(wait)
            os.kill(process.pid, signal.SIGKILL)
        code = process.wait()
        if not wait_for_group(process.pid):
            self.faults.note(self.name, "processes outlive the kill of their parent")
        killed = code == -signal.SIGKILL
        self.kills += 1
        self.counts["ended"] += not killed
        if not killed and wait is not None and code:
            self.faults.note(self.name, "exit code %d" % code)
        self.check_after_kill(state)
        return killed

    def kill_at_random(self, count, chance):
        for i in range(count):
            state = ("absent", "old", "whole")[i % 3]
            self.prepare(state)
            wait = (i + chance.random()) / count * self.seconds * 1.05
            self.kill_once(self.start(i % 2 == 0), state, wait)
            if i % self.options.next == 0 or i == count - 1:
                self.check_next_run()

    def kill_in_steps(self):
        for i, nameless in enumerate([{}, {"NAMELESS": "1"}]):
            step, killed = 1, True
            while killed:
                state = ("absent", "old", "whole")[(step + i) % 3]
                self.prepare(state)
                killed = self.kill_once(self.start(False, KILL_AT=str(step), **nameless), state, None)
                if killed and (self.left or step % 7 == 0):
                    self.check_next_run()
                step += 1 if step < 40 else max(1, step // 10)

    def print_row(self):
        c = self.counts
        print("%-20s %7.2f %6d %7d %6d %6d %6d %9d" % (self.name, self.seconds, self.kills, c["ended"], c["absent"],
                                                       c["old"], c["new"], c["temporary"]), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("--preload", type=os.path.abspath, help="the library of faults.c")
    parser.add_argument("--kills", type=int, default=0, help="kills at random times, over all commands")
    parser.add_argument("--steps", action="store_true", help="kills before each call that touches files")
    parser.add_argument("--next", type=int, default=1, help="a normal run after every so many random kills (default 1)")
    parser.add_argument("--size", type=int, default=100000, help="triangles of the inputs (default 100000)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", help="names of commands")
    options = parser.parse_args()
    if options.steps and not options.preload:
        parser.error("--steps needs --preload")
    faults, chance = Faults(), random.Random(options.seed)
    chosen = [c for c in COMMANDS if (not options.only or c[0] in options.only) and (options.steps or c[2])]
    with tempfile.TemporaryDirectory(prefix="facetree-kill-") as folder:
        os.chdir(folder)
        make_inputs(options.program, options.size)
        print("%-20s %7s %6s %7s %6s %6s %6s %9s" % ("command", "seconds", "kills", "ended", "absent", "old", "new",
                                                     "temporary"), flush=True)
        total = 0
        for i, (name, words, _) in enumerate(chosen):
            command = Command(options, faults, name, words)
            if options.steps:
                command.kill_in_steps()
            command.kill_at_random(options.kills * (i + 1) // len(chosen) - options.kills * i // len(chosen), chance)
            command.print_row()
            total += command.kills
        os.chdir("/")
    print("%d kills, %d faults" % (total, faults.count))
    return faults.count > 0


if __name__ == "__main__":
    sys.exit(main())
