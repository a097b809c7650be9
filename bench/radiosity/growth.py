#!/usr/bin/env python3
"""Solves the museum of `facetree make` at growing numbers of triangles: time and memory of the solution alone.
usage: growth.py FACETREE OUT [--triangles N,...] [--runs N] [--csv FILE]
For each number and both kinds of rays (obb, multires) it prints the seconds from opening the files to the solution (median of
the runs), elements, rays, links, the peak memory before the output, and the bytes of the hierarchy files that were read. With
gnuplot it also draws OUT/growth-time.svg and OUT/growth-memory.svg, the figures 8.7 and 8.8 of Garland's dissertation. The
largest museum takes 1.5 GB of disk."""
import argparse
import csv
import json
import os
import statistics
import subprocess
import sys

KINDS = ("obb", "multires")
KEYS = ("triangles", "rays of", "seconds", "elements", "rays", "links", "memory", "read")


def make_museum(tool, out, triangles):
    """The museum with hierarchy files in place of its meshes."""
    folder = f"{out}/museum{triangles}"
    scene = f"{folder}/scene.json"
    if os.path.exists(f"{folder}/made"):
        return scene
    subprocess.run([tool, "make", "museum", "--triangles", str(triangles), "-q", "-o", folder], check=True)
    for name in os.listdir(folder):
        if name.endswith(".ply"):
            subprocess.run([tool, "cluster", "-q", f"{folder}/{name}", "-o", f"{folder}/{name[:-4]}.fct"], check=True)
            os.remove(f"{folder}/{name}")
    with open(scene, encoding="ascii") as file:
        text = file.read()
    with open(scene, "w", encoding="ascii") as file:
        file.write(text.replace('.ply"', '.fct"'))
    with open(f"{folder}/made", "w", encoding="ascii"):
        pass
    return scene


def solve(tool, scene, kind, out):
    """One solution; the single probe is its only output."""
    probe = f"{out}/probe"
    with open(probe, "w", encoding="ascii") as file:
        file.write("0 1 0 0 1 0\n")
    done = subprocess.run([tool, "bake", scene, "--probe", probe, "--visibility", kind, "--json"], capture_output=True, text=True,
                          check=False)
    if done.returncode:
        sys.exit(f"{scene}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def measure(tool, out, triangles, runs):
    scene = make_museum(tool, out, triangles)
    solve(tool, scene, "multires", out)  # the files are in the cache from here on
    rows = []
    for kind in KINDS:
        found = [solve(tool, scene, kind, out) for _ in range(runs)]
        seconds = [sum(f["seconds"][k] for k in ("load", "open", "solve")) for f in found]
        last = found[-1]
        rows.append(dict(zip(KEYS, (triangles, kind, statistics.median(seconds), last["elements"], last["rays"], last["links"],
                                    max(f["solve_peak_bytes"] for f in found) / 1e6, last["touched_bytes"] / 1e6))))
        print("%10d %-9s %6.2f s %7d elements %9d rays %8d links %7.1f MB of memory %7.1f MB read" % tuple(rows[-1].values()),
              flush=True)
    return rows


def draw(out, rows):
    """Charts with both axes logarithmic."""
    names = {"obb": "exact rays", "multires": "--visibility multires"}
    for key, unit in (("seconds", "seconds"), ("memory", "MB")):
        path = f"{out}/growth-{'time' if key == 'seconds' else 'memory'}.svg"
        script = ["set terminal svg size 640,400 font 'sans,13' background '#ffffff'", f"set output '{path}'",
                  "set logscale xy", "set format x '10^{%L}'", "set xlabel 'triangles of the scene'", f"set ylabel '{unit}'",
                  "set key top left", "set grid", "set border 3", "set tics nomirror"]
        curves = []
        for i, kind in enumerate(KINDS):
            data = "\n".join(f"{r['triangles']} {r[key]}" for r in rows if r["rays of"] == kind)
            script.append(f"${kind} << END\n{data}\nEND")
            curves.append(f"${kind} with linespoints lw 2 pt {7 - 2 * i} ps .6 lc rgb '{('#b04030', '#2060a0')[i]}' title '{names[kind]}'")
        script.append(f"set yrange [{.5 if key == 'seconds' else 10}:]")
        script.append("plot " + ", ".join(curves))
        try:
            subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, check=True)
            print(path)
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"no chart: {error}", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("out")
    parser.add_argument("--triangles", default="30000,100000,300000,1000000,3000000,10000000")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--csv")
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    rows = [r for n in options.triangles.split(",") for r in measure(options.tool, options.out, int(n), options.runs)]
    if options.csv:
        with open(options.csv, "w", newline="", encoding="ascii") as file:
            writer = csv.DictWriter(file, KEYS)
            writer.writeheader()
            writer.writerows(rows)
    draw(options.out, rows)


if __name__ == "__main__":
    main()
