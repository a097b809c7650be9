"""Prints the tables of a run from its CSV files, draws time-per-face.svg, and holds the figures against the goals."""
import csv
import json
import math
import os
import statistics
import subprocess
import sys

# Faces, and time of MixKit (Garland's code) over that of meshoptimizer's meshlets. Debian has no package of MixKit, so the
# ratio was measured on another machine: .70 s / .049 s at 70 thousand faces, 17.5 s / .79 s at 1.07 million. Between the two it
# grows with the logarithm of the faces; outside it is constant.
MIXKIT = [(70e3, .70 / .049), (1.07e6, 17.5 / .79)]
# Box areas of MixKit over the squared diagonal.
MIXKIT_BOXES = {"bunny": 83.1}


def mixkit_ratio(faces):
    (low, a), (high, b) = MIXKIT
    share = min(max(math.log(faces / low) / math.log(high / low), 0), 1)
    return a + share * (b - a)


class Group:
    """All runs of one mesh by one builder."""

    def __init__(self, rows):
        self.rows = rows
        self.good = [r for r in rows if r["status"] == "ok"]
        self.status = rows[0]["status"] if not self.good else "ok"

    def median(self, key):
        values = [float(r[key]) for r in self.good if r.get(key)]
        return statistics.median(values) if values else None


class Runs:
    def __init__(self, path):
        self.groups, self.faces = {}, {}
        rows = {}
        if os.path.exists(path):
            with open(path, newline="") as file:
                for row in csv.DictReader(file):
                    rows.setdefault((row["mesh"], row["builder"], int(row["threads"])), []).append(row)
                    self.faces[row["mesh"]] = int(row["faces"])
        self.groups = {key: Group(list_) for key, list_ in rows.items()}
        self.meshes = sorted(self.faces, key=lambda mesh: (self.faces[mesh], mesh))

    def get(self, mesh, builder, key="seconds", threads=1):
        group = self.groups.get((mesh, builder, threads))
        return group.median(key) if group else None

    def count(self, mesh, builder, threads=1):
        group = self.groups.get((mesh, builder, threads))
        return len(group.good) if group else 0

    def status(self, mesh, builder):
        group = self.groups.get((mesh, builder, 1))
        return group.status if group else "-"


def over(a, b):
    return a / b if a is not None and b else None


def show(value, form="{:.3g}"):
    if value is None:
        return "-"
    return value if isinstance(value, str) else form.format(value)


