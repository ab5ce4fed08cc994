"""The path-traced reference beside Cycles, Blender's path tracer: mean radiance over the object.

    blender -b --factory-startup --python-exit-code 1 --python scripts/peer_cycles.py -- \
        build/diaphan OUT.json [--mesh closed.obj ...] [--only TEXT] [--spp N] [--seeds K] \
        [--bounces N]

On Debian 12: apt-get install --no-install-recommends blender python3-numpy.

Both draw the same triangles, medium, light and camera. Every case is drawn K times with K seeds by
both; the mean over the object is the sum over the picture by the sum of the coverage, and its
standard error comes from the spread over the seeds. A line is printed for each, all figures go to
OUT.json; cases that are there already are kept, so that a long run can be continued.

Cases: a matched boundary under a sun that is a point; a dielectric one under surroundings, a cap of
40 degrees half-angle around the light's direction, and (with --only disc) under the disc of 5
degrees that stands for a point there, which paths seldom meet: it needs a hundred times the
samples.

What must be said to Cycles (3.4): a closed mesh with a volume and no surface lets light pass
straight; the colour of a scatter node times its density is the scattering coefficient, and one
minus the colour of an absorption node times its density the absorption coefficient; all bounces at
their limit of 1024, no clamping, no light threshold, a box filter of one pixel, no denoising."""
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import time
import zlib

import bpy
import numpy
from mathutils import Matrix

MEDIA = {  # scattering, absorption in 1/mm
    "thin": ((.05, .08, .12), (.10, .10, .08)),
    "dense": ((1.35, 1.8, 2.7), (.15, .2, .3)),
    "wax": ((1.6, 1.5, 1.3), (.0012, .0035, .016)),
}
LIGHTS = {"front": (30, 20), "side": (90, 20), "back": (180, 20)}
CAP, SKY = 40, (128, 64)  # half-angle in degrees; width and height of the surroundings
CAMERA = (0, 15, 3.5)
FOV, SIZE_MM, PIXELS = 35, 20, 48


def direction(azimuth, elevation):
    a, e = math.radians(azimuth), math.radians(elevation)
    return numpy.array([math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)])


def sphere():
    """A unit sphere of 1280 triangles: an icosahedron, halved three times."""
    p = (1 + math.sqrt(5)) / 2
    v = [(-1, p, 0), (1, p, 0), (-1, -p, 0), (1, -p, 0), (0, -1, p), (0, 1, p), (0, -1, -p),
         (0, 1, -p), (p, 0, -1), (p, 0, 1), (-p, 0, -1), (-p, 0, 1)]
    v = [numpy.array(x) / math.hypot(1, p) for x in v]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
         (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
         (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(3):
        middle, finer = {}, []
        for a, b, c in f:
            m = []
            for x, y in ((a, b), (b, c), (c, a)):
                key = (min(x, y), max(x, y))
                if key not in middle:
                    w = v[x] + v[y]
                    middle[key] = len(v)
                    v.append(w / numpy.linalg.norm(w))
                m.append(middle[key])
            finer += [(a, m[0], m[2]), (b, m[1], m[0]), (c, m[2], m[1]), tuple(m)]
        f = finer
    return numpy.array(v), f


def read_obj(path):
    v, f = [], []
    for line in open(path):
        word = line.split()
        if word[:1] == ["v"]:
            v.append([float(x) for x in word[1:4]])
        elif word[:1] == ["f"]:
            i = [int(x.split("/")[0]) - 1 for x in word[1:]]
            f += [(i[0], i[k], i[k + 1]) for k in range(1, len(i) - 1)]
    return numpy.array(v), f


def write_obj(path, vertices, faces):
    with open(path, "w") as out:
        out.writelines("v %.9g %.9g %.9g\n" % tuple(x) for x in vertices)
        out.writelines("f %d %d %d\n" % tuple(i + 1 for i in x) for x in faces)


def sky(light):
    """Surroundings in latitude and longitude: 1 within the cap around a light, 0 elsewhere."""
    width, height = SKY
    x, y = numpy.meshgrid(numpy.arange(width) + .5, numpy.arange(height) + .5)
    azimuth, elevation = 180 - 360 * x / width, 90 - 180 * y / height
    a, e = numpy.radians(azimuth), numpy.radians(elevation)
    to = numpy.stack([numpy.cos(e) * numpy.sin(a), numpy.sin(e), numpy.cos(e) * numpy.cos(a)], -1)
    return (to @ direction(*LIGHTS[light]) > math.cos(math.radians(CAP))).astype(float)


def write_sky(path, light):
    """Radiance: 1 is the mantissa 128 with the exponent 129."""
    with open(path, "wb") as out:
        out.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % SKY[::-1])
        for value in sky(light).ravel():
            out.write(bytes([128, 128, 128, 129]) if value else bytes(4))


def surround(world, light):
    """The same for Cycles, whose longitudes turn about z: its (x, y, z) are our (z, x, y)."""
    image = bpy.data.images.new("sky", SKY[0], SKY[1], float_buffer=True)
    image.colorspace_settings.name = "Linear"
    rgba = numpy.ones(SKY[::-1] + (4,))
    rgba[:, :, :3] = sky(light)[::-1, :, None]  # rows from the bottom
    image.pixels = rgba.ravel().tolist()
    image.pack()
    world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    where = tree.nodes.new("ShaderNodeTexCoord")
    apart = tree.nodes.new("ShaderNodeSeparateXYZ")
    together = tree.nodes.new("ShaderNodeCombineXYZ")
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image, texture.interpolation = image, "Closest"
    shine, out = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(where.outputs["Generated"], apart.inputs[0])
    for ours, theirs in (("Z", "X"), ("X", "Y"), ("Y", "Z")):
        tree.links.new(apart.outputs[ours], together.inputs[theirs])
    tree.links.new(together.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], shine.inputs["Color"])
    tree.links.new(shine.outputs[0], out.inputs["Surface"])
    world.cycles_visibility.camera = False


