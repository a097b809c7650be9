"""The charts of bench/simplify/run."""
import math
import os
import sys

from runs import figure_points, fit_power, members

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), os.pardir))
from plot import block, plot # noqa: E402

# Colours of Okabe and Ito, which colour-blind people can tell apart; each also has a shape of its own.
STYLE = {"facetree": ("#0072b2", 7, "ours"), "norefit": ("#56b4e9", 6, "ours, without refit"), "subset": ("#555555", 4, "ours, subset"),
         "meshopt": ("#d55e00", 5, "meshoptimizer 0.18"), "cgal": ("#009e73", 9, "CGAL"), "openmesh": ("#aa4499", 11, "OpenMesh")}
COLORS = ["#0072b2", "#d55e00", "#009e73", "#aa4499", "#e69f00", "#555555"]
SHAPES = [7, 5, 9, 11, 13, 4]
AXES = ["set border 3", "set tics nomirror", "set grid lc rgb '#dddddd'", "set logscale xy", "set format y '10^{%L}'"]


def draw_curves(path, curves, body):
    """curves: title, points, colour, shape."""
    blocks = [block(f"c{i}", points) for i, (_, points, _, _) in enumerate(curves)]
    lines = [f"$c{i} using 1:2 with linespoints lw 2 pt {shape} ps .8 lc rgb '{color}' title \"{title}\""
             for i, (title, _, color, shape) in enumerate(curves)]
    plot(path, (760, 520), AXES + blocks + body + ["plot " + ", ".join(lines)])


def draw_errors(out, figures):
    """Figure 6.14: E_avg over the number of faces, with the fitted power of each mesh."""
    curves = []
    for i, mesh in enumerate(members(figures, "6.14", "mesh")):
        points = figure_points(figures, "6.14", mesh, "facetree")
        _, power = fit_power(points)
        points = [(m, e) for m, e, _, _ in points if e > 0]
        if points and power is not None:
            curves.append((f"{mesh}: m^{{-{power:.2f}}}", points, COLORS[i % 6], SHAPES[i % 6]))
    if not curves:
        return False
    every = [p for c in curves for p in c[1]]
    x, y = [p[0] for p in every], [p[1] for p in every]
    # a line of slope -2 below the curves, for the eye
    middle = math.exp(sum(math.log(p[1]) + 2 * math.log(p[0]) for p in every) / len(every)) / 30
    draw_curves(f"{out}/simplify-errors", curves + [("m^{-2}", [(min(x), middle / min(x) ** 2), (max(x), middle / max(x) ** 2)], "#bbbbbb", 0)],
                ["set xlabel 'faces m'", "set ylabel 'E_{avg} over the squared diagonal' offset 1,0", "set format x '10^{%L}'",
                 f"set xrange [{min(x) / 1.3}:{max(x) * 1.3}]", f"set yrange [{min(y) / 3}:{max(y) * 3}]", "set key top right"])
    return True


def draw_trade(out, figures):
    """Figure 6.16: time over error, one curve per library."""
    curves = []
    for mesh in members(figures, "6.16", "mesh"):
        for library, (color, shape, title) in STYLE.items():
            points = [(e, cpu) for _, e, cpu, _ in figure_points(figures, "6.16", mesh, library) if e > 0]
            if points:
                curves.append((title, points, color, shape))
        body = [f"set title '{mesh} to 50, 25, 10, 5, 2, 1 and .5 % of its faces, one thread'", "set format x '10^{%L}'",
                "set xlabel 'E_{avg} over the squared diagonal'", "set ylabel 'seconds'", "set format y '%g'", "set key outside below"]
        if curves:
            draw_curves(f"{out}/simplify-trade", curves, body)
            return True
    return False


def draw_noise(out, figures):
    """Figure 6.18: the error to the cube below the noise."""
    curves = []
    for i, mesh in enumerate(members(figures, "6.18", "mesh")):
        points = [(m, e) for m, e, _, _ in figure_points(figures, "6.18", mesh, "facetree") if e > 0]
        if points:
            curves.append((f"{mesh[5:]} %", points, COLORS[i % 6], SHAPES[i % 6]))
    if not curves:
        return False
    draw_curves(f"{out}/simplify-noise", curves, [
        "set title 'Cubes with noise, in percent of the diagonal: error to the cube without noise'", "set xlabel 'faces'",
        "set ylabel 'E_{avg} over the squared diagonal' offset 1,0", "set format x '%g'", "set xrange [10:15000]", "set key outside right reverse Left"])
    return True


def draw_sizes(out, cases):
    """Time per face at a tenth: lines for the torso, points for other meshes without attributes."""
    cases = [c for c in cases if c.share == .1 and ("shape", 1) not in c.runs]
    kinds = [("facetree", 1, "cpu", "ours, one thread", "#0072b2", 7), ("facetree", 2, "seconds", "ours, two threads", "#56b4e9", 6),
             ("meshopt", 1, "cpu", "meshoptimizer 0.18", "#d55e00", 5), ("cgal", 1, "cpu", "CGAL", "#009e73", 9),
             ("openmesh", 1, "cpu", "OpenMesh", "#aa4499", 11)]
    blocks, lines = [], []
    for n, (library, threads, key, title, color, shape) in enumerate(kinds):
        for family in (True, False):
            points = [(c.faces, 1e9 * seconds / c.faces) for c in cases for seconds in [c.median(library, key, threads)]
                      if seconds is not None and c.mesh.startswith("torso") == family]
            if points:
                blocks.append(block(f"s{n}{int(family)}", points))
                lines.append(f"$s{n}{int(family)} using 1:2 with " + (f"linespoints lw 2 pt {shape} ps .8 lc rgb '{color}' title '{title}'" if family else
                                                                        f"points pt {shape} ps .6 lc rgb '{color}' notitle"))
    if not lines:
        return False
    plot(f"{out}/simplify-time", (760, 520), AXES + blocks + [
        "set title 'To a tenth of the faces: the torso (lines), other meshes (points)'", "set xlabel 'faces'", "set ylabel 'nanoseconds per face'",
        "set format x '10^{%L}'", "set format y '%g'", "set key outside below", "plot " + ", ".join(lines)])
    return True


def draw_all(out, cases, figures):
    """The names of the charts that could be drawn."""
    return [name for name, done in (("simplify-errors", draw_errors(out, figures)), ("simplify-trade", draw_trade(out, figures)),
                                    ("simplify-noise", draw_noise(out, figures)), ("simplify-time", draw_sizes(out, cases))) if done]