def table(title, note, head, rows):
    print("\n" + title)
    if note:
        print(note)
    cells = [head] + [[c if isinstance(c, str) else show(c) for c in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    for n, row in enumerate(cells):
        print("  " + "  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths))).rstrip())
        if n == 0:
            print("  " + "-" * (sum(widths) + 2 * len(widths) - 2))


def ms(seconds):
    return show(None if seconds is None else 1000 * seconds, "{:.4g}")


def table_time(runs):
    rows = []
    for mesh in runs.meshes:
        faces, peer = runs.faces[mesh], runs.get(mesh, "meshlets")
        one, two = runs.get(mesh, "rounds"), runs.get(mesh, "rounds", threads=2)
        mixkit = peer * mixkit_ratio(faces) if peer else None
        rows.append([mesh, str(faces), ms(one), ms(two), ms(runs.get(mesh, "greedy")), ms(runs.get(mesh, "greedy", threads=2)), ms(peer),
                     show(over(one, peer), "{:.2f}"), show(over(two, peer), "{:.2f}"), show(over(mixkit, one), "{:.0f}"),
                     show(over(mixkit, two), "{:.0f}"), show(over(faces / 1e6, one), "{:.2f}"), show(over(faces / 1e6, two), "{:.2f}"),
                     "/".join(str(n) for n in (runs.count(mesh, "rounds"), runs.count(mesh, "rounds", 2), runs.count(mesh, "greedy"),
                                               runs.count(mesh, "meshlets")))])
    table("Time of the whole build, boxes included, and its ratio to peers of the same run",
          "Milliseconds, medians. T1, T2: one, two threads. meshlets: meshoptimizer's buildMeshlets, 64 vertices, 124 triangles, flat, no "
          "boxes.\nMixKit: how many times faster, by its ratio to meshlets. Mf/s: million faces a second. runs: of rounds T1, T2, greedy, meshlets.",
          ["mesh", "faces", "rounds T1", "T2", "greedy T1", "T2", "meshlets", "T1/mesh.", "T2/mesh.", "x MixKit T1", "T2", "Mf/s T1", "T2",
           "runs"], rows)


def table_phases(runs):
    rows = []
    for mesh in runs.meshes:
        row = [mesh]
        for builder, threads in (("rounds", 1), ("rounds", 2), ("greedy", 1)):
            for phase in ("dual", "contract", "boxes"):
                row.append(show(over(1e9 * (runs.get(mesh, builder, phase, threads) or 0), runs.faces[mesh]), "{:.0f}"))
            row.append(show(over(1e9 * (runs.get(mesh, builder, "seconds", threads) or 0), runs.faces[mesh]), "{:.0f}"))
        rows.append(row)
    table("Phases, nanoseconds a face", "", ["mesh", "T1 dual", "contract", "boxes", "all", "T2 dual", "contract", "boxes", "all", "greedy dual",
                                             "contract", "boxes", "all"], rows)


def table_memory(runs):
    rows = []
    for mesh in runs.meshes:
        faces, levels = runs.faces[mesh], math.log2(runs.faces[mesh])
        grown = [runs.get(mesh, b, "grown_bytes", t) for b, t in (("rounds", 1), ("rounds", 2), ("greedy", 1), ("meshlets", 1))]
        depth = runs.get(mesh, "rounds", "depth"), runs.get(mesh, "rounds", "mean_depth")
        rows.append([mesh] + [show(over(g, faces), "{:.0f}") for g in grown] +
                    [show(over(runs.get(mesh, "rounds", "peak_bytes", 2), 1e6), "{:.0f}"), show(depth[0], "{:.0f}"), show(over(depth[0], levels), "{:.2f}"),
                     show(depth[1], "{:.1f}"), show(over(depth[1], levels), "{:.2f}"),
                     show(runs.get(mesh, "greedy", "depth"), "{:.0f}"), show(over(runs.get(mesh, "greedy", "mean_depth"), levels), "{:.2f}")])
    table("Memory and depth", "Bytes a face at the peak, above the loaded mesh (which takes about 18); peak MB: the whole process with its mesh.",
          ["mesh", "rounds T1", "T2", "greedy", "meshlets", "peak MB", "depth", "/log2 F", "mean", "/log2 F", "greedy depth", "mean/log2 F"], rows)


VSA = ["vsa-random", "vsa-hierarchical", "vsa-incremental"]


def best_vsa(runs, mesh):
    found = [runs.get(mesh, v, "deviation") for v in VSA]
    return min((f for f in found if f is not None), default=None)


def table_quality(runs):
    rows = []
    for mesh in runs.meshes:
        best = best_vsa(runs, mesh)
        ours = runs.get(mesh, "rounds", "deviation")
        vsa = [show(runs.get(mesh, v, "deviation"), "{:.4f}") if runs.status(mesh, v) == "ok" else runs.status(mesh, v) for v in VSA]
        times = [show(over(runs.get(mesh, v), runs.get(mesh, "rounds")), "{:.0f}") for v in VSA]
        rows.append([mesh, show(ours, "{:.4f}"), show(runs.get(mesh, "greedy", "deviation"), "{:.4f}"),
                     show(runs.get(mesh, "rounds", "refined_deviation"), "{:.4f}"), ms(runs.get(mesh, "rounds", "refine_seconds"))] + vsa +
                    [show(over(ours, best), "{:.2f}"), show(over(runs.get(mesh, "rounds", "refined_deviation"), best), "{:.2f}")] + times)
    table("L2,1 at 1000 clusters: mean squared deviation of unit normals from the cluster's mean normal",
          "refined: faces on borders have changed sides, in so many milliseconds. VSA: CGAL's variational shape approximation by its seeding, 20\n"
          "iterations; 'over the limit' and 'skipped' are runs that took, or by a smaller mesh would take, longer than the limit. x time: CGAL's\n"
          "over that of our whole tree (rounds, one thread). Faces on the same three corners count for nobody.",
          ["mesh", "rounds", "greedy", "refined", "ms", "VSA random", "hierarchical", "incremental", "ours/best", "refined/best", "x time", "x", "x"],
          rows)
    rows = []
    for mesh in runs.meshes:
        rows.append([mesh] + [show(runs.get(mesh, b, "fit"), "{:.2e}") for b in ("rounds", "greedy", VSA[0], VSA[1])] +
                    [show(runs.get(mesh, b, key), "{:.2f}") for b, key in (("rounds", "irregularity"), ("greedy", "irregularity"),
                                                                           ("rounds", "refined_irregularity"), (VSA[0], "irregularity"),
                                                                           (VSA[1], "irregularity"))] +
                    [show(runs.get(mesh, b, "box_area"), "{:.1f}") for b in ("rounds", "greedy")] + [show(MIXKIT_BOXES.get(mesh), "{:.1f}")])
    table("Fit and shape at 1000 clusters, boxes of the whole tree",
          "fit: squared distance to the cluster's plane over the squared diagonal; irregularity: perimeter^2 / (4 pi area); boxes: all inner boxes'\n"
          "surfaces over the squared diagonal.",
          ["mesh", "fit rounds", "greedy", "VSA random", "hierarch.", "irr. rounds", "greedy", "refined", "VSA random", "hierarch.", "boxes rounds",
           "greedy", "MixKit"], rows)


# L2,1 of MixKit by mesh and number of clusters.
MIXKIT_CUTS = {("rocker-arm", 100): .0886, ("bunny", 1000): .0367}


def best_cut(rows, mesh, count):
    """CGAL's row with the least deviation."""
    found = [r for r in rows if r["builder"].startswith("vsa") and r["status"] == "ok" and (r["mesh"], int(r["clusters"])) == (mesh, count)]
    return min(found, key=lambda r: float(r["deviation"]), default=None)


def table_cuts(rows):
    cells = []
    for r in rows:
        if r["builder"] != "rounds" or r["status"] != "ok":
            continue
        mesh, count = r["mesh"], int(r["clusters"])
        greedy = [g for g in rows if g["builder"] == "greedy" and g["status"] == "ok" and (g["mesh"], int(g["clusters"])) == (mesh, count)]
        vsa, refined = best_cut(rows, mesh, count), float(r["refined_deviation"])
        peer = [float(vsa[k]) if vsa else None for k in ("deviation", "fit", "irregularity")]
        cells.append([mesh, str(count), show(float(r["deviation"])), show(float(greedy[0]["deviation"]) if greedy else None), show(refined), show(peer[0]),
                      show(MIXKIT_CUTS.get((mesh, count))), show(over(refined, peer[0]), "{:.2f}"), show(float(r["fit"]), "{:.2e}"),
                      show(float(r["refined_fit"]), "{:.2e}"), show(peer[1], "{:.2e}"), show(float(r["irregularity"]), "{:.2f}"),
                      show(float(r["refined_irregularity"]), "{:.2f}"), show(peer[2], "{:.2f}")])
    table("Cuts: L2,1, squared distance to planes over the squared diagonal (fit), and irregularity",
          "VSA: the better of CGAL's hierarchical and random seeds, 20 iterations. refined: the cut of rounds, refined by the tree.",
          ["mesh", "clusters", "rounds", "greedy", "refined", "VSA", "MixKit", "refined/VSA", "fit rounds", "refined", "VSA", "irr. rounds", "refined",
           "VSA"], cells)


def growth(runs, mesh, base, threads):
    if mesh not in runs.faces or base not in runs.faces:
        return None
    here, there = runs.get(mesh, "rounds", threads=threads), runs.get(base, "rounds", threads=threads)
    return over(over(here, runs.faces[mesh]), over(there, runs.faces[base]))


def table_growth(runs):
    rows = []
    for family in ("bunny", "terrain", "sphere", "dragon"):
        members = [m for m in runs.meshes if m.split("-")[0] == family]
        base = "bunny" if family == "bunny" else members[0] if members else None
        for mesh in members:
            small = runs.get(base, "meshlets")
            rows.append([mesh, str(runs.faces[mesh])] + [show(growth(runs, mesh, base, t), "{:.2f}") for t in (1, 2)] +
                        [show(over(over(runs.get(mesh, "meshlets"), runs.faces[mesh]), over(small, runs.faces[base])), "{:.2f}")])
    table("Growth of the time per face against the smallest of its kind", "", ["mesh", "faces", "rounds T1", "T2", "meshlets"], rows)


def table_large(found):
    builds = [[r["mesh"], r["faces"], r["how"], r["code"], show(float(r["seconds"]), "{:.1f}"), show(float(r["resident_bytes"]) / 1e6, "{:.0f}"),
               show(float(r["resident_bytes"]) / float(r["faces"] or "nan"), "{:.0f}"), r["depth"]] for r in found if not r["clusters"]]
    table("Out of core: whole commands, files read and written", "", ["mesh", "faces", "how", "exit code", "seconds", "peak MB", "bytes/face", "depth"], builds)
    rows = []
    for r in found:
        other = [o for o in found if o["clusters"] and r["how"] == "parts" and o["how"] == "memory" and (o["mesh"], o["clusters"]) == (r["mesh"], r["clusters"])]
        for o in other:
            rows.append([r["mesh"], r["clusters"]] + [show(seam(r, o, k), "{:.3f}") for k in SEAM_FIGURES])
    if rows:
        table("Quality of a tree made in parts over that of the tree made in memory; the goal is at most 1.05", "",
              ["mesh", "clusters", "fit", "direction", "irregularity", "L2,1", "boxes"], rows)


SEAM_FIGURES = ["mean_fit", "mean_direction", "mean_irregularity", "mean_normal_deviation", "box_area"]


def seam(parts, memory, key):
    return over(float(parts[key]), float(memory[key])) if parts.get(key) and memory.get(key) else None


def read_rows(path):
    if not os.path.exists(path):
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def table_boxes(boxes):
    rows = []
    keys = sorted({(int(r["faces"]), r["mesh"]) for r in boxes})
    trees = ["rounds", "greedy", "regrouped", "obbtree", "aligned"]
    queries = ["primary", "incoherent", "touching", "apart"]
    for _, mesh in keys:
        for tree in trees:
            mine = {r["query"]: r for r in boxes if r["mesh"] == mesh and r["tree"] == tree}
            if not mine:
                continue
            row = [mesh, tree, show(float(mine["primary"]["area"]), "{:.1f}"), mine["primary"]["depth"]]
            for query in queries:
                row += [show(float(mine[query]["boxes"]), "{:.4g}"), show(float(mine[query]["triangles"]), "{:.3g}"),
                        show(float(mine[query]["microseconds"]), "{:.3g}")]
            rows.append(row)
    table("Boxes: ours beside a top-down OBBTree (split at the mean) and an aligned tree (surface area heuristic), one triangle a leaf",
          "area: inner boxes' surfaces over the squared diagonal. Queries, each: boxes tested, triangles tested, microseconds; the same plain\n"
          "code walks all trees. primary: parallel rays from outside; incoherent: from anywhere in the bounds, in any direction; touching,\n"
          "apart: the mesh against its copy at random poses a thousandth of the diagonal before and behind contact, yes or no.\n"
          "regrouped: our clusters of the cut into 4096 under a top built anew by the surface area heuristic: what rays alone would like.",
          ["mesh", "tree", "area", "depth"] + [c for q in queries for c in (q, "tri", "us")], rows)


def table_yardsticks(boxes):
    """Ours over the OBBTree's, by mesh."""
    value = {(r["mesh"], r["tree"], r["query"]): r for r in boxes}
    rows = []
    for mesh in sorted({r["mesh"] for r in boxes}, key=lambda m: int(next(r["faces"] for r in boxes if r["mesh"] == m))):
        row = [mesh]
        for tree in ("rounds", "regrouped"):
            pairs = [(value.get((mesh, tree, q)), value.get((mesh, "obbtree", q))) for q in ("primary", "incoherent", "touching", "apart")]
            if not all(a and b for a, b in pairs):
                row += ["-"] * 5
                continue
            row.append(show(over(float(pairs[0][0]["area"]), float(pairs[0][1]["area"])), "{:.2f}"))
            row += [show(over(float(a["boxes"]), float(b["boxes"])), "{:.2f}") for a, b in pairs]
        rows.append(row)
    table("Ours over the top-down OBBTree's: surface of boxes, boxes visited; under 1 ours is better", "",
          ["mesh", "rounds area", "primary", "incoherent", "touching", "apart", "regrouped area", "primary", "incoherent", "touching", "apart"], rows)


def smooth_of(mesh):
    return "sphere-" + mesh.rsplit("-", 1)[1]


def table_adversarial(runs):
    rows = []
    for mesh in runs.meshes:
        levels = math.log2(runs.faces[mesh])
        rows.append([mesh, str(runs.faces[mesh])] + [show(over(1e9 * (runs.get(mesh, "rounds", threads=t) or 0), runs.faces[mesh]), "{:.0f}") for t in (1, 2)] +
                    [show(growth(runs, mesh, smooth_of(mesh), t), "{:.2f}") for t in (1, 2)] +
                    [show(over(runs.get(mesh, "rounds", "grown_bytes"), runs.faces[mesh]), "{:.0f}"), show(runs.get(mesh, "rounds", "depth"), "{:.0f}"),
                     show(over(runs.get(mesh, "rounds", "depth"), levels), "{:.2f}"), str(runs.count(mesh, "rounds"))])
    table("Adversarial meshes, against a smooth one of the same size", "Nanoseconds a face; the ratio's goal is at most 2.",
          ["mesh", "faces", "T1", "T2", "ratio T1", "T2", "bytes/face", "depth", "/log2 F", "runs"], rows)


class Goals:
    def __init__(self):
        self.rows = []

    def most(self, what, value, limit, form="{:.2f}"):
        """The goal is value <= limit."""
        self.add(what, value, limit, form, "<=", over(value, limit))

    def least(self, what, value, limit, form="{:.2f}"):
        self.add(what, value, limit, form, ">=", over(limit, value))

    def add(self, what, value, limit, form, sign, excess):
        if value is None:
            verdict = "not measured"
        else:
            verdict = "met" if excess <= 1 else f"missed by {100 * (excess - 1):.0f} %"
        self.rows.append([what, show(value, form), f"{sign} {form.format(limit)}", verdict])

    def print(self):
        table("Goals", "", ["goal", "found", "wanted", ""], self.rows)
        met = sum(row[3] == "met" for row in self.rows)
        absent = sum(row[3] == "not measured" for row in self.rows)
        print(f"\n{met} of {len(self.rows)} goals met, {len(self.rows) - met - absent} missed, {absent} not measured")


def worst(pairs):
    """The largest of (value, mesh), with the mesh it is from."""
    pairs = [p for p in pairs if p[0] is not None]
    return max(pairs) if pairs else (None, "-")


def goals(runs, hard, large, cuts):
    g = Goals()
    for r in cuts:
        mesh, count = r["mesh"], int(r["clusters"])
        vsa = best_cut(cuts, mesh, count)
        if r["builder"] == "rounds" and count == 1000 and vsa:
            g.most(f"refined L2,1 at 1000 clusters over CGAL's better, {mesh}", over(float(r["refined_deviation"]), float(vsa["deviation"])), .95)
        if r["builder"] == "rounds" and (mesh, count) in MIXKIT_CUTS:
            g.most(f"L2,1 at {count} clusters over MixKit's, {mesh}", float(r["deviation"]) / MIXKIT_CUTS[mesh, count], 1)
    peer = runs.get("bunny-x16", "meshlets") if "bunny-x16" in runs.faces else None
    for threads, mixkit, rate in ((1, 30, 2), (2, 55, 3.5)):
        seconds = runs.get("bunny-x16", "rounds", threads=threads)
        mine = over(peer * mixkit_ratio(runs.faces["bunny-x16"]), seconds) if peer else None
        g.least(f"times faster than MixKit, 1.11 million, T{threads}", mine, mixkit, "{:.1f}")
        g.most(f"of the time of flat meshlets, 1.11 million, T{threads}", over(seconds, peer), 1)
        g.least(f"million faces a second, 1.11 million, T{threads}", over(runs.faces.get("bunny-x16", 0) / 1e6, seconds), rate)
    for threads in (1, 2):
        g.most(f"time per face at 4.44 million over that at 69 thousand, T{threads}", growth(runs, "bunny-x64", "bunny", threads), 1.4)
    ten = "terrain-10m"
    g.most("seconds for 10 million, T2", runs.get(ten, "rounds", threads=2), 5)
    g.most("gigabytes for 10 million, mesh included", over(runs.get(ten, "rounds", "peak_bytes", 2), 1e9), 2.2)
    value, mesh = worst((over(runs.get(m, "rounds", "grown_bytes", t), runs.faces[m]), m) for m in runs.meshes for t in (1, 2) if runs.faces[m] > 5e4)
    g.most(f"bytes per face at the peak, most ({mesh})", value, 200, "{:.0f}")
    for m in runs.meshes:
        ratio = over(runs.get(m, "rounds", "deviation"), best_vsa(runs, m))
        if ratio is not None:
            g.most(f"L2,1 at 1000 clusters over CGAL's best, {m}", ratio, .95)
    g.most("box areas over MixKit's, bunny", over(runs.get("bunny", "rounds", "box_area"), MIXKIT_BOXES["bunny"]), .75)
    value, mesh = worst((over(runs.get(m, "rounds", "mean_depth"), math.log2(runs.faces[m])), m) for m in runs.meshes)
    g.most(f"mean depth over log2 F, most ({mesh})", value, 1.15)
    value, mesh = worst((over(r.get(m, "rounds", "depth"), math.log2(r.faces[m])), m) for r in (runs, hard) for m in r.meshes)
    g.most(f"depth over log2 F, most ({mesh})", value, 3)
    for m in hard.meshes:
        if not m.startswith("sphere-"):
            ratio = max((growth(hard, m, smooth_of(m), t) or 0 for t in (1, 2)), default=None)
            g.most(f"time per face over a smooth mesh's, {m}", ratio or None, 2)
    for r in large:
        if r["mesh"] == "terrain-100m" and r["how"] == "4G":
            g.most("gigabytes for 100 million under --max-memory 4G", float(r["resident_bytes"]) / 1e9 if r["code"] == "0" else None, 4.295)
    seams = [(seam(r, o, k), f"{r['mesh']}, {k}, {r['clusters']} clusters") for r in large for o in large for k in SEAM_FIGURES
             if r["how"] == "parts" and o["how"] == "memory" and r["clusters"] and (r["mesh"], r["clusters"]) == (o["mesh"], o["clusters"])]
    if seams:
        value, where = worst(seams)
        g.most(f"quality in parts over that in memory, worst ({where})", value, 1.05)
    g.print()


def chart(runs, out):
    lines = [("rounds", 1, "rounds, one thread", "#1b6ca8"), ("rounds", 2, "rounds, two threads", "#0b3954"),
             ("greedy", 1, "greedy, one thread", "#4c9f70"), ("meshlets", 1, "meshlets of meshoptimizer", "#e07a1f"),
             ("mixkit", 1, "MixKit, by its ratio to meshlets", "#8a8a8a")]
    script = ["set terminal svg size 900,560 font 'sans,13' background '#ffffff'", f"set output '{os.path.join(out, 'time-per-face.svg')}'",
              "set logscale xy", "set xlabel 'faces'", "set ylabel 'nanoseconds a face'", "set key below", "set grid",
              "set format x '10^{%L}'", "set title 'Time of a whole build per face: bunny subdivided (lines), other meshes (points)'"]
    plots = []
    for n, (builder, threads, title, color) in enumerate(lines):
        for family in (True, False):
            points = []
            for mesh in runs.meshes:
                if (mesh.split("-")[0] == "bunny") != family:
                    continue
                seconds = runs.get(mesh, "meshlets" if builder == "mixkit" else builder, threads=threads)
                if seconds is not None:
                    scale = mixkit_ratio(runs.faces[mesh]) if builder == "mixkit" else 1
                    points.append(f"{runs.faces[mesh]} {1e9 * scale * seconds / runs.faces[mesh]:.6g}")
            if points:
                name = f"$d{n}{int(family)}"
                script += [f"{name} << EOD"] + points + ["EOD"]
                style = (f"with linespoints lc rgb '{color}' lw 2 pt 7 ps .7 title '{title}'" if family else
                         f"with points lc rgb '{color}' pt 6 ps .7 notitle")
                plots.append(f"{name} using 1:2 {style}")
    if not plots:
        return
    script.append("plot " + ", ".join(plots))
    try:
        subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"no chart: {error}", file=sys.stderr)


def is_older(path, moment):
    return os.path.exists(path) and os.path.getmtime(path) < moment


def main():
    out = sys.argv[1]
    runs, hard = Runs(os.path.join(out, "time.csv")), Runs(os.path.join(out, "adversarial.csv"))
    boxes = read_rows(os.path.join(out, "boxes.csv"))
    if os.path.exists(os.path.join(out, "machine.json")):
        with open(os.path.join(out, "machine.json")) as file:
            machine = json.load(file)
        print("\n{processor}, {cores} cores, load {load_before:.1f} before; {seconds:.0f} seconds of measuring".format(**machine))
        old = [part for part in ("time", "cuts", "adversarial", "boxes", "large") if is_older(os.path.join(out, part + ".csv"), machine["begin"])]
        if old:
            print(f"Of earlier runs: {', '.join(old)}.")
        if machine["load_before"] > .5:
            print("The machine was not idle: times and their ratios are not to be trusted.")
    if runs.meshes:
        for make in (table_time, table_phases, table_memory, table_quality, table_growth):
            make(runs)
        chart(runs, out)
    if hard.meshes:
        table_adversarial(hard)
    if boxes:
        table_boxes(boxes)
        table_yardsticks(boxes)
    large = read_rows(os.path.join(out, "large.csv"))
    if large:
        table_large(large)
    cuts = read_rows(os.path.join(out, "cuts.csv"))
    if cuts:
        table_cuts(cuts)
    goals(runs, hard, large, cuts)
    print(f"\nIn {out}: CSV files, time-per-face.svg, report.txt")


if __name__ == "__main__":
    main()
