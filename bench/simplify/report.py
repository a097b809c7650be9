#!/usr/bin/env python3
"""Prints the tables of bench/simplify/run from OUT/simplify.csv and OUT/figures.csv, draws its charts, and holds the results
against the goals.
usage: report.py OUT [--docs DIR]
With --docs it copies the SVG charts to DIR."""
import argparse
import json
import math
import os
import shutil
import statistics

import charts
from runs import NEWEST_TIME, QSLIM_TIME, RGB_TIME, factor, figure_points, fit_power, make_cases, members, over, read_rows, times

# E_avg over the squared diagonal of the cow, by faces: optimal and subset placement (Garland 1999, table 6.4).
TABLE_64 = {10: (5.45769e-3, 7.84432e-3), 100: (2.59639e-4, 3.52787e-4), 500: (1.27412e-5, 2.03091e-5), 1000: (3.43394e-6, 5.18089e-6),
            3000: (2.57919e-7, 3.39024e-7), 5000: (1.05293e-8, 1.12268e-8)}
LIBRARIES = ["facetree", "shape", "meshopt", "cgal", "openmesh"]
DEFECTS = ["duplicates", "flat", "folds", "nonmanifold"]


def show(value, form="{:.3g}"):
    return "-" if value is None else value if isinstance(value, str) else form.format(value)


