"""Runs the simplifiers, one process per measurement, in turns, judges what they give, and writes simplify.csv and figures.csv.

A library's turns on one mesh at one size end after ROUNDS runs or when its seconds are used up, whichever is first. A run that
by the same library's last mesh would take longer than the limit is skipped. The results of the first round are judged.
"""
import argparse
import csv
import filecmp
import json
import os
import platform
import shutil
import subprocess
import sys
import time

ROUNDS = 5
SHARES = [.5, .1, .01, .001]
JUDGED = ["samples", "e_avg", "e_max", "color_rms", "color_relative", "drift"] + [
    prefix + kind for kind in ("duplicates", "flat", "folds", "nonmanifold", "borders") for prefix in ("", "input_", "new_")]
FIELDS = ["mesh", "faces", "share", "target", "library", "threads", "run", "status", "reached", "seconds", "cpu", "grown_bytes"] + JUDGED
FIGURE_FIELDS = ["figure", "mesh", "faces", "library", "target", "run", "status", "reached", "cpu", "samples", "e_avg", "e_max"]
# Name, program, policy, threads, and the seconds that its turns on one mesh at one size may take.
LIBRARIES = [("facetree", "facetree", "default", 1, 25), ("facetree", "facetree", "default", 2, 25), ("shape", "facetree", "shape", 1, 25),
             ("meshopt", "meshopt", "default", 1, 20), ("cgal", "cgal", "plane", 1, 5), ("openmesh", "openmesh", "default", 1, 5)]
QUICK = ["cow", "spot", "dragon-11k", "fandisk", "rocker-arm", "torso-10k", "terrain-10k", "grid-10k", "bunny", "painted-rocker-arm",
         "cornell-baked"]
FULL = QUICK[:-1] + ["dragon-48k", "nefertiti", "torso-100k", "knot-100k", "terrain-100k", "grid-100k", "dragon-203k", "bunny-x4",
                     "dragon-871k", "bunny-x16", "torso-1m", "terrain-1m", "grid-1m", "painted-bunny", "painted-bunny-x4",
                     "painted-bunny-x16", "painted-terrain-100k", "museum-baked"]
LARGE = ["torso-10m", "terrain-10m"]
# Samples per face, and over both meshes. The figures have those of the dissertation.
SAMPLES, BUDGET = 10, 4000000
FIGURE_SAMPLES = 100
CURVES = ["cow", "fandisk", "rocker-arm", "bunny", "dragon-48k", "sphere-20k"]
TRADE = [.5, .25, .1, .05, .02, .01, .005]
NOISE = ["0.125", "0.25", "0.5", "1", "2", "3"]
TABLE_64 = [10, 100, 500, 1000, 3000, 5000]


