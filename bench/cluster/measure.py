"""Runs the measuring programs, one process a measurement, builders in turns, and writes time.csv, adversarial.csv
and boxes.csv.

A builder's turns on a mesh end after REPEATS runs or when its time is used up, whichever is first, so that slow ones have
fewer runs; the tables say how many. The first run of a builder also judges its clusters, after the clock has stopped.
"""
import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import time

CLUSTERS = 1000
REPEATS = 5
FIELDS = ["group", "mesh", "faces", "builder", "threads", "run", "status", "seconds", "cpu", "dual", "contract", "boxes",
          "grown_bytes", "peak_bytes", "depth", "mean_depth", "clusters", "deviation", "fit", "irregularity", "box_area",
          "refine_seconds", "refined_deviation", "refined_irregularity"]
FULL = ["dragon-11k", "dragon-48k", "bunny", "nefertiti", "sphere-100k", "terrain-100k", "dragon-203k", "bunny-x4",
        "dragon-871k", "terrain-1m", "sphere-1m", "bunny-x16", "terrain-4m", "bunny-x64", "terrain-10m"]
QUICK = ["dragon-11k", "dragon-48k", "bunny", "terrain-100k", "sphere-100k", "bunny-x4", "terrain-1m"]
BOXES = ["bunny", "nefertiti", "dragon-203k", "dragon-871k"]
ADVERSARIAL = ["grid", "strip", "fan", "loose", "books", "shuffled-faces", "shuffled"]
# Builder, threads, seconds its turns on one mesh may take in all.
BUILDERS = [("rounds", 1, 30), ("rounds", 2, 30), ("greedy", 1, 10), ("greedy", 2, 10), ("meshlets", 1, 30),
            ("vsa-random", 1, 10), ("vsa-hierarchical", 1, 10), ("vsa-incremental", 1, 10)]


