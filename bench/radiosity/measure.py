#!/usr/bin/env python3
"""Bakes the scenes of scenes.py and measures what a viewer shows, colours interpolated inside triangles, against paths.
usage: measure.py FACETREE OUT [--scenes NAME,...] [--points N] [--paths N] [--bake "OPTIONS"] [--csv FILE] [--map]
Prints per scene: RMS, bias and 99th percentile of the error over the mean, also of the worst object of at least .5 % of the
area; rays per vertex, times, and the estimate of the bake itself. Emitters are left out, and so are points that no path of
light reaches: most lie under other bodies, where no viewer sees them. Their number is printed, and the median of what they
show over the mean, which a leak of light into a dark place would raise. With --map also how well the error of
each vertex predicts: the error at the points in ten groups of the same size, from the least to the largest prediction. Needs
numpy."""
import argparse
import csv
import json
import os
import subprocess
import sys

import numpy as np

import scenes

# Points of an object that are traced again for its 99th percentile, and the factor on their paths.
WORST_SHARE, WORST_FACTOR = .05, 16
TYPES = {"uchar": "u1", "int": "<i4", "uint": "<u4", "float": "<f4", "float32": "<f4"}


def run_json(command):
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout)


def read_ply(path):
    """Positions, radiosities, triangles, shading normals and errors of a baked PLY."""
    with open(path, "rb") as file:
        data = file.read()
    end = data.index(b"end_header\n") + 11
    fields, vertices, faces, inside = [], 0, 0, False
    for line in data[:end].decode("ascii", "replace").splitlines():
        word = line.split()
        if word[0] == "element":
            inside = word[1] == "vertex"
            vertices, faces = (int(word[2]), faces) if inside else (vertices, int(word[2]))
        elif word[0] == "property" and inside:
            fields.append((word[2], TYPES[word[1]]))
    v = np.frombuffer(data, np.dtype(fields), vertices, end)
    f = np.frombuffer(data, np.dtype([("n", "u1"), ("v", "<u4", 3)]), faces, end + v.nbytes)
    return (np.stack([v[k] for k in "xyz"], 1).astype(float),
            np.stack([v["radiosity_" + k] for k in "rgb"], 1).astype(float), f["v"],
            np.stack([v["n" + k] for k in "xyz"], 1).astype(float), v["error"].astype(float)[:, None])


def pick_points(path, count, random):
    """Points by area: positions, interpolated shading normals, shown radiosities, predicted errors; and the area."""
    p, light, t, smooth, error = read_ply(path)
    area = np.linalg.norm(np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]), axis=1) / 2
    face = random.choice(len(t), count, p=area / area.sum())
    u = np.sort(random.random((count, 2)), 1)
    w = np.stack([u[:, 0], u[:, 1] - u[:, 0], 1 - u[:, 1]], 1)
    mix = lambda x: (x[t[face]] * w[:, :, None]).sum(1)
    return mix(p), mix(smooth), mix(light), mix(error)[:, 0], area.sum()


def trace_points(tool, scene, path, paths, seeds=("1", "2")):
    """Radiosities from two independent references."""
    halves = []
    for seed in seeds:
        found = run_json([tool, "bake", scene, "--method", "reference", "--samples", str(paths), "--seed", seed,
                          "--probe", path])["probes"]
        halves.append(np.array([q["radiosity"] for q in found]))
    return halves


def trace_worst(tool, scene, path, shown, halves, options):
    """A truth for percentiles, which noise of the truth would raise: the points with the largest errors of each object are
    traced again by many more paths."""
    truth, n = (halves[0] + halves[1]) / 2, options.points
    error = np.abs(shown - truth).max(1).reshape(-1, n)
    most = max(int(WORST_SHARE * n), 1)
    worst = (np.argsort(-error, 1)[:, :most] + n * np.arange(len(error))[:, None]).ravel()
    np.savetxt(f"{path}-worst", np.loadtxt(path)[worst], fmt="%.9g")
    again = trace_points(tool, scene, f"{path}-worst", WORST_FACTOR * options.paths, ("3", "4"))
    truth[worst] = (again[0] + again[1]) / 2
    return truth


def judge(shown, halves, quiet, area):
    """RMS, bias, 99th percentile over the mean; the error of the reference cancels in the product of its halves. quiet: the
    truth for the percentile."""
    truth = (halves[0] + halves[1]) / 2
    mean = truth.mean()
    square = ((shown - halves[0]) * (shown - halves[1])).mean()
    return {"rms": max(square, 0) ** .5 / mean, "bias": (shown - truth).mean() / mean, "area": area, "mean": mean,
            "square": square, "p99": np.percentile(np.abs(shown - quiet).max(1), 99) / mean}


