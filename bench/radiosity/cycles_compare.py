#!/usr/bin/env python3
"""Bakes scenes and compares the light of vertices with Blender's Cycles, which lights the same mesh.
usage: cycles_compare.py FACETREE OUT [--scenes NAME,...] [--points N] [--samples N] [--bake "OPTIONS"] [--csv FILE]
                         [--picture SAMPLES] [--units]
Reads the light, the normals, the emission and the reflectance from the .glb of the bake. Cycles renders the radiance at a subset
of the vertices with two seeds. The product of the two differences has the mean (x - truth)^2, because the noise of the two is
independent. Vertices count by the area around them; emitters are left out. Needs numpy and Blender."""
import argparse
import csv
import json
import os
import resource
import struct
import subprocess
import sys

import numpy as np

import scenes

HERE = os.path.dirname(os.path.abspath(__file__))
INWARD = .02  # distance of a point from its vertex, as a share of its face


def run_blender(*words):
    done = subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "-P", f"{HERE}/cycles_blender.py",
                           "--", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"blender {' '.join(words)}: exit {done.returncode}: {done.stdout[-2000:]}{done.stderr[-2000:]}")


def run_timed(command):
    """JSON of a command, and its CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(f"{' '.join(command)}: exit {done.returncode}: {done.stderr}")
    return json.loads(done.stdout), after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


class Glb:
    """A baked .glb; the light of its vertices can be replaced."""

    def __init__(self, path):
        with open(path, "rb") as file:
            self.data = bytearray(file.read())
        size = struct.unpack_from("<I", self.data, 12)[0]
        self.json = json.loads(self.data[20:20 + size])
        self.start = 28 + size

    def array(self, index):
        a = self.json["accessors"][index]
        view = self.json["bufferViews"][a["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "u1"}[a["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[a["type"]]
        if view.get("byteStride", 0) not in (0, width * np.dtype(kind).itemsize):
            sys.exit("interleaved accessors are not read")
        at = self.start + view.get("byteOffset", 0) + a.get("byteOffset", 0)
        return np.frombuffer(self.data, kind, a["count"] * width, at).reshape(-1, width)

    def places(self):
        """The matrix of each node that has a mesh."""
        nodes = self.json["nodes"]
        stack = [(n, np.eye(4)) for n in self.json["scenes"][self.json.get("scene", 0)]["nodes"]]
        while stack:
            index, above = stack.pop()
            node = nodes[index]
            here = above @ find_matrix(node)
            if "mesh" in node:
                yield node.get("name", str(index)), node["mesh"], here
            stack += [(n, here) for n in node.get("children", [])]

    def objects(self):
        """One dict per primitive: positions and normals in the world, light, triangles, material."""
        result = []
        for name, mesh, place in sorted(self.places(), key=lambda x: x[1]):
            for primitive in self.json["meshes"][mesh]["primitives"]:
                keys = primitive["attributes"]
                material = self.json["materials"][primitive["material"]]
                extras, base = material.get("extras", {}), material.get("pbrMetallicRoughness", {})
                strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {})
                emission = np.array(material.get("emissiveFactor", [0, 0, 0])) * strength.get("emissiveStrength", 1)
                normals = self.array(keys["NORMAL"]) @ np.linalg.inv(place[:3, :3])
                result.append({
                    "name": name, "positions": self.array(keys["POSITION"]) @ place[:3, :3].T + place[:3, 3],
                    "normals": normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-30)[:, None],
                    "light": self.array(keys["_RADIOSITY"]).astype(float),
                    "triangles": self.array(primitive["indices"]).reshape(-1, 3).astype(np.int64),
                    "reflectance": extras.get("reflectance", base.get("baseColorFactor", [1, 1, 1, 1])[:3]),
                    "emission": emission, "two_sided": material.get("doubleSided", False), "keys": keys})
        return result

    def save(self, path, lights, objects):
        """The same file with other light."""
        for light, item in zip(lights, objects):
            keys = item["keys"]
            self.array(keys["_RADIOSITY"])[:] = light
            self.array(keys["COLOR_0"])[:, :3] = np.clip(light, 0, 1) * 65535 + .5
        with open(path, "wb") as file:
            file.write(self.data)


def find_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"]).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    result = np.eye(4)
    result[:3, :3] = turn * node.get("scale", [1, 1, 1])
    result[:3, 3] = node.get("translation", [0, 0, 0])
    return result


def measure_areas(item):
    """Areas of the triangles, and a third of those around each vertex."""
    p, t = item["positions"], item["triangles"]
    faces = np.linalg.norm(np.cross(p[t[:, 1]] - p[t[:, 0]], p[t[:, 2]] - p[t[:, 0]]), axis=1) / 2
    return faces, np.bincount(t.ravel(), np.repeat(faces / 3, 3), len(p))


def choose_faces(item, chosen):
    """For each chosen vertex a face of its own and its corner there, or -1: a large one without covered (black) vertices."""
    faces, _ = measure_areas(item)
    t, dark = item["triangles"], item["light"].max(1) <= 0
    order = np.argsort(-np.where(dark[t].any(1), faces * 1e-6, faces), kind="stable")
    wanted, result, used = set(chosen.tolist()), {}, set()
    for f in order.tolist():
        for c in range(3):
            v = int(t[f, c])
            if v in wanted and v not in result and f not in used and faces[f] > 0:
                result[v] = (f, c)
                used.add(f)
    return np.array([result.get(v, (-1, 0)) for v in chosen.tolist()], int).reshape(-1, 2)


def insert_points(item, chosen):
    """The mesh with a small triangle near each chosen vertex; the faces around it fill the rest of the vertex's face."""
    p, n, t = item["positions"], item["normals"], item["triangles"]
    at = choose_faces(item, chosen)
    chosen, at = chosen[at[:, 0] >= 0], at[at[:, 0] >= 0]
    corners = np.stack([t[at[:, 0], (at[:, 1] + k) % 3] for k in range(3)], 1)
    e = INWARD
    weights = np.array([[1 - 4 / 3 * e, 2 / 3 * e, 2 / 3 * e], [1 - 7 / 3 * e, 5 / 3 * e, 2 / 3 * e],
                        [1 - 7 / 3 * e, 2 / 3 * e, 5 / 3 * e]])
    mix = lambda x: np.einsum("kc,fcd->fkd", weights, x[corners]).reshape(-1, 3)
    smooth = mix(n)
    inner = len(p) + np.arange(3 * len(chosen)).reshape(-1, 3)
    v, a, b = corners.T
    q, r, s = inner.T
    ring = [np.stack(x, 1) for x in ((v, a, r), (v, r, q), (a, b, s), (a, s, r), (b, v, q), (b, q, s))]
    rest = np.delete(t, at[:, 0], 0)
    return chosen, {"positions": np.vstack([p, mix(p)]),
                    "normals": np.vstack([n, smooth / np.linalg.norm(smooth, axis=1)[:, None]]),
                    "triangles": np.vstack([inner, *ring, rest]),
                    "points": np.r_[np.arange(len(chosen)), np.full(6 * len(chosen) + len(rest), -1)]}


