"""Displaced truth beside Mitsuba 3: the same materials on the same torus, rendered by both, compared within the noise.

    check_displaced.py [--osculate target/release/osculate] [--materials stone-1,wool-1,cave] [--side 96] [--spp 256]
                       [--seeds 4] [--elevation 35] [--tolerance 0.001] [--resolution 64] [--fineness 4] [--scale 1000] [--keep DIR]

    pip install mitsuba==3.9.1 numpy pillow; Mitsuba's llvm variants also need Debian's libllvm19

Only maps pass from one side to the other (`osculate micro --maps`): heights of 16 bits and albedo. Ours is a scene with
`as = "displaced"`. Mitsuba gets a torus of its own: the maps evaluated here, vertex by vertex, on the exact surface, with the exact normals of
the displaced surface and no triangle in common with ours. Both have a Lambert surface (`specular = 0`; the materials named here have no
metal), a constant sky and a sun, and as many bounces. Our pixel filter is a tent; Mitsuba's pictures are taken 8 times as fine with a box filter and
weighted by that tent, so that neither side divides by random weights.

On both sides a direction above the shading normal's horizon that goes into the triangle is lost. How often that happens depends on the angle
between triangle and shading normal, so also on how fine the triangles are: see --fineness. Mitsuba starts rays 9e-5 (1 + largest coordinate)
off the surface, which is much beside the microstructure: its scene is made larger, so that the 1 is nothing.

What is compared is luminance in blocks of 8 by 8 pixels: z = difference / deviation. Its mean square is 1 if both sides are right. Our
pixels are independent, so that a block's variance is the sum of its pixels' over the seeds; Mitsuba's are not, and it is the block's own over
four times as many seeds. `self` is the same figure between halves of one side's own seeds: it shows that the variance is judged rightly.
`--floor` is what two right renderers may differ by beside the noise, in percent of a block: their triangles differ, see --tolerance. Exit code 1 if the mean square is above 1 by
more than four of its own deviations. The last columns are seconds for the same number of samples, and rates, one thread each in one run.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image

import mitsuba_render

ROOT = Path(__file__).resolve().parents[2]
MAJOR, MINOR, TILES, TILE_SIZE = 1.0, 0.45, (6, 3), 1.0
SUN, IRRADIANCE, SKY = [-1.0, -1.5, -0.5], [2.4, 2.3, 2.1], [0.35, 0.38, 0.45]
BLOCK = 8
# Mitsuba's pixels along a side of ours.
FINER = 8
# Mitsuba's seeds for each of ours.
MORE = 4
# Surfaces that a path meets at most: ours counts vertices, Mitsuba edges from the camera.
SURFACES = 8


def camera(elevation):
    sine, cosine = math.sin(math.radians(elevation)), math.cos(math.radians(elevation))
    return {
        "origin": [0, 4 * sine, 4 * cosine],
        "target": [0, 0, 0],
        "fov_degrees": 2 * math.degrees(math.atan(0.40)),
    }


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return done.stdout


# ---- the maps and the torus made of them


def maps(program, name, resolution, folder):
    """(heights in [0, 1], linear albedo, depth in tiles, path of the .toml); rows go up with v."""
    recipe = folder / f"{name}.recipe.toml"
    recipe.write_text(f'builtin = "{name}"\nresolution = {resolution}\n')
    run(program, "micro", recipe, "--maps", folder / name)
    spec = folder / name / "material.toml"
    depth = next(float(line.split("=")[1]) for line in spec.read_text().splitlines() if line.startswith("depth"))
    heights = np.asarray(Image.open(folder / name / "height.png"), dtype=np.float64)[::-1] / 65535
    codes = np.asarray(Image.open(folder / name / "albedo.png").convert("RGB"), dtype=np.float64)[::-1] / 255
    albedo = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    metal = np.asarray(Image.open(folder / name / "metalness.png"))
    if metal.any():
        raise SystemExit(f"{name}: has metal, which is not Lambert")
    return heights, albedo, depth, spec


def bilinear(grid, u, v):
    """Values of a grid that repeats, texel centres at (i + 0.5) / n."""
    rows, columns = grid.shape[:2]
    x, y = u * columns - 0.5, v * rows - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - i, y - j
    if grid.ndim == 3:
        fx, fy = fx[..., None], fy[..., None]
    at = lambda di, dj: grid[(j + dj) % rows, (i + di) % columns]
    return (1 - fy) * ((1 - fx) * at(0, 0) + fx * at(1, 0)) + fy * ((1 - fx) * at(0, 1) + fx * at(1, 1))


def displaced_torus(heights, albedo, depth, fineness):
    """Positions, normals, colours and triangles, with `fineness` vertices a texel along u and v."""
    rows, columns = heights.shape
    z = depth * (heights - 1)
    # Central differences at texel centres, bilinear between: the normals that materials are defined with.
    slope_u = (np.roll(z, -1, 1) - np.roll(z, 1, 1)) * columns / 2
    slope_v = (np.roll(z, -1, 0) - np.roll(z, 1, 0)) * rows / 2
    nu, nv = TILES[0] * columns * fineness, TILES[1] * rows * fineness
    # Texel centres, where the bilinear surface has its kinks, are among the vertices.
    u = np.arange(nu) / (columns * fineness) + 0.5 / columns
    v = np.arange(nv) / (rows * fineness) + 0.5 / rows
    u, v = np.meshgrid(u, v)
    height = TILE_SIZE * bilinear(z, u, v)
    a, b = 2 * np.pi * u / TILES[0], 2 * np.pi * v / TILES[1]
    tube = MINOR + height
    ring = MAJOR + tube * np.cos(b)
    stack = lambda *xs: np.stack(np.broadcast_arrays(*xs), -1)
    position = stack(ring * np.sin(a), tube * np.sin(b), ring * np.cos(a))
    normal = stack(np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a))
    along_u = stack(np.cos(a), 0 * a, -np.sin(a))
    along_v = stack(-np.sin(b) * np.sin(a), np.cos(b), -np.sin(b) * np.cos(a))
    # Tiles per world length at this height.
    rate_u, rate_v = TILES[0] / (2 * np.pi * ring), TILES[1] / (2 * np.pi * tube)
    normal = normal - (TILE_SIZE * bilinear(slope_u, u, v) * rate_u)[..., None] * along_u
    normal = normal - (TILE_SIZE * bilinear(slope_v, u, v) * rate_v)[..., None] * along_v
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    index = np.arange(nu * nv).reshape(nv, nu)
    right, up, across = np.roll(index, -1, 1), np.roll(index, -1, 0), np.roll(np.roll(index, -1, 1), -1, 0)
    triangles = np.concatenate([stack(index, right, across).reshape(-1, 3), stack(index, across, up).reshape(-1, 3)])
    flat = lambda x: x.reshape(-1, 3).astype(np.float32)
    return flat(position), flat(normal), flat(bilinear(albedo, u, v)), triangles.astype(np.uint32)


# ---- both renderers


def ours(program, spec, args, folder):
    scene = folder / f"{spec.parent.name}.toml"
    c = camera(args.elevation)
    scene.write_text(f"""
