#!/usr/bin/env python3
"""Runs the program on other people's kinds of files: run.py PROGRAM FIELD [CASE...]

FIELD has a folder per case with a small input. The table below says what each must give. Exit code 77 if FIELD is absent."""
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

PROGRAM, FIELD = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])


class Run:
    def __init__(self, folder, *words, limit=120):
        done = subprocess.run([PROGRAM, *words], cwd=folder, capture_output=True, timeout=limit)
        self.code, self.errors = done.returncode, done.stderr.decode(errors="replace")
        try:
            self.json = json.loads(done.stdout)
        except ValueError:
            self.json = {}

    def __getattr__(self, name):
        return self.json.get(name)


def near(a, b, tolerance=1e-5):
    return a is not None and abs(a - b) <= tolerance * abs(b)


def info(folder, file):
    return Run(folder, "info", "--json", file)


def mesh(faces, area=None, warns=False, **facts):
    """info gives these figures; warns: and a message."""
    def check(folder, file):
        r = info(folder, file)
        assert r.code == 0, r.errors
        assert r.faces == faces, "faces %s" % r.faces
        assert area is None or near(r.area, area), "area %s" % r.area
        for name, value in facts.items():
            assert r.json.get(name) == value, "%s %s" % (name, r.json.get(name))
        assert bool(r.errors.strip()) or not warns, "no message"
        assert len(r.errors.strip().split("\n")) <= 2, r.errors
    return check


def cube(warns=False, side=1, **facts):
    return mesh(12, 6 * side * side, warns, vertices=8, boundary_edges=0, components=1, **facts)


def error(*words):
    """A clear error that contains the words."""
    def check(folder, file):
        r = info(folder, file)
        assert r.code in (64, 65, 66), "code %d %s" % (r.code, r.errors)
        for word in words:
            assert word in r.errors, r.errors
    return check


def scene(warns=None, **facts):
    def check(folder, file):
        r = info(folder, file)
        assert r.code == 0, r.errors
        for name, value in facts.items():
            assert r.json.get(name) == value, "%s %s" % (name, r.json.get(name))
        assert not warns or warns in r.errors, r.errors
    return check


def bake(emitted=None, warns=None, code=0):
    def check(folder, file):
        r = Run(folder, "bake", file, "-o", "out.ply", "--json", "--final", "none")
        assert r.code == code, "code %d %s" % (r.code, r.errors)
        assert emitted is None or near(r.power["emitted"], emitted, 1e-3), r.power
        for word in warns or []:
            assert word in r.errors, r.errors
    return check


def command(*words, code=0, warns=None):
    def check(folder, file):
        r = Run(folder, *[file if w == "FILE" else w for w in words])
        assert r.code == code, "code %d %s" % (r.code, r.errors)
        assert not warns or warns in r.errors, r.errors
    return check


def both(*checks):
    def check(folder, file):
        for one in checks:
            one(folder, file)
    return check


def colors(expected):
    """The colours of the vertices after a copy through PLY text, in sRGB bytes, are a superset of these."""
    def check(folder, file):
        r = Run(folder, "simplify", file, "--ratio", "1", "--refit", "0", "-o", "copy.off", "--quiet")
        assert r.code == 0, r.errors
        with open(os.path.join(folder, "copy.off")) as text:
            rows = [tuple(float(x) for x in line.split()[3:6]) for line in text if len(line.split()) >= 6]
        for color in expected:
            assert any(all(abs(a - b) <= 1.5 / 255 * max(1, max(color)) for a, b in zip(row, color)) for row in rows), rows[:8]
    return check


def unwelded(folder, file):
    figures = []
    for name in ("welded.ply", "soup.stl", "soup.ply", "soup.obj"):
        part = Run(folder, "partition", name, "-k", "40", "-o", "labels.txt", "--json")
        charts = Run(folder, "partition", name, "--charts", "45", "-o", "labels.txt", "--json")
        pieces = Run(folder, "meshlets", name, "-o", "meshlets.bin", "--json")
        assert part.code == charts.code == pieces.code == 0, part.errors + charts.errors + pieces.errors
        assert part.connected, name
        figures.append((part.clusters, charts.charts, pieces.meshlets))
    assert figures[:3] == figures[:1] * 3, figures
    # the OBJ has rounded coordinates
    assert all(abs(a - b) <= 4 for a, b in zip(figures[3], figures[0])), figures