def write_points(path, objects, limit):
    """Writes the mesh for Cycles; returns the vertices that are points, at most `limit` per object."""
    random = np.random.default_rng(3)
    parts, picks, points, vertices = [], [], 0, 0
    for i, item in enumerate(objects):
        count = 0 if max(item["emission"]) > 0 else len(item["positions"])
        chosen = random.permutation(count)[:limit]
        chosen, part = insert_points(item, np.sort(chosen))
        part["points"][part["points"] >= 0] += points
        part["triangles"] = part["triangles"] + vertices
        part["materials"] = np.full(len(part["triangles"]), i)
        points, vertices = points + len(chosen), vertices + len(part["positions"])
        parts.append(part)
        picks.append(chosen)
    join = lambda key: np.concatenate([x[key] for x in parts])
    np.savez(path, positions=join("positions"), normals=join("normals"), triangles=join("triangles"),
             materials=join("materials"), pixels=join("points"),
             **{key: np.array([x[key] for x in objects]) for key in ("reflectance", "emission", "two_sided")})
    return picks


def light_points(out, objects, limit, runs):
    """Vertices per object, and per run the light of each object's vertices with the CPU seconds."""
    picks = write_points(f"{out}/points.npz", objects, limit)
    run_blender("bake", f"{out}/points.npz", f"{out}/light.npz", *runs)
    data, cuts = np.load(f"{out}/light.npz"), np.cumsum([len(p) for p in picks])[:-1]
    return picks, {run: (np.split(data[f"light {run}"].astype(float), cuts), float(data[f"seconds {run}"])) for run in runs}


def sum_up(light, halves, areas):
    """Weighted sums of area, light, truth and squared error."""
    truth, w = (halves[0] + halves[1]) / 2, areas[:, None]
    return np.array([areas.sum(), (w * light).sum() / 3, (w * truth).sum() / 3,
                     (w * (light - halves[0]) * (light - halves[1])).sum() / 3])


def find_errors(sums):
    """RMS error over the mean, and ratio of the means."""
    return max(sums[3] * sums[0], 0) ** .5 / sums[2], sums[1] / sums[2]