[image]
width = {args.side}
height = {args.side}
[camera]
position = {c["origin"]}
target = {c["target"]}
fov_y = {c["fov_degrees"]}
[[mesh]]
shape = "torus:{MAJOR},{MINOR}"
material = "truth"
[material.truth]
micro = "{spec}"
as = "displaced"
specular = 0.0
tolerance = {args.tolerance}
tiles = {[float(t) for t in TILES]}
tile_size = {TILE_SIZE}
[[light]]
type = "directional"
direction = {SUN}
irradiance = {IRRADIANCE}
[environment]
radiance = {SKY}
""")
    images, seconds, rays = [], 0.0, 0
    for seed in range(args.seeds):
        path = folder / f"ours_{seed}.exr"
        command = [program, "render", scene, "-o", path, "--spp", args.spp, "--seed", seed + 1, "--threads", 1]
        report = json.loads(run(*command, "--quiet", "--json", "-"))["render"]
        images.append(read(path))
        seconds += report["tracing_seconds"]
        rays += report["counters"]["rays"] + report["counters"]["shadow_rays"]
    return np.array(images), seconds, rays


def read(path):
    import mitsuba as mi

    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))


def mitsuba(torus, args):
    """Pictures and the seconds for all of them, and million camera rays a second."""
    import drjit as dr
    import mitsuba as mi

    positions, normals, colours, triangles = torus
    positions = args.scale * positions
    mesh = mi.Mesh("torus", len(positions), len(triangles), has_vertex_normals=True, props=properties(mi))
    mesh.add_attribute("vertex_color", 3, colours.ravel())
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = positions.ravel()
    parameters["vertex_normals"] = normals.ravel()
    parameters["faces"] = triangles.ravel()
    parameters.update()
    lights = {"constant": SKY, "directional": {"direction": SUN, "irradiance": IRRADIANCE}}
    c = camera(args.elevation)
    look = mi.ScalarTransform4f().look_at(origin=[args.scale * x for x in c["origin"]], target=c["target"], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": FINER * args.side, "height": FINER * args.side, "pixel_format": "rgb"}
    film |= {"component_format": "float32", "filter": {"type": "box"}}
    sensor = {"type": "perspective", "to_world": look, "fov": c["fov_degrees"], "fov_axis": "y", "film": film}
    sensor["sampler"] = {"type": "independent"}
    scene = mi.load_dict({"type": "scene", "sensor": sensor, "mesh": mesh, **mitsuba_render.emitters(mi, lights, None)})

    def timed(integrator, seed):
        start = time.perf_counter()
        image = mi.render(scene, integrator=integrator, spp=args.spp // (MORE * FINER**2), seed=seed)
        dr.eval(image)
        dr.sync_thread()
        return tent(np.array(image)), time.perf_counter() - start

    path = mi.load_dict({"type": "path", "max_depth": SURFACES + 1, "rr_depth": 5})
    depth = mi.load_dict({"type": "depth"})
    # The first run compiles.
    timed(path, 1000), timed(depth, 1000)
    made = [timed(path, seed + 1) for seed in range(MORE * args.seeds)]
    rays = args.side**2 * args.spp / MORE / timed(depth, 1)[1]
    return np.array([image for image, _ in made]), sum(seconds for _, seconds in made), rays / 1e6


def tent(fine):
    """Pixels under a tent of two pixels' width from `FINER` times as many along each side."""
    offset = np.arange(-FINER, FINER) + 0.5
    weights = (1 - np.abs(offset) / FINER) / FINER
    half = FINER // 2
    for axis in (0, 1):
        padded = np.pad(fine, [(half, half) if a == axis else (0, 0) for a in range(3)], mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * FINER, axis)
        starts = [slice(None)] * 3
        starts[axis] = slice(None, None, FINER)
        fine = windows[tuple(starts)] @ weights
    return fine