def frame(back):
    """A matrix whose z axis is `back` and whose y axis leans to the world's."""
    right = numpy.cross([0, 1, 0], back)
    right /= numpy.linalg.norm(right)
    up = numpy.cross(back, right)
    return numpy.array([right, up, back]).T


def place(thing, back, at=(0, 0, 0)):
    m = numpy.eye(4)
    m[:3, :3] = frame(back)
    m[:3, 3] = at
    thing.matrix_world = Matrix(m.tolist())


def set_scene(vertices, faces, case, spp):
    """The case as Cycles sees it, in mm."""
    for block in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.lights,
                  bpy.data.cameras, bpy.data.worlds, bpy.data.images):
        for x in list(block):
            if x.name != "Render Result":
                block.remove(x)
    scene = bpy.context.scene
    low, high = vertices.min(0), vertices.max(0)
    scale = SIZE_MM / (high - low).max()
    mesh = bpy.data.meshes.new("body")
    mesh.from_pydata(((vertices - (low + high) / 2) * scale).tolist(), [], [list(x) for x in faces])
    body = bpy.data.objects.new("body", mesh)
    scene.collection.objects.link(body)

    scattering, absorption = MEDIA[case["medium"]]
    material = bpy.data.materials.new("medium")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    add = tree.nodes.new("ShaderNodeAddShader")
    scatter = tree.nodes.new("ShaderNodeVolumeScatter")
    absorb = tree.nodes.new("ShaderNodeVolumeAbsorption")
    scatter.inputs["Density"].default_value = max(scattering)
    scatter.inputs["Color"].default_value = [x / max(scattering) for x in scattering] + [1]
    scatter.inputs["Anisotropy"].default_value = case["g"]
    absorb.inputs["Density"].default_value = max(absorption)
    absorb.inputs["Color"].default_value = [1 - x / max(absorption) for x in absorption] + [1]
    tree.links.new(scatter.outputs[0], add.inputs[0])
    tree.links.new(absorb.outputs[0], add.inputs[1])
    tree.links.new(add.outputs[0], out.inputs["Volume"])
    if case["boundary"] == "dielectric":
        glass = tree.nodes.new("ShaderNodeBsdfGlass")
        glass.distribution = "SHARP"
        glass.inputs["Roughness"].default_value = 0
        glass.inputs["IOR"].default_value = 1.3
        glass.inputs["Color"].default_value = (1, 1, 1, 1)
        tree.links.new(glass.outputs[0], out.inputs["Surface"])
    mesh.materials.append(material)

    world = bpy.data.worlds.new("world")
    world.use_nodes = False
    world.color = (0, 0, 0)
    scene.world = world
    if case["source"] == "cap":
        surround(world, case["light"])
    else:
        lamp = bpy.data.lights.new("sun", "SUN")
        lamp.energy = math.pi
        lamp.angle = 2 * math.radians(5) if case["source"] == "disc" else 0
        lamp.cycles.max_bounces = 1024
        lamp.cycles.use_multiple_importance_sampling = True
        sun = bpy.data.objects.new("sun", lamp)
        scene.collection.objects.link(sun)
        place(sun, direction(*LIGHTS[case["light"]]))

    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit = "VERTICAL"
    lens.angle = math.radians(FOV)
    radius = numpy.linalg.norm(high - low) / 2 * scale
    lens.clip_start, lens.clip_end = 1e-3 * radius, 100 * radius
    camera = bpy.data.objects.new("camera", lens)
    scene.collection.objects.link(camera)
    back = direction(*CAMERA[:2])
    place(camera, back, back * CAMERA[2] * radius)
    scene.camera = camera

    r = scene.render
    r.engine = "CYCLES"
    r.resolution_x = r.resolution_y = PIXELS
    r.resolution_percentage = 100
    r.threads_mode = "FIXED"
    r.threads = len(os.sched_getaffinity(0))
    r.image_settings.file_format = "OPEN_EXR"
    r.image_settings.color_depth = "32"
    r.image_settings.exr_codec = "ZIP"
    r.use_persistent_data = True
    c = scene.cycles
    c.device = "CPU"
    c.samples, c.use_adaptive_sampling, c.use_denoising = spp, False, False
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = 1024
    c.transparent_max_bounces = 1024
    c.volume_bounces = case["bounces"]
    c.sample_clamp_direct = c.sample_clamp_indirect = 0
    c.light_sampling_threshold = 0
    c.blur_glossy = 0
    c.caustics_reflective = c.caustics_refractive = True
    c.pixel_filter_type = "BOX"
    c.filter_width = 1
    return scene