def print_map(picks, halves, seen, mean):
    """True RMS errors over the mean, in ten groups of points by predicted error, and the predicted ones."""
    shown, predicted = (np.concatenate([p[k] for p in picks])[seen] for k in (2, 3))
    square = ((shown - halves[0][seen]) * (shown - halves[1][seen])).mean(1)
    groups = np.array_split(np.argsort(predicted), 10)
    for name, values in (("true", square), ("predicted", predicted ** 2)):
        print(f"    {name:9}", *("%6.2f" % (100 * max(values[g].mean(), 0) ** .5 / mean) for g in groups), "%")


def measure_scene(tool, out, name, options):
    folder = scenes.make_scene(tool, out, name)
    scene, baked = f"{folder}/scene.json", f"{out}/baked/{name}"
    subprocess.run(["rm", "-rf", baked], check=True)
    os.makedirs(baked)
    stats = run_json([tool, "bake", scene, "-o", baked + "/", "--light", "radiosity,error,normal",
                      *options.bake.split()])
    with open(scene, encoding="ascii") as file:
        document = json.load(file)
    lit = {m for m, v in document["materials"].items() if max(np.ravel(v.get("emission", 0))) > 0}
    dark = {i["name"]: i.get("material") not in lit for i in document["instances"]}
    files = [f for f in stats["files"] if dark.get(f["object"], True)]
    random = np.random.default_rng(3)
    picks = [pick_points(f["file"], options.points, random) for f in files]
    np.savetxt(f"{baked}/points", np.hstack([np.concatenate([p[k] for p in picks]) for k in (0, 1)]), fmt="%.9g")
    halves = trace_points(tool, scene, f"{baked}/points", options.paths)
    rows, n = {}, options.points
    seen = (halves[0] + halves[1]).sum(1) > 0
    shown = np.concatenate([p[2] for p in picks])
    quiet = trace_worst(tool, scene, f"{baked}/points", shown, halves, options)
    for i, (file, pick) in enumerate(zip(files, picks)):
        lit_points = seen[i * n:(i + 1) * n]
        if lit_points.any():
            rows[file["object"]] = judge(pick[2][lit_points], [h[i * n:(i + 1) * n][lit_points] for h in halves],
                                         quiet[i * n:(i + 1) * n][lit_points], pick[4])
    area = sum(r["area"] for r in rows.values())
    weigh = lambda key: sum(r[key] * r["area"] for r in rows.values()) / area
    big = {k: r for k, r in rows.items() if r["area"] > .005 * area}
    worst = max(big, key=lambda k: big[k]["rms"])
    total = max(weigh("square"), 0) ** .5 / weigh("mean")
    bias = sum(r["bias"] * r["mean"] * r["area"] for r in rows.values()) / area / weigh("mean")
    seconds = stats["seconds"]
    result = {"scene": name, "rms": total, "bias": bias, "worst": worst, "worst_rms": big[worst]["rms"],
              "worst_bias": big[worst]["bias"], "p99": max(r["p99"] for r in big.values()),
              "estimate": stats["error_estimate"], "vertices": stats["vertices"],
              "dark": int((~seen).sum()), "dark_shown": np.median(shown[~seen].mean(1)) / weigh("mean") if not seen.all() else 0,
              "rays_per_vertex": stats["output_rays"] / stats["vertices"], "solve_rays": stats["rays"],
              "seconds": seconds["total"], "output_seconds": seconds["push"]}
    print("%-10s rms %.2f %% bias %+.2f  worst %s %.1f %% (bias %+.1f)  p99 %.0f %%  estimate %.2f %%  %.1f rays a vertex, "
          "%d vertices, %.1f s; %d dark points show %.0f %%" % (name, 100 * total, 100 * bias, worst, 100 * result["worst_rms"],
                                   100 * result["worst_bias"], 100 * result["p99"], 100 * result["estimate"],
                                   result["rays_per_vertex"], stats["vertices"], seconds["total"], result["dark"],
                                   100 * result["dark_shown"]), flush=True)
    if options.map:
        print_map(picks, halves, seen, weigh("mean"))
    if options.objects:
        for key, row in sorted(big.items(), key=lambda item: -item[1]["rms"])[:8]:
            print(f"    {key}: {100 * row['rms']:.1f} % (bias {100 * row['bias']:+.1f}, p99 {100 * row['p99']:.0f})")
    return result


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("out")
    parser.add_argument("--scenes", default=",".join([*scenes.MADE, *scenes.MAKERS]))
    parser.add_argument("--points", type=int, default=240)
    parser.add_argument("--paths", type=int, default=400)
    parser.add_argument("--bake", default="")
    parser.add_argument("--csv")
    parser.add_argument("--objects", action="store_true")
    parser.add_argument("--map", action="store_true")
    options = parser.parse_args()
    rows = [measure_scene(options.tool, options.out, name, options) for name in options.scenes.split(",")]
    if options.csv:
        with open(options.csv, "w", newline="", encoding="ascii") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