def properties(mi):
    reflectance = {"type": "mesh_attribute", "name": "vertex_color"}
    mi.register_bsdf("facing_lambert", facing_lambert(mi))
    p = mi.Properties()
    p["bsdf"] = mi.load_dict({"type": "facing_lambert", "reflectance": reflectance})
    return p


def facing_lambert(mi):
    """Lambert around the shading normal, on the viewer's side of the triangle and bent until it just faces the viewer.

    Shading normals that face away from the viewer on triangles that do not have no right answer: Mitsuba's diffuse is black there, or
    with `twosided` lit from behind. Ours bends them to a cosine of 0.02, so this does.
    """
    import drjit as dr

    class FacingLambert(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)
            self.reflectance = props["reflectance"]
            self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide]
            self.m_flags = self.m_components[0]

        def normal(self, si):
            geometric = si.to_local(si.n)
            geometric = dr.select(dr.dot(geometric, si.wi) < 0, -geometric, geometric)
            smooth = mi.Vector3f(0, 0, dr.select(geometric.z < 0, mi.Float(-1), mi.Float(1)))
            cosine = dr.dot(smooth, si.wi)
            bent = dr.normalize(smooth + (0.02 - cosine) * si.wi)
            return dr.select(cosine < 0.02, bent, smooth)

        def sample(self, context, si, sample1, sample2, active):
            frame = mi.Frame3f(self.normal(si))
            local = mi.warp.square_to_cosine_hemisphere(sample2)
            result = mi.BSDFSample3f()
            result.wo = frame.to_world(local)
            result.pdf = mi.warp.square_to_cosine_hemisphere_pdf(local)
            result.eta = 1.0
            result.sampled_component = mi.UInt32(0)
            result.sampled_type = mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
            active &= result.pdf > 0
            return result, dr.select(active, self.reflectance.eval(si, active), mi.Spectrum(0))

        def eval_pdf(self, context, si, wo, active):
            cosine = dr.maximum(dr.dot(self.normal(si), wo), 0)
            density = cosine / dr.pi
            return self.reflectance.eval(si, active) * density, density

        def eval(self, context, si, wo, active):
            return self.eval_pdf(context, si, wo, active)[0]

        def pdf(self, context, si, wo, active):
            return self.eval_pdf(context, si, wo, active)[1]

    return FacingLambert


