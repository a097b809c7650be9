#!/usr/bin/env python3
"""Writes the scenes of the radiosity benchmark into folders, with meshes that `facetree make` makes.
usage: scenes.py FACETREE OUT [SCENE...]"""
import json
import math
import os
import random
import subprocess
import sys

PAINT = {
    "white": [.75, .75, .72], "red": [.63, .10, .08], "blue": [.14, .22, .52], "grey": [.5, .5, .5],
    "wood": [.45, .3, .18], "plaster": [.78, .76, .7], "stone": [.55, .52, .47], "ground": [.4, .36, .3]}


class Scene:
    """Objects of shared models under a transform, as scene.json has them."""

    def __init__(self, tool, folder):
        self.tool, self.folder = tool, folder
        self.models, self.instances = {}, []
        self.materials = {name: {"reflectance": value} for name, value in PAINT.items()}
        os.makedirs(folder, exist_ok=True)

    def shape(self, name, triangles=0, inside=False):
        """A mesh of `facetree make`; the name of its model."""
        model = f"{name}{triangles or ''}{'_inside' if inside else ''}"
        if model not in self.models:
            command = [self.tool, "make", name, "-q", "-o", f"{self.folder}/{model}.ply"]
            command += ["--triangles", str(triangles)] if triangles else []
            command += ["--inside"] if inside else []
            subprocess.run(command, check=True)
            self.models[model] = f"{model}.ply"
        return model

    def obj(self, name, boxes):
        """One mesh of several boxes, each (centre, half extents)."""
        with open(f"{self.folder}/{name}.obj", "w", encoding="ascii") as out:
            for i, (center, half) in enumerate(boxes):
                for k in range(8):
                    p = [center[a] + half[a] * (1 if k >> a & 1 else -1) for a in range(3)]
                    out.write("v %.9g %.9g %.9g\n" % tuple(p))
                for face in ((1, 5, 7, 3), (2, 4, 8, 6), (1, 2, 6, 5), (3, 7, 8, 4), (1, 3, 4, 2), (5, 6, 8, 7)):
                    out.write("f " + " ".join(str(v + 8 * i) for v in face) + "\n")
        self.models[name] = f"{name}.obj"
        return name

    def patch(self, name, place, across, along, closed=(False, False)):
        """A smooth surface as across x along rectangles with the exact normal at each vertex. place(u, v) for u and v in
        [0, 1] is a point; the front is where d/du x d/dv points."""
        step = 1e-5
        rows, columns = along + (not closed[1]), across + (not closed[0])
        with open(f"{self.folder}/{name}.obj", "w", encoding="ascii") as out:
            for j in range(rows):
                for i in range(columns):
                    u, v = i / across, j / along
                    a, b = ([q - p for p, q in zip(place(u - du, v - dv), place(u + du, v + dv))]
                            for du, dv in ((step, 0), (0, step)))
                    n = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
                    size = math.hypot(*n)
                    out.write("v %.9g %.9g %.9g\n" % tuple(place(u, v)))
                    out.write("vn %.6f %.6f %.6f\n" % tuple(x / size for x in n))
            for j in range(along):
                for i in range(across):
                    corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
                    out.write("f " + " ".join("%d//%d" % ((k + 1,) * 2) for k in (
                        a % columns + b % rows * columns for a, b in corners)) + "\n")
        self.models[name] = f"{name}.obj"
        return name

    def cube(self):
        return self.obj("cube", [((0, 0, 0), (1, 1, 1))])

    def sheet(self, name, corner, side, up):
        """A rectangle of two triangles; its front is where side x up points."""
        with open(f"{self.folder}/{name}.obj", "w", encoding="ascii") as out:
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                out.write("v %.9g %.9g %.9g\n" % tuple(corner[k] + a * side[k] + b * up[k] for k in range(3)))
            out.write("f 1 2 3 4\n")
        self.models[name] = f"{name}.obj"
        return name

    def add(self, name, model, material, translate=(0, 0, 0), scale=(1, 1, 1), degrees=0):
        item = {"name": name, "model": model, "material": material, "translate": list(translate), "scale": list(scale)}
        if degrees:
            item["rotate"] = {"axis": [0, 1, 0], "degrees": degrees}
        self.instances.append(item)

    def lamp(self, name, emission, place, half):
        """A thin box of light."""
        self.materials.setdefault(f"light{len(self.materials)}", {"reflectance": .5, "emission": emission})
        material = [m for m, v in self.materials.items() if v.get("emission") == emission][0]
        self.add(name, self.cube(), material, place, half)

    def panel(self, name, emission, place, half):
        """A sheet that shines down."""
        x, y, z = place
        self.lamp(name, emission, (0, 0, 0), (1, 1, 1))
        w, d = half
        self.instances[-1]["model"] = self.sheet(name, (x - w, y, z - d), (2 * w, 0, 0), (0, 0, 2 * d))

    def room(self, width, height, depth, walls="plaster", floor="wood"):
        """Floor, ceiling and four walls of one rectangle each; the corner of the room is the origin."""
        w, h, d = width, height, depth
        for name, corner, side, up, paint in (
                ("floor", (0, 0, 0), (0, 0, d), (w, 0, 0), floor), ("ceiling", (0, h, 0), (w, 0, 0), (0, 0, d), walls),
                ("left", (0, 0, 0), (0, h, 0), (0, 0, d), walls), ("right", (w, 0, 0), (0, 0, d), (0, h, 0), walls),
                ("back", (0, 0, 0), (w, 0, 0), (0, h, 0), walls), ("front", (0, 0, d), (0, h, 0), (w, 0, 0), walls)):
            self.add(name, self.sheet(name, corner, side, up), paint)

    def save(self, position, target, angle=60):
        camera = {"position": position, "target": target, "up": [0, 1, 0], "vertical_fov": angle}
        scene = {"materials": self.materials, "models": self.models, "instances": self.instances, "camera": camera}
        with open(f"{self.folder}/scene.json", "w", encoding="ascii") as out:
            json.dump(scene, out, indent=1)