def cad(folder, file):
    for name in sorted(n for n in os.listdir(folder) if n.endswith(".obj")):
        before = info(folder, name)
        for options in ([], ["--keep-topology"], ["--refit", "0"]):
            for ratio in (".25", ".5"):
                r = Run(folder, "simplify", name, "--ratio", ratio, "-o", "out.ply", "--quiet", *options)
                assert r.code == 0, name + r.errors
                after = info(folder, "out.ply")
                for key in ("degenerate_faces", "duplicate_faces", "nonmanifold_edges", "boundary_edges"):
                    assert after.json[key] <= before.json[key], "%s %s %s: %s %d" % (name, ratio, options, key, after.json[key])


def seams(folder, file):
    for name in sorted(os.listdir(folder)):
        if name == "expect":
            continue
        before = info(folder, name)
        for ratio in (".1", ".02"):
            out = "out" + os.path.splitext(name)[1]
            r = Run(folder, "simplify", name, "--ratio", ratio, "-o", out, "--quiet")
            assert r.code == 0, r.errors
            Run(folder, "simplify", out, "--ratio", "1", "--refit", "0", "--attributes", "none", "-o", "plain.stl", "--quiet")
            if before.code == 0 and info_as_stl(folder, name) == 0:
                assert info(folder, "plain.stl").boundary_edges == 0, "%s %s" % (name, ratio)


def info_as_stl(folder, name):
    Run(folder, "simplify", name, "--ratio", "1", "--refit", "0", "--attributes", "none", "-o", "before.stl", "--quiet")
    return info(folder, "before.stl").boundary_edges


def bounds(folder, file):
    r = info(folder, "scene.json")
    c, s = math.cos(math.radians(70)), math.sin(math.radians(70))
    points = []
    with open(os.path.join(folder, "m.obj")) as text:
        for line in text:
            if line.startswith("v "):
                x, y, z = (float(w) for w in line.split()[1:4])
                points.append((c * x - s * y, s * x + c * y, z))
    for k in range(3):
        assert near(r.bounds["lower"][k], min(p[k] for p in points), 1e-5), r.bounds
        assert near(r.bounds["upper"][k], max(p[k] for p in points), 1e-5), r.bounds


def lit(emitted, *points):
    """A bake whose probes have these irradiances, by both methods."""
    def check(folder, file):
        for method in ("face", "reference"):
            r = Run(folder, "bake", "scene.json", "--probe", "probes.txt", "--method", method, "--samples", "20000",
                    "--max-edge", "3", "-o", "out.ply", "--json")
            assert r.code == 0, r.errors
            for probe, expected in zip(r.probes, points):
                assert near(probe["irradiance"][0], expected, .004), "%s %s" % (method, probe)
            assert near(r.power["emitted"], emitted, 1e-3), r.power
    return check