# ---- comparison


def blocks(image):
    """Sums of luminance over blocks."""
    y = image @ [0.2126, 0.7152, 0.0722]
    n = y.shape[-1] // BLOCK
    return y.reshape(*y.shape[:-2], n, BLOCK, n, BLOCK).sum((-3, -1))


def variance_of_independent(images):
    """Variance of the blocks of the mean of all images, from the pixels' over the images."""
    y = images @ [0.2126, 0.7152, 0.0722]
    pixel = y.var(0, ddof=1) / len(y)
    n = pixel.shape[0] // BLOCK
    return pixel.reshape(n, BLOCK, n, BLOCK).sum((1, 3))


def variance_of_blocks(images):
    """The same where pixels depend on each other; made larger so that z^2 has mean 1 in spite of the few images."""
    count = len(images)
    return blocks(images).var(0, ddof=1) / count * (count - 1) / (count - 3)


def compare(a, b, variances, floor):
    """(z per block, mean of a over mean of b - 1, deviation of that)."""
    mean_a, mean_b = blocks(a.mean(0)), blocks(b.mean(0))
    noise = variances[0](a) + variances[1](b)
    # Blocks of nothing but sky have rounding for noise.
    lit = noise > (1e-5 * mean_b) ** 2
    z = (mean_a - mean_b)[lit] / np.sqrt((noise + (floor * mean_b) ** 2)[lit])
    return z, mean_a.sum() / mean_b.sum() - 1, math.sqrt(noise.sum()) / mean_b.sum()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--osculate", type=Path, default=ROOT / "target/release/osculate")
    parser.add_argument("--materials", default="stone-1,wool-1,cave")
    parser.add_argument("--side", type=int, default=96)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--elevation", type=float, default=35)
    parser.add_argument("--tolerance", type=float, default=0.001, help="of our triangles, in depths")
    parser.add_argument("--resolution", type=int, default=64, help="texels of a tile")
    parser.add_argument("--fineness", type=int, default=4, help="Mitsuba's vertices per texel along u and v")
    parser.add_argument("--scale", type=float, default=1000, help="of Mitsuba's scene")
    parser.add_argument("--floor", type=float, default=0.0, help="percent that blocks may differ by beside the noise")
    parser.add_argument("--keep", type=Path, help="where pictures go")
    args = parser.parse_args()
    if args.seeds < 4 or args.seeds % 2 or args.side % BLOCK or args.spp % (MORE * FINER**2):
        raise SystemExit(f"an even number of seeds, four at least; pixels in blocks of {BLOCK}; samples in {MORE * FINER**2}s")
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    # Two threads, that building the hierarchy does not wait for ever, on one processor.
    dr.set_thread_count(2)
    mitsuba_render.bind(1)
    print("| material | mean, ours / Mitsuba - 1 | its noise | z, mean square | self, ours | self, Mitsuba | largest z "
          "| seconds, ours / Mitsuba | our Mray/s | Mitsuba's camera Mray/s |\n|" + "---|" * 10)
    failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = args.keep.resolve() if args.keep else Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        for material in args.materials.split(","):
            failed |= not check(material, args, folder)
    sys.exit(failed)


def check(material, args, folder):
    heights, albedo, depth, spec = maps(args.osculate, material, args.resolution, folder)
    a, our_seconds, our_rays = ours(args.osculate, spec, args, folder)
    b, their_seconds, their_rate = mitsuba(displaced_torus(heights, albedo, depth, args.fineness), args)
    kinds = (variance_of_independent, variance_of_blocks)
    z, ratio, noise = compare(a, b, kinds, args.floor / 100)
    own = [np.mean(compare(x[::2], x[1::2], (kind, kind), 0)[0] ** 2) for x, kind in zip((a, b), kinds)]
    square = np.mean(z**2)
    if args.keep:
        np.savez(folder / f"{material}.npz", ours=a, mitsuba=b)
    print(f"| {material} | {100 * ratio:+.4f} % | {100 * noise:.4f} % | {square:.3f} | {own[0]:.3f} | {own[1]:.3f} "
          f"| {np.abs(z).max():.2f} of {len(z)} | {our_seconds:.1f} / {their_seconds:.1f} "
          f"| {our_rays / our_seconds / 1e6:.2f} | {their_rate:.2f} |", flush=True)
    # The mean square of n normal z has variance 2 / n.
    return square < 1 + 4 * math.sqrt(2 / len(z))


if __name__ == "__main__":
    main()
