"""Runs inside Blender 3.4. It makes a scene, lights points with Cycles, or measures the units of lamps.
usage: blender -b --factory-startup -P cycles_blender.py -- make OUT.glb
       blender -b --factory-startup -P cycles_blender.py -- bake IN.npz OUT.npz SAMPLES:SEED...
       blender -b --factory-startup -P cycles_blender.py -- units FLOOR.npz LAMP.obj LAMP.glb OUT.json
       blender -b --factory-startup -P cycles_blender.py -- join OUT.png IN.png...

`bake` reads a mesh with a small triangle around each point (`pixels` has the point of a face, or -1). Each of these triangles
fills one pixel of an image, to which Cycles bakes COMBINED: the radiance that leaves the surface at the point. So a point lies
inside of its face, never on an edge, where rays may pass a neighbouring wall on either side."""
import json
import math
import os
import sys

import bpy
import numpy as np

WIDTH = 256  # of the image, in pixels
np.bool = bool  # the glTF importer of Blender 3.4 uses this name, which Debian's NumPy 1.24 lacks


def add_material(name, reflectance, emission, two_sided):
    """A diffuse material; its back is black unless it is two-sided, as in a scene of Facetree."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = nodes.new("ShaderNodeBsdfDiffuse")
    surface.inputs["Color"].default_value = (*reflectance, 1)
    result = surface.outputs[0]
    if max(emission) > 0:
        light, both = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
        light.inputs["Strength"].default_value = max(emission)
        light.inputs["Color"].default_value = (*(x / max(emission) for x in emission), 1)
        links.new(result, both.inputs[0])
        links.new(light.outputs[0], both.inputs[1])
        result = both.outputs[0]
    if not two_sided:
        side, black, choice = (nodes.new("ShaderNode" + x) for x in ("NewGeometry", "BsdfDiffuse", "MixShader"))
        black.inputs["Color"].default_value = (0, 0, 0, 1)
        links.new(side.outputs["Backfacing"], choice.inputs[0])
        links.new(result, choice.inputs[1])
        links.new(black.outputs[0], choice.inputs[2])
        result = choice.outputs[0]
    links.new(result, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def set_cycles(scene):
    """Unbiased light: many bounces, no clamping, no light left out."""
    scene.render.engine = "CYCLES"
    c = scene.cycles
    c.device = "CPU"
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = 128
    c.sample_clamp_direct = c.sample_clamp_indirect = c.light_sampling_threshold = c.blur_glossy = 0
    c.use_adaptive_sampling = c.use_denoising = False
    c.caustics_reflective = c.caustics_refractive = True
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    scene.render.bake.margin = 0


def add_object(data, name="surface"):
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    # Both programs start shadow rays on the curved surface that the normals describe. With 0, Cycles and the paths of
    # Facetree differ by 2.4 instead of 1.9 % on a bust of 6,000 faces.
    item.cycles.shadow_terminator_offset, item.cycles.shadow_terminator_geometry_offset = 0, 1
    return item


def add_mesh(data):
    mesh = bpy.data.meshes.new("surface")
    positions, triangles = data["positions"], data["triangles"]
    count = len(triangles)
    mesh.vertices.add(len(positions))
    mesh.loops.add(3 * count)
    mesh.polygons.add(count)
    mesh.vertices.foreach_set("co", positions.astype("f4").ravel())
    mesh.loops.foreach_set("vertex_index", triangles.astype("i4").ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, "i4"))
    mesh.polygons.foreach_set("loop_total", np.full(count, 3, "i4"))
    mesh.polygons.foreach_set("material_index", data["materials"].astype("i4"))
    mesh.polygons.foreach_set("use_smooth", np.ones(count, bool))
    for i, (reflectance, emission, two_sided) in enumerate(zip(data["reflectance"], data["emission"], data["two_sided"])):
        mesh.materials.append(add_material(f"material {i}", reflectance.tolist(), emission.tolist(), bool(two_sided)))
    # A triangle with a point surrounds the centre of its pixel and no other; all others lie outside of the image. Cycles
    # moves samples by up to half a pixel. This stays inside of the triangle: beyond its edges, .2 % of the samples were black.
    pixels = data["pixels"]
    height = -(-(int(pixels.max()) + 1) // WIDTH)
    uv = np.full((count, 3, 2), -1, "f4")
    lit = pixels >= 0
    corner = np.stack([pixels[lit] % WIDTH, pixels[lit] // WIDTH], 1)[:, None, :]
    uv[lit] = (corner + .5 + np.array([[-.95, -.95], [1.9, -.95], [-.95, 1.9]])) / [WIDTH, height]
    mesh.uv_layers.new(name="pixels").data.foreach_set("uv", uv.ravel())
    mesh.update()
    mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi
    mesh.normals_split_custom_set_from_vertices(data["normals"].astype("f4").tolist())
    return mesh, height


def bake_image(image, samples, seed):
    """Radiances of the pixels, and CPU seconds."""
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.seed = samples, seed
    before = os.times()
    bpy.ops.object.bake(type="COMBINED", margin=0, use_clear=True, target="IMAGE_TEXTURES")
    after = os.times()
    values = np.empty(4 * image.size[0] * image.size[1], "f4")
    image.pixels.foreach_get(values)
    return values.reshape(-1, 4)[:, :3], after.user + after.system - before.user - before.system


def show_pixels(item, height):
    """The image to which the object is baked."""
    image = bpy.data.images.new("light", WIDTH, height, float_buffer=True, is_data=True)
    for slot in item.material_slots:
        node = slot.material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        slot.material.node_tree.nodes.active = node
    bpy.ops.object.select_all(action="DESELECT")
    item.select_set(True)
    bpy.context.view_layer.objects.active = item
    return image


def clear_scene():
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()


def bake_points(source, target, runs):
    clear_scene()
    set_cycles(bpy.context.scene)
    data = np.load(source)
    mesh, height = add_mesh(data)
    image = show_pixels(add_object(mesh), height)
    result = {}
    for run in runs:
        samples, seed = map(int, run.split(":"))
        light, seconds = bake_image(image, samples, seed)
        result[f"light {run}"] = light[:int(data["pixels"].max()) + 1]
        result[f"seconds {run}"] = seconds
    np.savez(target, **result)


def make_room(target):
    """A closed room with a box, a smooth Suzanne and a lamp below the ceiling, as .glb of Blender's own exporter."""
    clear_scene()

    def paint(name, color, strength=0):
        material = bpy.data.materials.new(name)
        material.use_nodes, material.use_backface_culling = True, True
        node = material.node_tree.nodes["Principled BSDF"]
        node.inputs["Base Color"].default_value = (*color, 1)
        node.inputs["Roughness"].default_value, node.inputs["Specular"].default_value = 1, 0
        node.inputs["Emission"].default_value = (1, .9, .75, 1) if strength else (0, 0, 0, 1)
        node.inputs["Emission Strength"].default_value = strength or 1
        bpy.context.object.data.materials.append(material)
        bpy.context.object.name = name

    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1.5), scale=(5, 4, 3))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode="OBJECT")
    paint("room", (.7, .7, .65))
    bpy.ops.mesh.primitive_cube_add(size=1, location=(-1.2, .6, .5), rotation=(0, 0, .4))
    paint("box", (.6, .2, .15))
    bpy.ops.mesh.primitive_monkey_add(size=1.6, location=(.9, -.1, 1.1), rotation=(-.3, 0, .5))
    bpy.ops.object.modifier_add(type="SUBSURF")
    bpy.context.object.modifiers[0].levels = 2
    bpy.ops.object.modifier_apply(modifier=bpy.context.object.modifiers[0].name)
    bpy.ops.object.shade_smooth()
    paint("suzanne", (.3, .45, .7))
    bpy.ops.mesh.primitive_plane_add(size=1, location=(.3, .2, 2.9), rotation=(math.pi, 0, 0), scale=(1, 1, 1))
    paint("lamp", (.5, .5, .5), 12)
    bpy.ops.object.camera_add(location=(0, -1.95, 1.7), rotation=(1.42, 0, 0))
    bpy.context.object.data.angle = 1.75
    bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_cameras=True)