CASES = {
    "cluster-unwelded": unwelded,
    "glb-base": cube(), "glb-draco-required": error("KHR_draco_mesh_compression"),
    "glb-dup-node-names": bake(36), "glb-emissive-texture": bake(None, ["texture"]),
    "glb-external-buffer": cube(), "glb-fan-no-indices": mesh(2), "glb-gpu-instancing-required": error("EXT_mesh_gpu_instancing"),
    "glb-indices-not-times-3": mesh(11, warns=True), "glb-interleaved": cube(), "glb-no-scenes": cube(),
    "glb-punctual-light-only": bake(None, ["light"], 65), "glb-quantised": cube(side=2), "glb-sparse": mesh(12, vertices=8),
    "glb-strip-u8": mesh(2), "glb-trailing-bytes": cube(True), "gltf-as-mesh":
        both(command("cluster", "FILE", "-o", "m.fct"), command("simplify", "FILE", "--faces", "6", "-o", "s.ply")),
    "gltf-bin-blank-name": scene(faces=12), "gltf-embedded": scene(faces=12), "gltf-missing-bin": error("gone.bin"),
    "gltf-version-1": error("1.0"),
    "obj-bom": cube(), "obj-comma-decimal": error("0,5"), "obj-concave-star": mesh(8, 1.17557050458),
    "obj-colour-255": mesh(12, vertex_colors=True),
    "obj-cr-only": cube(), "obj-crlf-tabs-continuation": cube(), "obj-empty-usemtl": cube(),
    "obj-face-of-1200-corners": mesh(1198, 3.14157828628), "obj-fo": mesh(12), "obj-huge-exponent": mesh(1, .5),
    "obj-index-beyond-then-defined": cube(), "obj-nan-normals": cube(True),
    "obj-negative-interleaved": mesh(12, 6, vertices=24), "obj-normal-index-without-vn": cube(True),
    "obj-plus-and-dots": mesh(1, .5), "obj-repeated-long-face": mesh(1198), "obj-trailing-slash": cube(),
    "obj-two-corner-face": cube(True), "obj-utf16": error(), "obj-zero-normal-index": cube(True),
    "off-blank-comment-lines": cube(), "off-counts-on-head-line": cube(), "off-glued-counts": mesh(12, vertices=8),
    "off-no-keyword": cube(), "off-two-corner-face": mesh(12, warns=True), "off-vertex-colours-without-C": cube(vertex_colors=True),
    "ply-binary-cr-head": cube(), "ply-binary-crlf-head": cube(), "ply-colour-diffuse-alpha": mesh(12, vertex_colors=True),
    "ply-colour-float-255": mesh(12, vertex_colors=True), "ply-crlf-ascii": cube(), "ply-double-utm": mesh(12, .0024),
    "ply-extra-elements": cube(), "ply-face-first": cube(), "ply-face-index-as-float": error("4.0"),
    "ply-format-space-head": cube(), "ply-header-rows-longer": error(), "ply-index-uint64": error("uint64"),
    "ply-list-count-float": error(), "ply-list-count-int-big-double": cube(), "ply-list-count-ushort": cube(),
    "ply-point-cloud-cluster": command("cluster", "FILE", "-o", "m.fct", code=65, warns="face"),
    "ply-point-cloud-no-face-element": mesh(0, vertices=8), "ply-row-over-lines": cube(), "ply-tabs-trailing-blanks": cube(),
    "ply-truncated-last-faces": error("face"), "ply-two-corner-face": cube(True), "ply-unreferenced-nan-vertex": error("nan"),
    "ply-vertex-nan-normals": cube(True), "ply-zero-corner-face": cube(True),
    "render-obj-kd-one": command("render", "FILE", "-o", "o.png", "--size", "64x64", "--quiet"),
    "scene-bounds": bounds,
    "scene-obj-backslash-path": bake(120), "scene-obj-base": bake(120), "scene-obj-dot-slash-path": bake(120),
    "scene-obj-dup-newmtl": bake(120), "scene-obj-face-before-usemtl": bake(None, ["material"]), "scene-obj-group-comment": bake(120),
    "scene-obj-kd-one": bake(120, [""]), "scene-obj-kd-spectral": bake(120, ["spectral"]), "scene-obj-lib-with-blank": bake(120),
    "scene-obj-missing-lib-plain-use": both(command("render", "FILE", "-o", "o.png", "--size", "64x64", "--quiet"),
                                            command("cluster", "FILE", "-o", "o.fct")),
    "scene-obj-missing-lib": bake(None, ["light"], 65), "scene-obj-two-libs-one-line": bake(120),
    "scene-obj-usemtl-undefined": bake(120, ["material"]),
    "simplify-cad": cad, "simplify-seams": seams,
    "stl-ascii-comma": error(), "stl-ascii-crlf-tabs": cube(), "stl-ascii-empty": mesh(0), "stl-ascii-end-solid": cube(),
    "stl-ascii-four-vertices": error(), "stl-ascii-long-head": cube(), "stl-ascii-no-endsolid": cube(),
    "stl-ascii-two-solids": mesh(24, components=2), "stl-ascii-upper-endsolid": cube(), "stl-ascii-upper": cube(),
    "stl-binary-colour-attribute": cube(), "stl-binary-count-minus-one": mesh(12, warns=True),
    "stl-binary-count-zero": mesh(12, warns=True), "stl-binary-solid": cube(), "stl-binary-trailing": cube(True),
    "bake/lamp-in-ceiling-plane": lit(120, 1.2332), "bake/lamp-in-ceiling-plane-first": lit(120, 1.2332),
    "bake/lamp-touching-wall": command("bake", "scene.json", "-o", "out.ply", "--final", "none"),
    "bake/no-lamp": command("bake", "scene.json", "-o", "out.ply", code=65, warns="light"),
    "bake/units-1-500000": command("bake", "scene.json", "-o", "out.ply", "--final", "none"),
}


def main():
    if not os.path.isdir(FIELD):
        sys.exit(77)
    failed = 0
    names = sys.argv[3:] or [c for c in CASES if os.path.isdir(os.path.join(FIELD, c))]
    for name in names:
        with tempfile.TemporaryDirectory() as scratch:
            folder = os.path.join(scratch, "case")
            shutil.copytree(os.path.join(FIELD, name), folder)
            files = sorted(f for f in os.listdir(folder) if f.startswith(("m.", "s.")) and f.split(".")[-1] in
                           ("obj", "off", "ply", "stl", "glb", "gltf"))
            try:
                CASES[name](folder, files[0] if files else "")
            except (AssertionError, subprocess.TimeoutExpired, KeyError, TypeError) as problem:
                failed += 1
                print("FAILED %s: %s" % (name, " ".join(str(problem).split())[:300]))
    print("%d cases, %d failed" % (len(names), failed))
    sys.exit(1 if failed else 0)


main()