def draw(tool, out, name, file, objects, samples):
    """A picture of our light, that of Cycles at all vertices, and grey plus ten times the difference; see --picture."""
    picks, lights = light_points(out, objects, max(len(x["positions"]) for x in objects), [f"{samples}:5"])
    ours = [x["light"].copy() for x in objects]
    theirs = [x.copy() for x in ours]
    for light, pick, found in zip(theirs, picks, lights[f"{samples}:5"][0]):
        light[pick] = found
    dark = [x for x, y in zip(ours, objects) if max(y["emission"]) <= 0]
    exposure = .25 / np.concatenate(dark).mean()
    grey = [.2 / exposure + 10 * (a - b) for a, b in zip(ours, theirs)]
    images = []
    for part, light in (("facetree", ours), ("cycles", theirs), ("difference", grey)):
        file.save(f"{out}/{name}-{part}.glb", [np.maximum(x, 0) for x in light], objects)
        images.append(f"{out}/{name}-{part}.png")
        subprocess.run([tool, "render", f"{out}/{name}-{part}.glb", "-q", "-o", images[-1], "--shading", "light", "--tone",
                        "clamp", "--exposure", str(exposure), "--size", "800x600", "--samples", "4"], check=True)
    run_blender("join", f"{out}/{name}.png", *images)
    print(f"    {out}/{name}.png: Facetree, Cycles with {samples} samples, ten times the difference")


def make_open(scene):
    """Ground, a crate, a ball, a column and a statue under one lamp; no walls."""
    scene.add("ground", scene.sheet("ground", (-5, 0, -5), (0, 0, 10), (10, 0, 0)), "ground")
    scene.add("crate", scene.cube(), "wood", (-1.8, .6, .4), (.6, .6, .6), 25)
    scene.add("ball", scene.shape("sphere", 2000), "white", (1.4, .9, .8), (.8, .8, .8))
    scene.add("column", scene.shape("cylinder", 600), "plaster", (.2, 0, -1.5), (.4, 2, .4))
    scene.add("bust", scene.shape("bust", 6000), "red", (2.6, 0, -1.6), (1.2, 1.2, 1.2))
    scene.panel("lamp", [30, 28, 24], (0, 4, 1), (.6, .6))
    scene.save([4.5, 3.6, 6], [.2, .6, -.3], 45)


def make_scene(tool, out, name):
    """The scene file."""
    if name == "room":
        if not os.path.exists(f"{out}/room.glb"):
            run_blender("make", f"{out}/room.glb")
        return f"{out}/room.glb"
    if name == "open":
        scenes.DENSE["open"] = make_open
    return scenes.make_scene(tool, out, name) + "/scene.json"


def find_crossing(errors, rms):
    """Samples at which Cycles has the RMS error. errors: those of growing numbers of samples; between and beyond two of them
    the error is a power of the samples. It falls faster than with independent samples, because those of Cycles are even."""
    x, y = np.log(list(errors)), np.log(list(errors.values()))
    k = min(max(int((y > np.log(rms)).sum()), 1), len(y) - 1)
    slope = min((y[k] - y[k - 1]) / (x[k] - x[k - 1]), -.25)
    return float(np.exp(x[k] + (np.log(rms) - y[k]) / slope))