def add_light(kind, energy, **settings):
    data = bpy.data.lights.new("light", kind)
    data.energy = energy
    for key, value in settings.items():
        setattr(data, key, value)
    add_object(data, "light").location = (0, 0, 2)


def measure_units(floor, obj, glb, target):
    """Light of the floor's point per unit of reflectance, under lamps of many kinds 2 above it. Writes LAMP.glb."""
    clear_scene()
    bpy.ops.wm.obj_import(filepath=obj)
    for slot in (s for item in bpy.data.objects for s in item.material_slots):
        node = slot.material.node_tree.nodes["Principled BSDF"]
        node.inputs["Roughness"].default_value, node.inputs["Specular"].default_value = 1, 0
        slot.material.use_backface_culling = True
    bpy.ops.export_scene.gltf(filepath=glb, export_format="GLB")
    set_cycles(bpy.context.scene)
    world = bpy.context.scene.world
    world.use_nodes = True
    sky = world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (1, 1, 1, 1), 0
    data, result = np.load(floor), {}
    cases = {"Ke of an OBJ": lambda: bpy.ops.wm.obj_import(filepath=obj),
             "emissive of a glTF": lambda: bpy.ops.import_scene.gltf(filepath=glb),
             "square area light": lambda: add_light("AREA", 40, shape="SQUARE", size=1),
             "round area light": lambda: add_light("AREA", 10 * math.pi, shape="DISK", size=1),
             "point light": lambda: add_light("POINT", 100, shadow_soft_size=0),
             "sun": lambda: add_light("SUN", 3, angle=0),
             "world": lambda: setattr(sky["Strength"], "default_value", 2)}
    for name, add in cases.items():
        clear_scene()
        add()
        for item in list(bpy.data.objects):
            if item.name.startswith("floor"):
                bpy.data.objects.remove(item)
        mesh, height = add_mesh(data)
        light, _ = bake_image(show_pixels(add_object(mesh), height), 4096, 1)
        result[name] = (light[0] / data["reflectance"][0]).tolist()
        sky["Strength"].default_value = 0
    with open(target, "w", encoding="ascii") as out:
        json.dump(result, out)


def join_images(target, sources):
    """Pictures of one size side by side."""
    parts = []
    for source in sources:
        image = bpy.data.images.load(os.path.abspath(source))
        values = np.empty(4 * image.size[0] * image.size[1], "f4")
        image.pixels.foreach_get(values)
        parts.append(values.reshape(image.size[1], image.size[0], 4))
    row = np.concatenate(parts, 1)
    result = bpy.data.images.new("row", row.shape[1], row.shape[0])
    result.pixels.foreach_set(row.ravel())
    result.file_format, result.filepath_raw = "PNG", os.path.abspath(target)
    result.save()


def main():
    words = sys.argv[sys.argv.index("--") + 1:]
    if words[0] == "make":
        make_room(words[1])
    elif words[0] == "bake":
        bake_points(words[1], words[2], words[3:])
    elif words[0] == "units":
        measure_units(*words[1:])
    elif words[0] == "join":
        join_images(words[1], words[2:])
    else:
        sys.exit(__doc__)


main()