class Bench:
    def __init__(self, options):
        self.options = options
        self.slow = {} # library, threads: seconds and faces of its last run
        self.rows, self.figures = [], []
        self.work = os.path.join(options.out, "results")
        os.makedirs(self.work, exist_ok=True)

    def program(self, name):
        return os.path.join(self.options.programs, "bench_simplify_" + name)

    def path(self, mesh):
        return os.path.join(self.options.meshes, mesh + ".ply")

    def header(self, mesh):
        """Faces, and whether the mesh has attributes, from the header of the PLY."""
        faces, attributes = 0, False
        with open(self.path(mesh), "rb") as file:
            for line in file:
                if line.startswith(b"element face"):
                    faces = int(line.split()[2])
                attributes |= line.rstrip().endswith((b" radiosity_r", b" nx", b" texcoord"))
                if line.startswith(b"end_header"):
                    return faces, attributes
        raise SystemExit(f"{self.path(mesh)}: expected a PLY with a header")

    def present(self, meshes):
        if self.options.mesh:
            meshes = [mesh for mesh in meshes if mesh in self.options.mesh]
        found = [mesh for mesh in meshes if os.path.exists(self.path(mesh))]
        for mesh in meshes:
            if mesh not in found:
                print(f"  without {mesh}: there is no such mesh", file=sys.stderr)
        return sorted(found, key=lambda mesh: self.header(mesh)[0])

    def available(self, attributes=False):
        return [x for x in LIBRARIES if os.path.exists(self.program(x[1])) and (attributes or x[0] != "shape")]

    def result(self, name, threads):
        return os.path.join(self.work, f"{name}-{threads}.ply")

    def run(self, library, mesh, faces, target, number):
        """One row. The result of the first round is kept in a file."""
        name, program, policy, threads, _ = library
        row = {"mesh": mesh, "faces": faces, "target": target, "library": name, "threads": threads, "run": number}
        seconds, of = self.slow.get((name, threads), (0, 1))
        limit = 600 if program == "facetree" else self.options.limit
        if seconds * faces / of > limit:
            return dict(row, status="skipped")
        command = [self.program(program), policy, self.path(mesh), str(target), str(threads)]
        if number == 0:
            command.append(self.result(name, threads))
        begin = time.monotonic()
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, timeout=2 * limit + 20) # loading included
            row["status"] = "ok" if done.returncode == 0 else "failed"
            found = json.loads(done.stdout) if done.returncode == 0 else {}
            row.update(found)
            if "refused" in found:
                return dict(row, status="refused: " + found["refused"])
        except subprocess.TimeoutExpired:
            row["status"] = "over the limit"
        self.slow[name, threads] = row.get("cpu", time.monotonic() - begin), faces
        return row

    def judge(self, rows, original, samples):
        """Adds the figures of the results of the first round to their rows."""
        good = [r for r in rows if r["status"] == "ok" and r["run"] == 0]
        if not good:
            return
        files = [self.result(r["library"], r["threads"]) for r in good]
        done = subprocess.run([self.program("judge"), str(samples), str(BUDGET), original] + files, stdout=subprocess.PIPE, check=True)
        for row, line in zip(good, done.stdout.splitlines()):
            found = json.loads(line)
            if found["faces"] != row["reached"]:
                raise SystemExit(f"{row['library']} says {row['reached']} faces, and wrote {found['faces']}")
            row.update((key, value) for key, value in found.items() if key != "faces")

    def turns(self, mesh, target, libraries, rounds):
        """All rows of one mesh at one size. Fails if threads change our result."""
        faces, rows, spent = self.header(mesh)[0], [], {}
        for number in range(rounds):
            for library in libraries:
                key = library[0], library[3]
                if spent.get(key, 0) >= library[4]:
                    continue
                begin = time.monotonic()
                row = self.run(library, mesh, faces, target, number)
                rows.append(row)
                spent[key] = spent.get(key, 0) + time.monotonic() - begin if row["status"] == "ok" else float("inf")
        ours = [self.result("facetree", t) for t in (1, 2)]
        ran = {r["threads"] for r in rows if r["library"] == "facetree" and r["status"] == "ok"}
        if ran == {1, 2} and not filecmp.cmp(*ours, shallow=False):
            raise SystemExit(f"{mesh}, {target} faces: one and two threads give different meshes")
        return rows

    def measure(self, meshes):
        for mesh in self.present(meshes):
            faces, attributes = self.header(mesh)
            for share in SHARES:
                target = max(4, round(share * faces))
                rows = self.turns(mesh, target, self.available(attributes), 3 if self.options.quick else ROUNDS)
                self.judge(rows, self.path(mesh), SAMPLES)
                for row in rows:
                    row["share"] = share
                self.rows += rows
            print("  {:<22}{:>11} faces".format(mesh, faces), flush=True)
            self.save("simplify.csv", FIELDS, self.rows) # a run that is cut short keeps what it has

    # --- The figures of the dissertation ---

    def point(self, figure, mesh, target, libraries, rounds=1, original=None):
        rows = self.turns(mesh, target, libraries, rounds)
        self.judge(rows, self.path(original or mesh), FIGURE_SAMPLES)
        self.figures += [dict(row, figure=figure) for row in rows]
        self.save("figures.csv", FIGURE_FIELDS, self.figures)

    def draw_figures(self):
        quick = self.options.quick
        ours = [("facetree", "facetree", "default", 1, 25)]
        contracted = [("norefit", "facetree", "norefit", 1, 25), ("subset", "facetree", "subset", 1, 25)]
        for mesh in self.present(CURVES[:4] if quick else CURVES):
            target = 16
            while target < self.header(mesh)[0]:
                self.point("6.14", mesh, target, ours + contracted[:1])
                target *= 2
        for mesh in self.present(["cow"]):
            for target in TABLE_64:
                self.point("table 6.4", mesh, target, ours + contracted)
        peers = [x for x in self.available() if x[3] == 1]
        for mesh in self.present(["rocker-arm" if quick else "bunny"]):
            for share in TRADE:
                self.point("6.16", mesh, round(share * self.header(mesh)[0]), peers + contracted, 1 if quick else ROUNDS)
        for mesh in self.present(["cube-" + noise for noise in NOISE]):
            for target in (12, 25, 50, 100, 200, 400, 800, 1600, 3200, 6400, 12288):
                self.point("6.18", mesh, target, ours + contracted[:1], original="cube")

    def save(self, name, fields, rows):
        with open(os.path.join(self.options.out, name), "w", newline="", encoding="ascii") as file:
            writer = csv.DictWriter(file, fields, restval="", extrasaction="ignore")
            writer.writeheader()
            writer.writerows(rows)


def processor():
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def main():
    parser = argparse.ArgumentParser()
    for name in ("--programs", "--meshes", "--out"):
        parser.add_argument(name, required=True)
    parser.add_argument("--limit", type=float, default=15)
    parser.add_argument("--load", type=float, default=os.getloadavg()[0], help="of the machine before anything was built")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--large", action="store_true")
    parser.add_argument("--mesh", action="append", help="only this mesh")
    parser.add_argument("--only", action="append", choices=["sizes", "figures"])
    bench = Bench(parser.parse_args())
    options, begin = bench.options, time.monotonic()
    only = options.only or ["sizes", "figures"]
    if "sizes" in only:
        print("Time, memory, errors and defects", flush=True)
        bench.measure((QUICK if options.quick else FULL) + (LARGE if options.large else []))
    if "figures" in only:
        print("Figures of the dissertation", flush=True)
        bench.draw_figures()
    shutil.rmtree(bench.work)
    with open(os.path.join(options.out, "machine.json"), "w", encoding="ascii") as file:
        json.dump({"processor": processor(), "cores": os.cpu_count(), "load_before": options.load, "quick": options.quick,
                   "limit": options.limit, "seconds": time.monotonic() - begin}, file)


if __name__ == "__main__":
    main()