def read_exr(path):
    """{name: (height x width)} of a file of scan lines, ZIP, 32-bit floats. Blender's own loader
    gives Python nothing of a picture with layers, and the reference has one, its variance."""
    data = open(path, "rb").read()
    at, header = 8, {}
    while data[at]:
        name, kind, rest = data[at:at + 512].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size = struct.unpack_from("<i", data, at)[0]
        header[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    assert header[b"compression"] == b"\3", "not ZIP"
    x0, y0, x1, y1 = struct.unpack("<4i", header[b"dataWindow"])
    width, height, names, rest = x1 - x0 + 1, y1 - y0 + 1, [], header[b"channels"]
    while rest[0]:
        name, rest = rest.split(b"\0", 1)
        assert rest[0] == 2, "not 32-bit float"
        names.append(name.decode())
        rest = rest[16:]
    chunks = struct.unpack_from("<%dQ" % -(-height // 16), data, at + 1)
    out = numpy.zeros((height, len(names), width), dtype="<f4")
    for chunk in chunks:
        y, size = struct.unpack_from("<2i", data, chunk)
        packed, lines = data[chunk + 8:chunk + 8 + size], min(16, height - (y - y0))
        raw = packed
        if size < lines * len(names) * width * 4:  # differences, even bytes before odd ones
            d = numpy.frombuffer(zlib.decompress(packed), dtype=numpy.uint8).astype(numpy.int64)
            d[1:] -= 128
            d = (numpy.cumsum(d) & 255).astype(numpy.uint8)
            half = (len(d) + 1) // 2
            woven = numpy.empty_like(d)
            woven[0::2], woven[1::2] = d[:half], d[half:]
            raw = woven.tobytes()
        out[y - y0:y - y0 + lines] = numpy.frombuffer(raw, "<f4").reshape(lines, len(names), width)
    return {name: out[:, i].astype(float) for i, name in enumerate(names)}


def rgb(picture, layer=""):
    return numpy.stack([picture[layer + x] for x in "RGB"], -1)


def by_cycles(scene, seed, folder):
    scene.cycles.seed = seed
    scene.render.filepath = os.path.join(folder, "cycles.exr")
    bpy.ops.render.render(write_still=True)
    return read_exr(scene.render.filepath)


def by_diaphan(program, obj, case, seed, spp, folder):
    scattering, absorption = MEDIA[case["medium"]]
    material, picture = os.path.join(folder, "medium.json"), os.path.join(folder, "diaphan.exr")
    with open(material, "w") as out:
        json.dump({"scattering": scattering, "absorption": absorption, "anisotropy": case["g"],
                   "ior": 1.3}, out)
    p = repr(math.pi)
    command = [program, "render", obj, "-o", picture, "--method", "reference", "--material",
               material, "--size-mm", str(SIZE_MM), "--boundary", case["boundary"], "--camera",
               "%g,%g,%g" % CAMERA, "--fov", str(FOV), "--resolution", "%dx%d" % (PIXELS, PIXELS),
               "--spp", str(spp), "--seed", str(seed), "--json"]
    if case["source"] == "cap":
        surroundings = os.path.join(folder, "sky.hdr")
        write_sky(surroundings, case["light"])
        command += ["--env", surroundings]
    else:
        command += ["--light", ",".join([str(x) for x in LIGHTS[case["light"]]] + [p, p, p])]
    said = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    return read_exr(picture), said


def mean_and_error(values):
    values = numpy.array(values)
    return values.mean(0), values.std(0, ddof=1) / math.sqrt(len(values))


def run_case(program, case, mesh, obj, spp, seeds, folder):
    scene = set_scene(*mesh, case, spp)
    ours, theirs, said_error, lost, seconds = [], [], [], 0, [0, 0]
    for seed in range(1, seeds + 1):
        start = time.time()
        picture, said = by_diaphan(program, obj, case, seed, spp, folder)
        seconds[0] += time.time() - start
        start = time.time()
        other = by_cycles(scene, seed, folder)
        seconds[1] += time.time() - start
        mask, covered = picture["A"] > 0, picture["A"].sum()
        lost += said["lost"] + said["capped"]
        ours.append(rgb(picture).sum((0, 1)) / covered)
        said_error.append(rgb(picture, "variance.").sum((0, 1)) / covered ** 2)
        theirs.append(rgb(other)[mask].sum(0) / covered)
    a, da = mean_and_error(ours)
    b, db = mean_and_error(theirs)
    error = numpy.sqrt((da / a) ** 2 + (db / b) ** 2)
    return dict(case, spp=spp, seeds=seeds, lost=lost, seconds=seconds, diaphan=a.tolist(),
                diaphan_error=da.tolist(),
                diaphan_error_by_variance=numpy.sqrt(numpy.mean(said_error, 0) / seeds).tolist(),
                cycles=b.tolist(), cycles_error=db.tolist(),
                ratio=(a / b).tolist(), ratio_error=error.tolist())


def main():
    words = sys.argv[sys.argv.index("--") + 1:]
    program, result, meshes, only, spp, seeds = words[0], words[1], [], "", 64, 8
    bounces = 1024
    while len(words) > 2:
        value, name = words.pop(), words.pop()
        if name == "--mesh":
            meshes.insert(0, value)
        elif name == "--only":
            only = value
        elif name == "--spp":
            spp = int(value)
        elif name == "--seeds":
            seeds = int(value)
        elif name == "--bounces":
            bounces = int(value)
        else:
            raise SystemExit("peer_cycles.py: what is %s?" % name)
    cases = [{"mesh": mesh, "medium": medium, "g": g, "boundary": boundary, "source": source,
              "light": light, "bounces": bounces}
             for boundary, source in (("matched", "sun"), ("dielectric", "cap"),
                                      ("dielectric", "disc"))
             for mesh in ["sphere"] + meshes
             for medium in MEDIA for g in (0, .5) for light in LIGHTS
             if source != "disc" or "disc" in only]
    done = json.load(open(result)) if os.path.exists(result) else []
    with tempfile.TemporaryDirectory() as folder:
        for case in cases:
            name = os.path.splitext(os.path.basename(case["mesh"]))[0]
            case_name = " ".join([case["boundary"], case["source"], name, case["medium"],
                                  "g%g" % case["g"],
                                  case["light"]])
            if bounces < 1024:
                case_name += " %d bounces" % bounces
            if only not in case_name or any(x["case"] == case_name for x in done):
                continue
            mesh = sphere() if case["mesh"] == "sphere" else read_obj(case["mesh"])
            obj = os.path.join(folder, "mesh.obj")
            write_obj(obj, *mesh)
            row = run_case(program, case, mesh, obj, spp, seeds, folder)
            row["case"], row["mesh"] = case_name, name
            done.append(row)
            with open(result, "w") as out:
                json.dump(done, out, indent=1)
            print("RESULT %-40s" % case_name,
                  "  ".join("%.4f+-%.4f" % x for x in zip(row["ratio"], row["ratio_error"])),
                  " %.0f s, %.0f s" % tuple(row["seconds"]), "lost", row["lost"], flush=True)


main()
