"""Runs the measuring programs, one process a measurement, builders in turns, and writes time.csv, adversarial.csv,
boxes.csv and large.csv.

A builder's turns on a mesh end after REPEATS runs or when its time is used up, whichever is first, so that slow ones have
fewer runs; the tables say how many. What by its last mesh would take longer than the limit is skipped. The first
run of a builder also judges its clusters, after the clock has stopped.
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
          "refine_seconds", "refined_deviation", "refined_fit", "refined_irregularity"]
FULL = ["dragon-11k", "dragon-48k", "bunny", "nefertiti", "sphere-100k", "terrain-100k", "dragon-203k", "bunny-x4",
        "dragon-871k", "terrain-1m", "sphere-1m", "bunny-x16", "terrain-4m", "bunny-x64", "terrain-10m"]
QUICK = ["dragon-11k", "dragon-48k", "bunny", "terrain-100k", "sphere-100k", "bunny-x4", "terrain-1m"]
BOXES = ["bunny", "terrain-100k", "nefertiti", "dragon-203k", "dragon-871k"]
ADVERSARIAL = ["grid", "strip", "fan", "loose", "books", "shuffled-faces", "shuffled"]
# Meshes whose cuts are compared, and their numbers of clusters.
CUTS = ["cow", "fandisk", "gear-20k", "rocker-arm", "bunny", "nefertiti", "dragon-48k"]
CUT_COUNTS = [30, 100, 1000, 10000]
SEAM_FIGURES = ["mean_fit", "mean_direction", "mean_irregularity", "mean_normal_deviation", "box_area"]
# Builder, threads, and the seconds that all its turns on one mesh may take.
BUILDERS = [("rounds", 1, 25), ("rounds", 2, 25), ("greedy", 1, 6), ("greedy", 2, 6), ("meshlets", 1, 20), ("vsa-random", 1, 5),
            ("vsa-hierarchical", 1, 5), ("vsa-incremental", 1, 5)]
# Meshes without CGAL, because it takes long and only its clusters are of interest.
WITHOUT_VSA = ["terrain-1m", "sphere-1m", "terrain-4m", "terrain-10m"]


class Bench:
    def __init__(self, options):
        self.options = options
        self.slow = {}  # (builder, threads): seconds and faces of its last run
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

    def expected(self, builder, threads, faces):
        """Seconds it would take by what it took on the largest mesh so far."""
        seconds, of = self.slow.get((builder, threads), (0, 1))
        return seconds * faces / of

    def run(self, group, builder, mesh, threads, number, judge):
        row = {"group": group, "mesh": mesh, "faces": self.faces(mesh), "builder": builder, "threads": threads, "run": number}
        limit = 600 if builder == "rounds" else self.options.limit
        if self.expected(builder, threads, row["faces"]) > limit:
            row["status"] = "skipped"
            self.rows.append(row)
            return row
        begin = time.monotonic()
        try:
            # The limit allows for loading and judging.
            done = subprocess.run(self.command(builder, mesh, threads, judge), stdout=subprocess.PIPE, timeout=limit + 20)
            row["status"] = "ok" if done.returncode == 0 else "failed"
            if done.returncode == 0:
                row.update(json.loads(done.stdout))
                if row["seconds"] > limit:
                    row["status"] = "over the limit"
        except subprocess.TimeoutExpired:
            row["status"] = "over the limit"
        self.slow[builder, threads] = row.get("seconds", time.monotonic() - begin), row["faces"]
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
        self.save(group) # a run that is cut short keeps what it has

    def available(self):
        return [b for b in BUILDERS if os.path.exists(self.program(b[0].split("-")[0])) or b[0] in ("rounds", "greedy")]

    def time(self):
        quick = self.options.quick
        for mesh in self.present(QUICK if quick else FULL):
            builders = [b for b in self.available() if not b[0].startswith("vsa") or
                        (b[0] == "vsa-random" and self.faces(mesh) < 150000 if quick else mesh not in WITHOUT_VSA)]
            self.turns("time", mesh, builders, 3 if quick else REPEATS)

    def adversarial(self):
        size = "100k" if self.options.quick else "1m"
        builders = [("rounds", 1, 12), ("rounds", 2, 12)]
        for mesh in self.present(["sphere-480k", "cubes-480k", "sphere-" + size] + [a + "-" + size for a in ADVERSARIAL]):
            self.turns("adversarial", mesh, builders, 3 if self.options.quick else REPEATS)

    def cuts(self):
        """Quality of cuts at several numbers of clusters: ours, refined, and CGAL's. Times are not of interest here."""
        fields = ["mesh", "faces", "builder", "clusters", "status", "deviation", "fit", "irregularity", "refined_deviation", "refined_fit",
                  "refined_irregularity", "mean_depth"]
        builders = ["rounds", "greedy"] + (["vsa-hierarchical", "vsa-random"] if os.path.exists(self.program("vsa")) else [])
        with open(os.path.join(self.options.out, "cuts.csv"), "w", newline="") as file:
            writer = csv.DictWriter(file, fields, restval="", extrasaction="ignore")
            writer.writeheader()
            for mesh in self.present(CUTS):
                for count in [c for c in CUT_COUNTS if c < self.faces(mesh)]:
                    for builder in builders:
                        row = {"mesh": mesh, "faces": self.faces(mesh), "builder": builder}
                        row.update(self.judge_cut(builder, mesh, count), clusters=count)
                        writer.writerow(row)
                file.flush()
                print("  {:<20}{:>11} faces".format(mesh, self.faces(mesh)), flush=True)

    def judge_cut(self, builder, mesh, count):
        vsa = builder.startswith("vsa-")
        command = [self.program("vsa"), self.path(mesh), str(count), builder[4:]] if vsa else \
                  [self.program("tree"), self.path(mesh), builder, "1", str(count)]
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, timeout=self.options.limit)
        except subprocess.TimeoutExpired:
            return {"status": "over the limit"}
        return dict(json.loads(done.stdout), status="ok") if done.returncode == 0 else {"status": "failed"}

    def boxes(self):
        meshes = self.present(BOXES[:3] if self.options.quick else BOXES)
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

    def facetree(self, *arguments):
        """What the program says of itself, with its exit code, seconds, and most memory resident, mapped files included."""
        begin = time.monotonic()
        process = subprocess.Popen([os.path.join(self.options.programs, "facetree"), *arguments, "--json", "--quiet"], stdout=subprocess.PIPE)
        text = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        found = json.loads(text) if process.returncode == 0 else {}
        found.update(code=process.returncode, wall=time.monotonic() - begin, resident_bytes=1024 * usage.ru_maxrss)
        return found

    def seams(self, writer, mesh):
        """The same mesh in memory and, under a limit that forces it, in parts: quality at several numbers of clusters."""
        faces, trees = self.faces(mesh), {}
        for how, limit in (("memory", []), ("parts", ["--max-memory", str(40_000_000 + 100 * faces)])):
            trees[how] = os.path.join(self.options.out, how + ".fct")
            built = self.facetree("cluster", self.path(mesh), "-o", trees[how], *limit)
            writer.writerow([mesh, faces, how, "", built["code"], built["wall"], built["resident_bytes"], built.get("depth", "")])
        for count in (faces // 10, faces // 50, faces // 256, CLUSTERS):
            for how, tree in trees.items():
                if not os.path.exists(tree):
                    continue
                cut = self.facetree("partition", tree, "-k", str(count), "-o", "/dev/null")
                writer.writerow([mesh, faces, how, count, cut["code"], cut["wall"], cut["resident_bytes"], ""] +
                                [cut.get(key, "") for key in SEAM_FIGURES])
        for tree in trees.values():
            if os.path.exists(tree):
                os.remove(tree)

    def large(self):
        name, output = "terrain-100m", os.path.join(self.options.out, "large.fct")
        with open(os.path.join(self.options.out, "large.csv"), "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["mesh", "faces", "how", "clusters", "code", "seconds", "resident_bytes", "depth"] + SEAM_FIGURES)
            for mesh in self.present(["terrain-1m"] if self.options.quick else ["terrain-1m", "bunny-x16"]):
                self.seams(writer, mesh)
            if self.options.quick:
                return
            if not os.path.exists(self.path(name)):
                made = self.facetree("make", "terrain", "--triangles", "100000000", "--max-memory", "4G", "-o", self.path(name))
                writer.writerow([name, "", "make", "", made["code"], made["wall"], made["resident_bytes"], ""])
            if os.path.exists(self.path(name)):
                built = self.facetree("cluster", self.path(name), "-o", output, "--max-memory", "4G")
                writer.writerow([name, self.faces(name), "4G", "", built["code"], built["wall"], built["resident_bytes"], built.get("depth", "")])
            if os.path.exists(output):
                os.remove(output)

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


def save_machine(options, moment, begin):
    with open(os.path.join(options.out, "machine.json"), "w") as file:
        json.dump({"processor": processor(), "cores": os.cpu_count(), "load_before": options.load, "quick": options.quick,
                   "limit": options.limit, "begin": moment, "seconds": time.monotonic() - begin}, file)


def main():
    parser = argparse.ArgumentParser()
    for name in ("--programs", "--meshes", "--out"):
        parser.add_argument(name, required=True)
    parser.add_argument("--limit", type=float, default=45)
    parser.add_argument("--load", type=float, default=os.getloadavg()[0], help="of the machine before anything was built")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", action="append", choices=["time", "cuts", "boxes", "adversarial", "large"])
    bench = Bench(parser.parse_args())
    begin, moment = time.monotonic(), time.time()
    for part in bench.options.only or ["time", "cuts", "adversarial", "boxes"]:
        print({"time": "Time, memory and quality", "cuts": "Cuts", "boxes": "Boxes", "adversarial": "Adversarial meshes",
               "large": "Out of core"}[part], flush=True)
        save_machine(bench.options, moment, begin)
        getattr(bench, part)()
    save_machine(bench.options, moment, begin)


if __name__ == "__main__":
    main()