def table(title, note, head, rows):
    if not rows:
        return
    print("\n" + title)
    if note:
        print(note)
    cells = [head] + [[show(c) for c in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    for n, row in enumerate(cells):
        print("  " + "  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths))).rstrip())
        if n == 0:
            print("  " + "-" * (sum(widths) + 2 * len(widths) - 2))


def ms(seconds):
    return show(times(1000, seconds), "{:.4g}")


def table_time(cases):
    rows = []
    for c in cases:
        meshopt, one, two = c.median("meshopt"), c.ratio("meshopt"), c.ratio("meshopt", "seconds", threads=2)
        rows.append(c.name() + [ms(c.median("facetree")), ms(c.median("facetree", "seconds", 2)), ms(c.median("shape")), ms(meshopt), ms(c.median("cgal")),
                                ms(c.median("openmesh"))] +
                    [show(v, "{:.2f}") for v in (one, two, c.ratio("meshopt", library="shape"), over(one, factor(NEWEST_TIME, c.faces)),
                                                 over(two, factor(NEWEST_TIME, c.faces)), over(one, factor(RGB_TIME, c.faces)))] +
                    [show(over(factor(QSLIM_TIME, c.faces), one), "{:.2f}"), show(over(1, c.ratio("cgal")), "{:.2f}"),
                     show(over(1, c.ratio("openmesh")), "{:.2f}"), c.counts()])
    table("Time, library alone",
          "Milliseconds, medians; T1: one thread, processor time; T2: two threads, wall time. shape: ours without the attributes of the mesh.\n"
          "/0.18: median of our time over that of meshoptimizer 0.18 in the same round. new*, rgb*: over meshoptimizer 1.2 and over the same\n"
          "with RGB; QSlim*: how many times faster than QSlim 2.1. * These are not in Debian: their times are those of 0.18 in this run,\n"
          "times factors that were measured once. runs: of T1, T2, meshopt, cgal, openmesh.",
          ["mesh", "faces", "%", "T1", "T2", "shape", "meshopt", "cgal", "openmesh", "T1/0.18", "T2/0.18", "shape/0.18", "T1/new*", "T2/new*", "T1/rgb*",
           "x QSlim*", "x cgal", "x openmesh", "runs"], rows)


def table_memory(cases):
    rows = []
    for c in cases:
        grown = [c.median("facetree", "grown_bytes"), c.median("facetree", "grown_bytes", 2)] + [c.median(x, "grown_bytes") for x in LIBRARIES[1:]]
        if c.share == .1 and c.faces > 50000:
            rows.append(c.name()[:2] + [show(over(g, c.faces), "{:.0f}") for g in grown])
    table("Memory at a tenth: bytes per face at the peak, above the mesh in the form of the library", "",
          ["mesh", "faces", "T1", "T2"] + LIBRARIES[1:], rows)


def shown_error(c, library, key):
    if (library, 1) in c.runs and not c.reached(library):
        return f"at {c.runs[library, 1][0]['reached']}" if 0 in c.runs[library, 1] else "-"
    return show(c.judged(library, key), "{:.2e}")


def table_errors(cases):
    for key, title in (("e_avg", "E_avg over the squared diagonal"), ("e_max", "E_max over the diagonal")):
        rows = []
        for c in cases:
            ours = c.error(c.shape(), key)
            ratios = [over(ours, c.error(x, key)) for x in ("meshopt", "cgal", "openmesh")]
            if key == "e_avg":
                ratios += [over(ours, c.newest_error()), over(ours, c.qslim_error())]
            rows.append(c.name() + [shown_error(c, x, key) for x in LIBRARIES] + [show(r, "{:.2f}") for r in ratios])
        note = "Vertices and up to 10 samples per face, both ways. 'at N': stopped at N faces. Ratios: ours over theirs; shape where it exists. Errors below\n" \
               "the rounding of floats are equal."
        extra = ["/new*", "/QSlim*"] if key == "e_avg" else []
        if extra:
            note += "\n* By factors that were measured once: meshoptimizer 1.2 with update from 0.18, QSlim from CGAL; on the bunny, their errors themselves."
        table(title, note, ["mesh", "faces", "%"] + LIBRARIES + ["/0.18", "/cgal", "/openmesh"] + extra, rows)


def table_colors(cases):
    rows = []
    for c in cases:
        if c.judged("facetree", "color_rms") is not None:
            used = ["facetree", "shape", "meshopt", "openmesh"]
            rows.append(c.name() + [show(c.judged(x, k)) for k in ("color_rms", "color_relative") for x in used])
    table("Errors of colours",
          "RMS over RGB and all samples; relative: over the RMS of the colours, both cut at the colour that 95 % of the surface does not exceed. The peers\n"
          "do not see colours, and keep those of vertices; meshoptimizer 0.18 has no attributes, and CGAL's result has no colours.",
          ["mesh", "faces", "%", "RMS facetree", "shape", "meshopt", "openmesh", "relative facetree", "shape", "meshopt", "openmesh"], rows)


def defects_of(c, library):
    return {kind: c.count(library, "new_" + kind) or 0 for kind in DEFECTS}


def excess_of(c, library):
    """New defects; if the input has such, which move with the surface, the excess over their number."""
    found = {}
    for kind, new in defects_of(c, library).items():
        before = c.count(library, "input_" + kind) or 0
        found[kind] = min(new, max(0, (c.count(library, kind) or 0) - before)) if before else new
    return found


def is_closed(c, library):
    """Whether a result that has borders belongs to a mesh that has borders: drift is -1 if only one of them has."""
    row = c.runs[library, 1][0]
    return not (float(row["drift"]) < 0 and int(row["borders"]) > 0)


def table_defects(cases):
    rows, sums = [], {}
    for c in cases:
        for library in LIBRARIES:
            if 0 not in c.runs.get((library, 1), {}):
                continue
            found = defects_of(c, library)
            total = sums.setdefault(library, dict({kind: 0 for kind in DEFECTS}, open=0, results=0, bad=0))
            opened = not is_closed(c, library)
            for kind, count in found.items():
                total[kind] += count
            total["open"] += opened
            total["results"] += 1
            total["bad"] += opened or any(found.values())
            if library in ("facetree", "shape") and (opened or any(found.values())):
                before = [c.count(library, "input_" + kind) for kind in DEFECTS]
                rows.append(c.name() + [library] + [f"{found[kind]} ({n})" if n else str(found[kind]) for kind, n in zip(DEFECTS, before)] +
                            ["yes" if opened else ""])
    table("New defects, sums over all results",
          "Defects that the input does not have nearby; those of the input also move with the surface. Faces with equal corners, faces\n"
          "without area, edges with less than 26 degrees between two faces, edges of three or more faces; closed meshes that are open\n"
          "afterwards. bad: results with any of these.",
          ["library", "results", "bad", "duplicates", "flat", "folds", "non-manifold", "opened"],
          [[x] + [str(sums[x][k]) for k in ("results", "bad", *DEFECTS, "open")] for x in LIBRARIES if x in sums])
    table("New defects of ours", "A number in brackets: of the input.", ["mesh", "faces", "%", "library", "duplicates", "flat", "folds", "non-manifold", "opened"], rows)


def table_refused(cases):
    rows = sorted({(c.mesh, key[0], status) for c in cases for key, status in c.status.items() if status != "ok"})
    table("Not measured", "skipped: would take longer than the limit, by the library's last mesh.", ["mesh", "library", "why"], [list(r) for r in rows])


# --- Figures of the dissertation ---

def table_figures(figures):
    rows = []
    for mesh in members(figures, "6.14", "mesh"):
        for library in members(figures, "6.14", "library"):
            points = figure_points(figures, "6.14", mesh, library)
            alpha, power = fit_power(points)
            squared = [math.log(e) + 2 * math.log(m) for m, e, _, _ in points[2:] if e > 0]
            rows.append([mesh, library, show(power, "{:.2f}"), alpha, math.exp(statistics.mean(squared)) if squared else None, str(len(points))])
    table("Figure 6.14: E_avg = alpha m^-p over m faces, without the two largest m (the dissertation has p = 2)",
          "norefit: ours without the refit. alpha at p = 2: the mean over the points.", ["mesh", "library", "p", "alpha", "alpha at p = 2", "points"], rows)
    rows = []
    for library, column in (("facetree", 0), ("norefit", 0), ("subset", 1)):
        for m, e, _, target in figure_points(figures, "table 6.4", "cow", library):
            rows.append([library, str(target), str(m), show(e, "{:.4g}"), show(TABLE_64[target][column], "{:.4g}"), show(e / TABLE_64[target][column], "{:.2f}")])
    table("Table 6.4: E_avg of the cow over the squared diagonal", "Wanted: optimal placement, and subset placement for subset. 100 samples per face.",
          ["library", "target", "faces", "found", "dissertation", "ratio"], rows)
    rows = []
    for mesh in members(figures, "6.16", "mesh"):
        for library in members(figures, "6.16", "library"):
            for m, e, cpu, _ in figure_points(figures, "6.16", mesh, library):
                rows.append([mesh, library, str(m), show(e, "{:.3e}"), ms(cpu)])
    table("Figure 6.16: error and time, one thread", "", ["mesh", "library", "faces", "E_avg", "ms"], rows)
    rows = []
    for mesh in members(figures, "6.18", "mesh"):
        for library in members(figures, "6.18", "library"):
            found = {p[3]: p[1] for p in figure_points(figures, "6.18", mesh, library)}
            rows.append([mesh[5:] + " %", library] + [show(found.get(m), "{:.1e}") for m in (12288, 6400, 3200, 1600, 800, 400, 200, 100, 50, 25, 12)])
    table("Figure 6.18: E_avg between the unit cube and simplified cubes with noise, by faces", "Noise in percent of the diagonal.",
          ["noise", "library", "12288", "6400", "3200", "1600", "800", "400", "200", "100", "50", "25", "12"], rows)


# --- Goals ---

class Goals:
    def __init__(self):
        self.rows = []

    def most(self, what, value, limit, form="{:.2f}"):
        """The goal is value <= limit."""
        verdict = "not measured" if value is None else "met" if value <= limit else "missed"
        self.rows.append([what, show(value, form), "<= " + form.format(limit), verdict])

    def print(self):
        table("Goals", "The worst of all meshes. * By factors that were measured once.", ["goal", "found", "wanted", ""], self.rows)
        count = [sum(row[3] == verdict for row in self.rows) for verdict in ("met", "missed", "not measured")]
        print("\n{} of {} goals met, {} missed, {} not measured".format(count[0], len(self.rows), count[1], count[2]))


def worst(pairs):
    """The largest of (value, mesh), with the mesh that it is from."""
    pairs = [p for p in pairs if p[0] is not None]
    return max(pairs) if pairs else (None, "-")


def goals(cases, figures):
    g = Goals()
    for share, limit in ((.1, .8), (.01, .67)):
        at = [c for c in cases if c.share == share]
        value, mesh = worst((over(c.error(c.shape(), "e_avg"), c.qslim_error()), c.mesh) for c in at)
        g.most(f"E_avg over QSlim's* at {100 * share:g} %, most ({mesh})", value, limit)
        value, mesh = worst((over(c.error(c.shape(), "e_avg"), c.newest_error()), c.mesh) for c in at)
        g.most(f"E_avg over newest meshoptimizer's* at {100 * share:g} %, most ({mesh})", value, 1)
        value, mesh = worst((over(c.error(c.shape(), "e_max"), c.error("cgal", "e_max")), c.mesh) for c in at)
        g.most(f"E_max over CGAL's, for QSlim's, at {100 * share:g} %, most ({mesh})", value, 1.1)
    for library, column, word in (("facetree", 0, "optimal"), ("subset", 1, "subset")):
        points = figure_points(figures, "table 6.4", "cow", library)
        value, where = worst((p[1] / TABLE_64[p[3]][column], f"{p[3]} faces") for p in points)
        g.most(f"E_avg over table 6.4, {word} placement, most ({where})", value, 1)
        g.most(f"faces of the smallest cow of table 6.4, {word} placement", min((p[0] for p in points), default=None), 10, "{:.0f}")
    plain = [c for c in cases if c.share == .1 and ("shape", 1) not in c.runs]
    for low, high, limit in ((50000, 200000, 1.4), (200000, 1e9, 1)):
        at = [c for c in plain if low <= c.faces < high]
        value, mesh = worst((over(c.ratio("meshopt"), factor(NEWEST_TIME, c.faces)), c.mesh) for c in at)
        g.most(f"time over newest meshoptimizer's*, T1, from {low} faces, most ({mesh})", value, limit)
    value, mesh = worst((over(c.ratio("meshopt", "seconds", threads=2), factor(NEWEST_TIME, c.faces)), c.mesh) for c in plain if c.faces >= 200000)
    g.most(f"time over newest meshoptimizer's*, T2, from 200000 faces, most ({mesh})", value, .6)
    value, mesh = worst((over(c.median("facetree", "grown_bytes", t), c.faces), c.mesh) for c in plain for t in (1, 2) if c.faces > 50000)
    g.most(f"bytes per face, most ({mesh})", value, 130, "{:.0f}")
    colored = [c for c in cases if c.share == .1 and c.judged("facetree", "color_rms") is not None and c.faces > 50000]
    value, mesh = worst((over(c.ratio("meshopt"), factor(RGB_TIME, c.faces)), c.mesh) for c in colored)
    g.most(f"time with colours over meshoptimizer's with RGB*, T1, most ({mesh})", value, 1.2)
    g.most("error of colours over meshoptimizer's with RGB", None, .75) # Debian's version has no attributes
    ours = [(c, excess_of(c, "facetree")) for c in cases if 0 in c.runs.get(("facetree", 1), {})]
    for kind in DEFECTS:
        value, mesh = worst((found[kind], c.mesh) for c, found in ours)
        g.most(f"new {kind}, most of one result ({mesh})", value, 0, "{:.0f}")
    g.most("closed meshes that are open afterwards", sum(not is_closed(c, "facetree") for c, _ in ours) if ours else None, 0, "{:.0f}")
    value, mesh = worst((abs(c.judged("facetree", "drift")), c.mesh) for c, _ in ours if c.mesh.startswith("grid") and c.judged("facetree", "drift") is not None)
    g.most(f"straight borders: drift over the diagonal, most ({mesh})", value, 1e-6, "{:.1e}")
    g.print()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--docs")
    options = parser.parse_args()
    out = options.out
    cases, figures = make_cases(read_rows(f"{out}/simplify.csv")), read_rows(f"{out}/figures.csv")
    if os.path.exists(f"{out}/machine.json"):
        with open(f"{out}/machine.json", encoding="ascii") as file:
            machine = json.load(file)
        print("\n{processor}, {cores} cores, load {load_before:.1f} before; {seconds:.0f} seconds of measuring".format(**machine))
        if machine["load_before"] > .5:
            print("The machine was not idle: do not trust the times and their ratios.")
    for make in (table_time, table_memory, table_errors, table_colors, table_defects, table_refused):
        make(cases)
    table_figures(figures)
    goals(cases, figures)
    print()
    drawn = charts.draw_all(out, cases, figures)
    for name in drawn if options.docs else ():
        shutil.copy(f"{out}/{name}.svg", options.docs)


if __name__ == "__main__":
    main()
