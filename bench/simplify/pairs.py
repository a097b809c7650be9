#!/usr/bin/python3
"""Near bodies that pairs of points join: error over the distance of pairs (Garland 1999, figures 3.4, 6.31 and 6.32).

usage: pairs.py FACETREE OUT [--docs]: prints the tables and draws OUT/simplify-pairs.svg; --docs copies it to docs/pictures and
draws the pictures there."""
import json
import math
import os
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, os.pardir))
from plot import block, plot # noqa: E402


def add_box(mesh, low, high):
    v, f = mesh
    first = len(v) + 1
    v += [tuple((low, high)[i >> k & 1][k] for k in range(3)) for i in range(8)]
    for axis in range(3):
        x, y, z = 1 << axis, 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
        for side in (0, x):
            a, b, c, d = side, side + y, side + y + z, side + z
            if not side:
                b, d = d, b
            f += [(first + a, first + b, first + c), (first + a, first + c, first + d)]


def add_can(mesh, bottom, height, sides, turn=0):
    v, f = mesh
    first = len(v) + 1
    for k in range(2 * sides):
        angle = 2 * math.pi * (k % sides + turn) / sides
        v.append((.5 * math.cos(angle), bottom + height * (k // sides), .5 * math.sin(angle)))
    for i in range(sides):
        a, b = first + i, first + (i + 1) % sides
        f += [(a, a + sides, b + sides), (a, b + sides, b)]
        if 0 < i < sides - 1:
            f += [(first, a, b), (first + sides, b + sides, a + sides)]


def add_bone(mesh, center, radii, around=16, along=6):
    v, f = mesh
    first = len(v) + 1
    for j in range(1, along):
        for i in range(around):
            a, b = 2 * math.pi * i / around, math.pi * j / along
            shape = (-math.cos(b), math.sin(b) * math.cos(a), math.sin(b) * math.sin(a))
            v.append(tuple(c + r * s for c, r, s in zip(center, radii, shape)))
    v += [(center[0] - radii[0], center[1], center[2]), (center[0] + radii[0], center[1], center[2])]
    for i in range(around):
        k = (i + 1) % around
        for j in range(along - 2):
            a, b = first + j * around + i, first + j * around + k
            f += [(a, b, b + around), (a, b + around, a + around)]
        f += [(len(v) - 1, first + k, first + i), (len(v), len(v) - 1 - around + i - 1, len(v) - 1 - around + k - 1)]


def write(path, mesh):
    with open(path, "w") as out:
        out.writelines("v %.9g %.9g %.9g\n" % p for p in mesh[0])
        out.writelines("f %d %d %d\n" % t for t in mesh[1])


def make_scenes(out):
    """name: file of the bodies, file of the surface that one sees, faces, distances."""
    cubes, slab, cans, tall, bones = ([], []), ([], []), ([], []), ([], []), ([], [])
    for i in range(100):
        x, z = 1.05 * (i % 10), 1.05 * (i // 10)
        add_box(cubes, (x, 0, z), (x + 1, 1, z + 1))
    add_box(slab, (0, 0, 0), (10.45, 1, 10.45))
    for i in range(6):
        add_can(cans, 1.004 * i, 1, 24)
    add_can(tall, 0, 6.02, 24)
    for toe in range(5): # of four to six bones with gaps of .04 to .12
        x = -.3 * abs(toe - 1)
        for bone in range(4 + (toe > 0) + (toe == 2)):
            length = (1.2, .9, .5, .4, .35, .3)[bone]
            add_bone(bones, (x + length / 2, .02 * bone * (-1) ** bone, .75 * toe), (length / 2, .24 - .02 * bone, .3 - .025 * bone))
            x += length + .04 + .02 * (bone + toe) % .08
    for name, mesh in (("cubes", cubes), ("slab", slab), ("cans", cans), ("tall", tall), ("bones", bones)):
        write(f"{out}/{name}.obj", mesh)
    return {"cubes": ("cubes", "slab", 100, (0, .04, .05, .06, .1, .5, 1)),
            "cans": ("cans", "tall", 92, (0, .003, .004, .01, .1, .5)),
            "bones": ("bones", None, 150, (0, .02, .05, .08, .1, .12, .15, .2, .3, .4, .5, .6, .8, 1))}


def run(program, *args):
    return json.loads(subprocess.run([program, *args, "--json", "-q"], check=True, capture_output=True, text=True).stdout)


def measure(program, out, scene, faces, distance):
    source, seen = scene
    path = f"{out}/{source}-{faces}-{distance:g}.ply"
    stats = run(program, "simplify", f"{out}/{source}.obj", "--faces", str(faces), "--pairs", str(distance), "-o", path)
    errors = [run(program, "compare", f"{out}/{name}.obj", path)["e_avg"] for name in (source, seen) if name]
    return stats, errors, path


def draw(program, source, target, size):
    view = ["--view", "top"] if "bones" in source else []
    subprocess.run([program, "render", source, "-o", target, "-q", "--wireframe", "--shading", "flat", "--size", size, *view], check=True)


def main():
    program, out = sys.argv[1:3]
    os.makedirs(out, exist_ok=True)
    for name, (source, seen, faces, distances) in make_scenes(out).items():
        print(f"{name}: to {faces} faces\n{'distance':>9} {'pairs':>6} {'joined':>6} {'faces':>6} {'E_avg':>9} {'of the outside':>15}")
        points = []
        for distance in distances:
            stats, errors, _ = measure(program, out, (source, seen), faces, distance)
            print(f"{distance:9g} {stats['pairs_found']:6} {stats['pairs_joined']:6} {stats['faces_after']:6} {errors[0]:9.2e}" +
                  (f" {errors[1]:15.2e}" if seen else ""))
            points.append((distance, errors[0]))
    plot(f"{out}/simplify-pairs", (640, 380),
         ["set border 3", "set tics nomirror", "set grid lc rgb '#dddddd'", "set xlabel 'distance of pairs'", "set yrange [0:*]",
          f"set ylabel 'E_{{avg}} of {faces} faces'", "unset key", block("c", points),
          f"plot $c using 1:2 with linespoints lw 2 pt 7 ps .8 lc rgb '#0072b2'"])
    if "--docs" not in sys.argv:
        return
    pictures = os.path.join(HERE, os.pardir, os.pardir, "docs", "pictures")
    shutil.copy(f"{out}/simplify-pairs.svg", pictures)
    for scene, faces, near, size in (("cubes", 100, .06, "520x300"), ("cans", 92, .01, "220x340"), ("bones", 150, .15, "440x440")):
        draw(program, f"{out}/{scene}.obj", f"{pictures}/pairs-{scene}.png", size)
        for kind, distance in (("edges", 0), ("joined", near)):
            _, _, path = measure(program, out, (scene, None), faces, distance)
            draw(program, path, f"{pictures}/pairs-{scene}-{kind}.png", size)


if __name__ == "__main__":
    main()
