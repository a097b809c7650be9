#!/usr/bin/env python3
"""Draws the charts of bench/queries/run from OUT/queries.csv with gnuplot, as SVG and PNG, and prints each goal beside its result.
usage: report.py OUT [--docs DIR]
With --docs it copies the SVG charts that docs/queries.md shows to DIR."""
import argparse
import csv
import math
import os
import shutil
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir))
from plot import block, plot # noqa: E402

# Colours of Okabe and Ito, which colour-blind people can tell apart; each also has a shape of its own.
STYLE = {"facetree": ("#0072b2", 7), "batch": ("#0072b2", 6), "Embree": ("#d55e00", 5), "robust": ("#e69f00", 4),
         "CGAL": ("#009e73", 9), "FCL": ("#aa4499", 11), "Bullet": ("#555555", 13)}
ROWS = [("primary", "primary rays", "#0072b2", 7), ("incoherent", "incoherent rays", "#d55e00", 5),
        ("incoherent any", "any hit", "#e69f00", 9), ("near points", "closest point, near", "#009e73", 11),
        ("box points", "closest point, anywhere", "#aa4499", 13)]
SHOWN = ("queries-embree", "queries-pairs", "queries-points")


def read_rows(path):
    with open(path, newline="", encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    for r in rows:
        r["faces"], r["threads"] = int(r["faces"]), int(r["threads"])
        r["value"], r["ratio"] = float(r["value"]), float(r["ratio"])
    return rows


def pick(rows, row, side, threads=1):
    return [r for r in rows if r["row"] == row and r["side"] == side and r["threads"] == threads]


def short_count(count):
    return f"{count / 1e6:.1f}M".replace(".0M", "M") if count >= 950000 else f"{count / 1e3:.0f}k"


def draw_inputs(out, rows):
    """Our rate over Embree's: one line per mesh, one mark per query, the marks a little above each other."""
    meshes = {}
    for r in pick(rows, "primary", "Embree"):
        meshes.setdefault(r["mesh"], r["faces"])
    names = list(meshes)[::-1]
    if not names:
        return
    body, curves = [], []
    for i, (row, title, color, shape) in enumerate(ROWS):
        points = [(r["ratio"], names.index(r["mesh"]) + .13 * (2 - i)) for r in pick(rows, row, "Embree")]
        body.append(block(f"row{i}", points))
        curves.append(f"$row{i} using 1:2 with points pt {shape} ps .9 lc rgb '{color}' title '{title}'")
    labels = ", ".join(f"'{m.rsplit('-', 1)[0]}, {short_count(meshes[m])}' {i}" for i, m in enumerate(names))
    height = 150 + 34 * len(names)
    ratios = [r["ratio"] for row in ROWS for r in pick(rows, row[0], "Embree")]
    least, most = (2 ** math.floor(math.log2(.9 * min(ratios))), 2 ** math.ceil(math.log2(1.1 * max(ratios))))
    body += ["set logscale x 2", "set xlabel 'times as fast as Embree, one thread'", f"set ytics ({labels}) nomirror scale 0",
             f"set yrange [-.6:{len(names) - .4}]", f"set xrange [{least}:{most}]", "set border 1",
             "set xtics nomirror", "set grid x lc rgb '#dddddd'", f"set tmargin at screen {1 - 70 / height}", "set rmargin 4",
             "set arrow from 1, graph 0 to 1, graph 1 nohead lw 1.5 lc rgb '#555555'",
             f"set key at screen .5,{1 - 8 / height} center top horizontal reverse Left samplen 1 maxrows 2 width 1"]
    for y in range(len(names) - 1):
        body.append(f"set arrow from graph 0, first {y + .5} to graph 1, first {y + .5} nohead lw .5 lc rgb '#dddddd'")
    plot(f"{out}/queries-embree", (720, height), body + ["plot " + ", ".join(curves)])


def draw_sizes(path, rows, panels):
    """Time per query over the number of triangles of the torso: one panel per row, a curve per library, one scale."""
    sides = [side for side in list(STYLE)[::-1] if side not in ("batch", "robust")]  # ours on top
    found = {}
    for k, (row, _) in enumerate(panels):
        for side in sides:
            points = sorted((r["faces"], 1e6 / r["value"]) for r in pick(rows, row, side) if r["mesh"].startswith("torso"))
            if len(points) > 1:
                found[k, side] = points
    if not found:
        return
    every = [p for points in found.values() for p in points]
    x, y = [p[0] for p in every], [p[1] for p in every]
    body = ["set logscale xy", "set format x '10^{%L}'", "set grid lc rgb '#dddddd'", "set border 3",
            "set tics nomirror", f"set xrange [{min(x) / 1.5}:{max(x) * 1.5}]", f"set yrange [{min(y) / 1.5}:{max(y) * 1.5}]"]
    body += [block(f"p{k}{side}", points) for (k, side), points in found.items()]
    look = {side: f"with linespoints lw 2 pt {shape} ps .8 lc rgb '{color}'" for side, (color, shape) in STYLE.items()}
    # the legend of all panels is a plot without axes
    body += ["set multiplot", "unset border", "unset tics", "set lmargin at screen 0", "set rmargin at screen 1",
             "set tmargin at screen 1", "set bmargin at screen .9",
             "set key center center horizontal reverse Left samplen 2 width 2 maxrows 1",
             "plot " + ", ".join(f"NaN {look[side]} title '{side}'" for side in STYLE if any(s == side for _, s in found)),
             "set key off", "set border 3", "set xtics nomirror", "set ytics nomirror", "set xlabel 'triangles'",
             "set tmargin at screen .83", "set bmargin at screen .17"]
    width = .89 / len(panels)
    for k, (row, title) in enumerate(panels):
        body += [f"set title '{title}' offset 0,-.4", f"set ylabel '{'' if k else 'microseconds per query'}'",
                 f"set format y '{'' if k else '%g'}'", f"set lmargin at screen {.1 + k * width}",
                 f"set rmargin at screen {.07 + (k + 1) * width}",
                 "plot " + ", ".join(f"$p{k}{side} {look[side]}" for side in sides if (k, side) in found)]
    plot(path, (820, 400), body + ["unset multiplot"])


def print_goal(what, peer, goal, result, most):
    met = result >= goal if most else result <= goal
    print("%-50s %-7s goal %6.2f  result %6.2f  %s" % (what, peer, goal, result, "met" if met else "missed"))


def print_goals(rows):
    """Medians over the meshes that a goal names."""
    def large(r):
        return r["mesh"].split("-")[0] in ("torso", "dragon", "terrain", "crate") and r["faces"] >= 800000

    def any_mesh(_):
        return True

    def named(*names):
        return lambda r: r["mesh"].split("-")[0] in names

    bodies = named("bunny", "nefertiti", "dragon")
    goals = [("primary rays, a million triangles and more", "primary", "Embree", large, 1),
             ("incoherent rays, a million triangles and more", "incoherent", "Embree", large, 1.15),
             ("incoherent rays, bunny", "incoherent", "Embree", named("bunny"), .9),
             ("primary rays, a million triangles and more", "primary", "robust", large, 1.2),
             ("incoherent rays, a million triangles and more", "incoherent", "robust", large, 1.2),
             ("incoherent rays, diagonal beams", "incoherent", "Embree", named("beams"), 2),
             ("incoherent rays, needles", "incoherent", "Embree", named("needles"), 1.1),
             ("incoherent rays, stacked blocks", "incoherent", "Embree", named("blocks"), 1.1),
             ("closest point, near", "near points", "Embree", any_mesh, 3),
             ("closest point, anywhere", "box points", "Embree", any_mesh, 8),
             ("overlap, touching, scans", "touching", "PQP*", bodies, 5), ("overlap, apart, scans", "apart", "PQP*", bodies, 5),
             ("distance, scans", "distance", "PQP*", bodies, 5)]
    print("\nGoals (one thread: how many times as fast as the peer, median over the meshes)")
    for what, row, side, wanted, goal in goals:
        found = [r["ratio"] for r in pick(rows, row, side) if wanted(r)]
        if found:
            print_goal(what, side, goal, statistics.median(found), True)
    for what, row, goal in (("bytes per triangle, rays alone", "bytes of rays", 32), ("bytes per triangle, rays and pairs", "bytes", 45)):
        found = [r["value"] for r in pick(rows, row, "facetree")]
        if found:
            print_goal(what, "", goal, statistics.median(found), False)
    print("PQP*: not measured. FCL's time in this run times .42 (touching), .45 (apart) or .81 (distance), from an earlier study"
          "\nof the bunny.")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("out")
    parser.add_argument("--docs")
    options = parser.parse_args()
    rows = read_rows(f"{options.out}/queries.csv")
    out = options.out
    draw_inputs(out, rows)
    draw_sizes(f"{out}/queries-pairs", rows, [("touching", "overlap, touching"), ("apart", "overlap, apart"),
                                              ("distance", "distance, apart")])
    draw_sizes(f"{out}/queries-points", rows, [("near points", "closest point near the surface"),
                                               ("box points", "closest point anywhere")])
    draw_sizes(f"{out}/queries-rays", rows, [("primary", "primary rays"), ("incoherent", "incoherent rays")])
    for name in SHOWN if options.docs else ():
        if os.path.exists(f"{out}/{name}.svg"):
            shutil.copy(f"{out}/{name}.svg", options.docs)
    print_goals(rows)


if __name__ == "__main__":
    main()