def measure_scene(tool, out, name, options):
    scene, baked = make_scene(tool, out, name), f"{out}/{name}-baked.glb"
    stats, seconds = run_timed([tool, "bake", scene, "-o", baked, *options.bake.split()])
    file = Glb(baked)
    objects = file.objects()
    n, steps = options.samples, [max(options.samples // k, 1) for k in (64, 16, 4)]
    runs = [f"{n}:1", f"{n}:2"] + [f"{k}:3" for k in steps]
    picks, lights = light_points(out, objects, options.points, runs)
    rows, total, rivals, noises = [], np.zeros(4), np.zeros((len(steps), 4)), 0
    for i, (item, pick) in enumerate(zip(objects, picks)):
        if not len(pick):
            continue
        faces, areas = measure_areas(item)
        share = areas[pick] * (faces.sum() / areas[pick].sum())
        halves = [lights[r][0][i] for r in runs[:2]]
        sums = sum_up(item["light"][pick], halves, share)
        total += sums
        rivals += [sum_up(lights[r][0][i], halves, share) for r in runs[2:]]
        rms, ratio = find_errors(sums)
        noise = (share[:, None] * (halves[0] - halves[1]) ** 2).sum() / 12  # of the mean of both, over three channels
        noises += noise
        rows.append({"scene": name, "object": item["name"], "rms": rms, "ratio": ratio, "vertices": len(item["positions"]),
                     "points": len(pick), "noise": (noise * sums[0]) ** .5 / sums[2]})
    rms, ratio = find_errors(total)
    vertices, count = sum(r["vertices"] for r in rows), sum(r["points"] for r in rows)
    errors = {k: find_errors(r)[0] for k, r in zip(steps, rivals)}
    errors[n] = (2 * noises * total[0]) ** .5 / total[2]
    equal = find_crossing(errors, rms)
    first = lights[runs[2]][1]  # CPU seconds are linear in the samples of all points
    each = ((lights[runs[0]][1] + lights[runs[1]][1]) / 2 - first) / (n - steps[0]) / count
    rival_seconds = first + each * (equal * vertices - steps[0] * count)
    estimate = stats["error_estimate"]
    rows.insert(0, {"scene": name, "object": "total", "rms": rms, "ratio": ratio, "vertices": vertices, "points": count,
                    "noise": "", "estimate": estimate, "seconds": seconds, "cycles_samples": equal,
                    "cycles_seconds": rival_seconds})
    print(f"{name}: ratio {ratio:.4f}, rms {100 * rms:.2f} % (estimate {100 * estimate:.2f} %), {vertices} vertices; CPU "
          f"{seconds:.1f} s, Cycles {rival_seconds:.1f} s with {equal:.0f} samples: {rival_seconds / seconds:.1f} times")
    print("    Cycles:", ", ".join(f"{100 * e:.2f} % with {k}" for k, e in errors.items()))
    for row in sorted(rows[1:], key=lambda r: -r["rms"]):
        print(f"    {row['object']:16} ratio {row['ratio']:.4f}  rms {100 * row['rms']:.2f} %  (noise of Cycles "
              f"{100 * row['noise']:.2f} %, {row['points']} points)", flush=True)
    if options.picture:
        draw(tool, out, name, file, objects, options.picture)
    return rows


def measure_units(tool, out):
    """Irradiances below lamps in Cycles, in Facetree and in closed form; a radiance of 10 where the lamp has an area."""
    with open(f"{out}/lamp.mtl", "w", encoding="ascii") as file:
        file.write("newmtl grey\nKd .5 .5 .5\nnewmtl light\nKd 0 0 0\nKe 10 8 6\n")
    with open(f"{out}/lamp.obj", "w", encoding="ascii") as file:
        file.write("mtllib lamp.mtl\nv -2 0 -2\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -.5 2 -.5\nv .5 2 -.5\nv .5 2 .5\nv -.5 2 .5\n"
                   "o floor\nusemtl grey\nf 1 2 3 4\no lamp\nusemtl light\nf 5 6 7 8\n")
    with open(f"{out}/center.txt", "w", encoding="ascii") as file:
        file.write("0 0 0 0 1 0\n")
    corners = np.array([[0, 0, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0], [-2, -2, 0]], float)
    around = np.array([[0, k + 1, (k + 1) % 4 + 1] for k in range(4)])
    floor = {"positions": corners, "normals": np.tile([0., 0, 1], (5, 1)), "triangles": around, "light": np.ones((5, 3)),
             "emission": [0, 0, 0], "reflectance": [.5, .5, .5], "two_sided": False}
    global INWARD
    INWARD = 1e-4
    write_points(f"{out}/floor.npz", [floor], 5)
    run_blender("units", f"{out}/floor.npz", f"{out}/lamp.obj", f"{out}/lamp.glb", f"{out}/units.json")
    with open(f"{out}/units.json", encoding="ascii") as file:
        found = json.load(file)
    x = .25 / (1 + .25 ** 2) ** .5  # a quarter of a unit square at distance 2, seen from its corner
    square = 4 / np.pi * x * np.arctan(x)
    expected = {"Ke of an OBJ": 10 * square, "emissive of a glTF": 10 * square, "square area light": 10 * square,
                "round area light": 10 * .25 / (.25 + 4), "point light": 100 / (4 * np.pi ** 2 * 4), "sun": 3 / np.pi, "world": 2}
    for name, value in expected.items():
        line = f"{name:20} expected {value:.5f}  Cycles {found[name][0]:.5f}"
        file = {"Ke of an OBJ": "lamp.obj", "emissive of a glTF": "lamp.glb"}.get(name)
        if file:
            stats, _ = run_timed([tool, "bake", f"{out}/{file}", "--probe", f"{out}/center.txt"])
            line += f"  Facetree {stats['probes'][0]['irradiance'][0]:.5f}"
        print(line)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("out")
    parser.add_argument("--scenes", default="room,cornell,open")
    parser.add_argument("--points", type=int, default=1000)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--bake", default="")
    parser.add_argument("--csv")
    parser.add_argument("--picture", type=int, default=0, help="samples of Cycles at each vertex")
    parser.add_argument("--units", action="store_true")
    options = parser.parse_args()
    os.makedirs(options.out, exist_ok=True)
    if options.units:
        measure_units(options.tool, options.out)
        return
    rows = [row for name in options.scenes.split(",") for row in measure_scene(options.tool, options.out, name, options)]
    if options.csv:
        with open(options.csv, "w", newline="", encoding="ascii") as file:
            writer = csv.DictWriter(file, rows[0])
            writer.writeheader()
            writer.writerows(rows)


if __name__ == "__main__":
    main()