class Bench:
    def __init__(self, options):
        self.options = options
        self.slow = {}  # builder: (seconds, faces) of the slowest run of CGAL's so far
        self.rows = []

    def program(self, name):
        return os.path.join(self.options.programs, "bench_cluster_" + name)

    def path(self, mesh):
        return os.path.join(self.options.meshes, mesh + ".ply")

    def faces(self, mesh):
        """From the header of the binary PLY."""
        with open(self.path(mesh), "rb") as file:
            for line in file:
                if line.startswith(b"element face"):
                    return int(line.split()[2])
        raise SystemExit(f"{self.path(mesh)}: expected a count of faces in its header")

    def present(self, meshes):
        found = [mesh for mesh in meshes if os.path.exists(self.path(mesh))]
        for mesh in meshes:
            if mesh not in found:
                print(f"  without {mesh}: there is no such mesh", file=sys.stderr)
        return sorted(found, key=self.faces)

    def command(self, builder, mesh, threads, judge):
        if builder == "meshlets":
            return [self.program("meshlets"), self.path(mesh)]
        if builder.startswith("vsa-"):
            return [self.program("vsa"), self.path(mesh), str(CLUSTERS), builder[4:]]
        return [self.program("tree"), self.path(mesh), builder, str(threads)] + ([str(CLUSTERS)] if judge else [])

    def expected(self, builder, faces):
        """Seconds CGAL would take by what it took on the largest mesh so far."""
        seconds, of = self.slow.get(builder, (0, 1))
        return seconds * faces / of

    def run(self, group, builder, mesh, threads, number, judge):
        row = {"group": group, "mesh": mesh, "faces": self.faces(mesh), "builder": builder, "threads": threads, "run": number}
        peer = builder.startswith("vsa-")
        if peer and self.expected(builder, row["faces"]) > self.options.limit:
            row["status"] = "skipped"
        else:
            limit = self.options.limit + 20 if peer else 600
            begin = time.monotonic()
            try:
                done = subprocess.run(self.command(builder, mesh, threads, judge), stdout=subprocess.PIPE, timeout=limit)
                row["status"] = "ok" if done.returncode == 0 else "failed"
                if done.returncode == 0:
                    row.update(json.loads(done.stdout))
                    if peer and row["seconds"] > self.options.limit:
                        row["status"] = "over the limit"
            except subprocess.TimeoutExpired:
                row["status"] = "over the limit"
            if peer:
                self.slow[builder] = (row.get("seconds", time.monotonic() - begin), row["faces"])
        self.rows.append(row)
        return row

    def turns(self, group, mesh, builders, repeats):
        spent = {}
        for number in range(repeats):
            for builder, threads, budget in builders:
                key = builder, threads
                if spent.get(key, 0) >= budget:
                    continue
                begin = time.monotonic()
                row = self.run(group, builder, mesh, threads, number, number == 0 and threads == 1 and group == "time")
                spent[key] = spent.get(key, 0) + time.monotonic() - begin
                if row["status"] != "ok":
                    spent[key] = float("inf")
        print("  {:<20}{:>11} faces".format(mesh, self.faces(mesh)), flush=True)

    def available(self):
        return [b for b in BUILDERS if os.path.exists(self.program(b[0].split("-")[0])) or b[0] in ("rounds", "greedy")]

    def time(self):
        quick = self.options.quick
        for mesh in self.present(QUICK if quick else FULL):
            builders = [b for b in self.available() if not quick or not b[0].startswith("vsa") or
                        (b[0] == "vsa-random" and self.faces(mesh) < 150000)]
            self.turns("time", mesh, builders, 3 if quick else REPEATS)

    def adversarial(self):
        size = "100k" if self.options.quick else "1m"
        builders = [("rounds", 1, 12), ("rounds", 2, 12)]
        for mesh in self.present(["sphere-480k", "cubes-480k", "sphere-" + size] + [a + "-" + size for a in ADVERSARIAL]):
            self.turns("adversarial", mesh, builders, 3 if self.options.quick else REPEATS)

    def boxes(self):
        meshes = self.present(BOXES[:2] if self.options.quick else BOXES)
        with open(os.path.join(self.options.out, "boxes.csv"), "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["mesh", "faces", "tree", "seconds", "area", "depth", "query", "boxes", "triangles", "microseconds"])
            for mesh in meshes:
                done = subprocess.run([self.program("boxes"), self.path(mesh), "3" if self.options.quick else "5"],
                                      stdout=subprocess.PIPE, timeout=600)
                if done.returncode != 0:
                    print(f"  {mesh}: the comparison of boxes failed", file=sys.stderr)
                    continue
                found = json.loads(done.stdout)
                for tree, figures in found.items():
                    if not isinstance(figures, dict):
                        continue
                    for query, counts in figures.items():
                        if isinstance(counts, dict):
                            writer.writerow([mesh, found["faces"], tree, figures["seconds"], figures["area"], figures["depth"],
                                             query, counts["boxes"], counts["triangles"], counts["microseconds"]])
                print("  {:<20}{:>11} faces".format(mesh, found["faces"]), flush=True)

    def save(self, part):
        with open(os.path.join(self.options.out, part + ".csv"), "w", newline="") as file:
            writer = csv.DictWriter(file, FIELDS, restval="", extrasaction="ignore")
            writer.writeheader()
            writer.writerows(row for row in self.rows if row["group"] == part)


def processor():
    try:
        with open("/proc/cpuinfo") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def main():
    parser = argparse.ArgumentParser()
    for name in ("--programs", "--meshes", "--out"):
        parser.add_argument(name, required=True)
    parser.add_argument("--limit", type=float, default=60)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", action="append", choices=["time", "boxes", "adversarial"])
    bench = Bench(parser.parse_args())
    begin = time.monotonic()
    load = os.getloadavg()[0]
    for part in bench.options.only or ["time", "adversarial", "boxes"]:
        print({"time": "Time, memory and quality", "boxes": "Boxes", "adversarial": "Adversarial meshes"}[part], flush=True)
        getattr(bench, part)()
        if part != "boxes":
            bench.save(part)
    with open(os.path.join(bench.options.out, "machine.json"), "w") as file:
        json.dump({"processor": processor(), "cores": os.cpu_count(), "load_before": load, "quick": bench.options.quick,
                   "limit": bench.options.limit, "seconds": time.monotonic() - begin}, file)


if __name__ == "__main__":
    main()