def make_hall(s):
    """Five statues of 6,000 triangles under two lamps."""
    s.room(12, 5, 8)
    for i, name in enumerate(("torso", "knot", "gyroid", "vase", "bust")):
        x, z = 2 + 2 * i, 2.5 + 2.5 * (i % 2)
        s.add(f"plinth {i}", s.cube(), "stone", (x, .4, z), (.45, .4, .45))
        s.add(name, s.shape(name, 6000), ("white", "red", "blue", "grey", "wood")[i], (x, .8, z), (1, 1, 1))
    s.lamp("lamp", [14, 13, 11], (4, 3.8, 4), (.8, .02, .5))
    s.lamp("lamp 2", [14, 13, 11], (9, 3.8, 4), (.5, .02, .8))
    s.save([6, 2.2, 7.8], [6, 1.4, 0])


def make_lamps(s):
    """Forty lamps over twelve crates."""
    s.room(16, 4, 10)
    pick = random.Random(5)
    for i in range(12):
        half = pick.uniform(.3, .7)
        x, z = 2 + 4 * (i % 4) + pick.uniform(-.6, .6), 1.8 + 3.2 * (i // 4) + pick.uniform(-.5, .5)
        s.add(f"crate {i}", s.cube(), ("wood", "red", "blue")[i % 3], (x, half, z), (half,) * 3, pick.uniform(5, 85))
    for i in range(40):
        s.panel(f"lamp {i}", [18, 17, 14], (1 + 2 * (i % 8), 3.96, 1 + 2 * (i // 8)), (.12, .12))
    s.save([15.4, 2.6, 9.6], [5, .6, 3])


def make_courtyard(s):
    """Four walls without a roof under a small far lamp; crates and columns on the ground."""
    s.add("ground", s.sheet("ground", (-10, 0, -10), (0, 0, 20), (20, 0, 0)), "ground")
    for i in range(4):
        angle = math.pi / 2 * i
        c, n = round(math.cos(angle)), round(math.sin(angle))
        s.add(f"wall {i}", s.cube(), "stone", (9.5 * c, 2, 9.5 * n), (.3 if c else 9.8, 2, .3 if n else 9.8))
    for i in range(6):
        s.add(f"column {i}", s.shape("cylinder", 600), "white", (-6 + 2.4 * i, 0, -4), (.6, 3, .6))
    for i in range(5):
        s.add(f"crate {i}", s.cube(), ("wood", "red", "blue")[i % 3], (-5 + 2.3 * i, .5, 2.5), (.5, .5, .5), 17 * i)
    s.lamp("sun", [9e3, 8.6e3, 7.6e3], (60, 90, 35), (1, 1, 1))
    s.save([7.5, 5, 9], [-1, .8, -1])


def make_classroom(s):
    """Twenty desks and chairs of many boxes, with books on the desks."""
    s.room(9, 3.2, 11)
    desk = [((0, .72, 0), (.6, .02, .3)), ((0, .5, -.27), (.55, .12, .01))]
    desk += [((x, .35, z), (.02, .35, .02)) for x in (-.55, .55) for z in (-.25, .25)]
    desk += [((.3, .76, 0), (.1, .02, .14)), ((-.25, .75, .05), (.08, .01, .11))]
    chair = [((0, .44, 0), (.2, .015, .2)), ((0, .8, .19), (.2, .12, .012))]
    chair += [((x, .22, z), (.015, .22, .015)) for x in (-.18, .18) for z in (-.18, .18)]
    chair += [((x, .62, .19), (.015, .2, .012)) for x in (-.18, .18)]
    for i in range(20):
        x, z = 1.4 + 2.05 * (i % 4), 2.2 + 1.75 * (i // 4)
        s.add(f"desk {i}", s.obj("desk", desk), "wood", (x, 0, z), degrees=3 * (i % 5) - 6)
        s.add(f"chair {i}", s.obj("chair", chair), "blue", (x, 0, z + .55), degrees=11 * (i % 7) - 30)
    for i in range(6):
        s.panel(f"lamp {i}", [11, 11, 10.5], (2.5 + 4 * (i % 2), 3.15, 2 + 3.5 * (i // 2)), (.6, .12))
    s.save([8.6, 2.3, 10.6], [3.5, .6, 3.5])


def add_boxes(s, name, boxes, material, whole):
    """Boxes as one object each, or as one mesh."""
    if whole:
        s.add(name, s.obj(name, boxes), material)
    else:
        for i, (center, half) in enumerate(boxes):
            s.add(f"{name} {i}", s.cube(), material, center, half)


def make_school(s, whole=False):
    """A classroom of 840 boxes (10,080 triangles): thirty desks and chairs of their parts, books, and shelves."""
    s.room(11, 3.2, 13)
    pick, woods, chairs, books = random.Random(3), [], [], []
    for i in range(30):
        x, z = 1.4 + 1.9 * (i % 5), 2.2 + 1.75 * (i // 5)
        woods += [((x, .72, z), (.6, .02, .3)), ((x, .5, z - .27), (.55, .12, .01))]
        woods += [((x + a, .35, z + b), (.02, .35, .02)) for a in (-.55, .55) for b in (-.25, .25)]
        books += [((x + .22 * k - .45, .755, z + pick.uniform(-.12, .12)), (.08, .015, .11)) for k in range(5)]
        chairs += [((x, .44, z + .55), (.2, .015, .2)), ((x, .8, z + .74), (.2, .12, .012))]
        chairs += [((x + a, .22, z + .55 + b), (.015, .22, .015)) for a in (-.18, .18) for b in (-.18, .18)]
        chairs += [((x + a, .62, z + .74), (.015, .2, .012)) for a in (-.18, .18)]
    for row in range(4):
        woods.append(((10.8, .4 + .5 * row, 6), (.18, .015, 3)))
        books += [((10.8, .54 + .5 * row, 3.2 + .11 * k), (.1, pick.uniform(.09, .12), .04)) for k in range(65)]
    while len(woods) + len(chairs) + len(books) < 840:
        books.append(((pick.uniform(1, 10), .03, pick.uniform(1, 12)), (.08, .015, .11)))
    for name, boxes, material in (("desk", woods, "wood"), ("chair", chairs, "blue"), ("book", books, "red")):
        add_boxes(s, name, boxes, material, whole)
    for i in range(6):
        s.panel(f"lamp {i}", [11, 11, 10.5], (3 + 5 * (i % 2), 3.15, 2 + 4.2 * (i // 2)), (.6, .12))
    s.save([10.6, 2.3, 12.6], [3.5, .6, 3.5])


def make_boxes(s):
    """10,000 boxes of many sizes on the floor of a hall."""
    s.room(40, 8, 40)
    pick = random.Random(7)
    for i in range(10000):
        half = [pick.uniform(.04, .15) for _ in range(3)]
        place = (.4 + .395 * (i % 100), half[1], .4 + .395 * (i // 100))
        s.add(f"box {i}", s.cube(), ("wood", "red", "blue", "white")[pick.randrange(4)], place, half, pick.uniform(0, 90))
    for i in range(9):
        s.panel(f"lamp {i}", [16, 15, 13], (7 + 13 * (i % 3), 7.9, 7 + 13 * (i // 3)), (1.5, 1.5))
    s.save([38, 6, 38], [15, 0, 15])


def make_library(s):
    """50,000 books on sixty shelves."""
    s.room(42, 5, 30, floor="stone")
    pick = random.Random(9)
    for shelf in range(60):
        x, z = 3.5 + 4 * (shelf % 10), 3 + 4.8 * (shelf // 10)
        for board in range(8):
            s.add(f"board {shelf} {board}", s.cube(), "wood", (x, .1 + .38 * board, z), (1.7, .012, .3))
        for i in range(833 + (shelf < 20)):
            board, at, side = i % 7, i // 14, i // 7 % 2
            half = (.024, pick.uniform(.1, .16), .11)
            place = (x - 1.6 + .054 * at, .112 + .38 * board + half[1], z + (.14 if side else -.14))
            s.add(f"book {shelf} {i}", s.cube(), ("red", "blue", "white", "grey")[pick.randrange(4)], place, half)
    for i in range(20):
        s.panel(f"lamp {i}", [14, 13.5, 12], (4.2 + 8.4 * (i % 5), 4.95, 4 + 7.3 * (i // 5)), (1.2, .2))
    s.save([41, 3.5, 29], [15, 1, 10])


def make_smooth(s):
    """Round bodies of few triangles with normals: a ball, a ring, a vase and a wave."""
    turn = 2 * math.pi

    def ball(u, v):
        low, a = .02 + .96 * v, turn * u
        return [math.sin(math.pi * low) * math.sin(a), -math.cos(math.pi * low), math.sin(math.pi * low) * math.cos(a)]

    def ring(u, v):
        r = 1 + .4 * math.cos(turn * v)
        return [r * math.sin(turn * u), .4 * math.sin(turn * v), r * math.cos(turn * u)]

    def vase(u, v):
        r = .35 + .15 * math.sin(turn * v)
        return [r * math.sin(turn * u), 1.2 * v, r * math.cos(turn * u)]

    def wave(u, v):
        return [3 * u, .3 + .25 * math.sin(2 * turn * u), -1.2 * v]

    s.room(8, 4, 6)
    s.add("ball", s.patch("ball", ball, 12, 8, (True, False)), "white", (2, 1.2, 2), (.8,) * 3)
    s.add("ring", s.patch("ring", ring, 14, 8, (True, True)), "red", (4.6, .5, 2.2))
    s.add("vase", s.patch("vase", vase, 9, 10, (True, False)), "blue", (6.8, .05, 3), (1.2,) * 3)
    s.add("wave", s.patch("wave", wave, 12, 1), "white", (2, .1, 5.2))
    s.panel("lamp", [13, 12, 10], (4, 3.95, 3), (.7, .5))
    s.lamp("small lamp", [120, 110, 90], (.6, 1.6, 4.6), (.08, .08, .08))
    s.save([4, 2.2, 5.8], [4, .7, 1], 70)


MAKERS = {"hall": make_hall, "lamps": make_lamps, "courtyard": make_courtyard, "classroom": make_classroom,
          "smooth": make_smooth}
DENSE = {  # scenes of many small parts, which are made on request
    "school": make_school, "school-mesh": lambda s: make_school(s, True), "boxes": make_boxes, "library": make_library}
MADE = {"museum": 30000, "cornell": 1000}  # by the program alone: triangles


def make_scene(tool, out, name):
    """The folder of a scene, made if it is not there."""
    folder = os.path.join(out, name)
    os.makedirs(out, exist_ok=True)
    if not os.path.exists(f"{folder}/scene.json"):
        if name in MADE:
            subprocess.run([tool, "make", name, "-q", "-o", folder, "--triangles", str(MADE[name])], check=True)
        else:
            scene = Scene(tool, folder)
            {**MAKERS, **DENSE}[name](scene)
    return folder


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    for scene_name in sys.argv[3:] or [*MADE, *MAKERS]:
        print(make_scene(sys.argv[1], sys.argv[2], scene_name))
