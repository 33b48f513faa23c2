"""Gradients of small neural materials by PyTorch's automatic differentiation, for a test in crates/sbtf/src/train.

    python tools/reference/torch_gradients.py crates/sbtf/tests/data/torch_gradients.safetensors
    python tools/reference/torch_gradients.py --time

Needs torch and safetensors (CPU; versions in crates/sbtf/tests/data/README.md). Everything is in double precision and built from
PyTorch's own operations, so that nothing is shared with the code under test. The second form times a training step of
a 16-24-24-24-4 network (forward, backward, Adam) on one thread, and the networks of queries.

Three cases: `silhouette` (taps along the ray, L2 + 0.3 L1 on the dip), `direct` (the same on the opacity), `chain` (offset, then
colour at the moved texture coordinates; gamma deviance + 0.1 L1 on ln(1 + rgb), 0.5 L1 on the offset). Inputs that follow
from geometry (tap positions, azimuths, encoded curvatures) are recorded by the test's own sizes below as plain numbers:
the test feeds directions and curvatures and must arrive at the same gradients.
"""

import math
import sys
import time

import torch
from safetensors.torch import save_file

SAMPLES, DEPTH, LONGEST, KAPPA = 64, 0.15, 2.0, 2.5
OPACITY_TAPS, OFFSET_TAPS = [0.0, 0.4, 1.0], [0.0, 0.7]


def fetch(texture, uv):
    """Bilinear and repeated; texel centres at half-integers. texture: [height, width, channels], uv: [n, 2]."""
    height, width, _ = texture.shape
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    x0, y0 = torch.floor(x), torch.floor(y)
    fx, fy = (x - x0).unsqueeze(1), (y - y0).unsqueeze(1)
    column = [(x0.long() + i) % width for i in (0, 1)]
    row = [(y0.long() + i) % height for i in (0, 1)]
    below = texture[row[0], column[0]] * (1 - fx) + texture[row[0], column[1]] * fx
    above = texture[row[1], column[0]] * (1 - fx) + texture[row[1], column[1]] * fx
    return below * (1 - fy) + above * fy


def network(generator, sizes):
    """Weights and biases, layer by layer, in the range that He et al. give."""
    layers = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        spread = math.sqrt(6 / inputs)
        layers.append(spread * (2 * torch.rand(outputs, inputs, generator=generator) - 1))
        layers.append(0.2 * (2 * torch.rand(outputs, generator=generator) - 1))
    return [parameter(layer) for layer in layers]


def parameter(values):
    """A parameter that is exact in f32."""
    return values.float().double().requires_grad_()


def run(layers, x):
    for i in range(0, len(layers), 2):
        x = x @ layers[i].T + layers[i + 1]
        if i + 2 < len(layers):
            x = torch.relu(x)
    return x


def rays(generator):
    """Texture coordinates, directions with z >= 0, curvatures: exact in f32."""
    uv = 2 * torch.rand(SAMPLES, 2, generator=generator) - 1
    wo = torch.randn(SAMPLES, 3, generator=generator)
    wo = wo / wo.norm(dim=1, keepdim=True)
    wo[:, 2] = wo[:, 2].abs()
    kappa = 0.05 + (KAPPA - 0.05) * torch.rand(SAMPLES, generator=generator)
    return [values.float().double() for values in (uv, wo, kappa)]


def away(wo):
    return -wo[:, :2] / wo[:, :2].norm(dim=1, keepdim=True)


def encode(kappa):
    return torch.sqrt(kappa / KAPPA).unsqueeze(1)


def opacity(case, generator, out):
    uv, wo, kappa = rays(generator)
    texture = parameter(0.5 * (2 * torch.rand(5, 6, 4, generator=generator) - 1))
    layers = network(generator, [4 * 3 + 3, 7, 7, 7, 1])
    reach = torch.clamp(torch.acos(1 - kappa * DEPTH) / kappa, max=LONGEST)
    step = away(wo) * reach.unsqueeze(1)
    features = [fetch(texture, uv + fraction * step) for fraction in OPACITY_TAPS]
    shown = away(wo) if case == "silhouette" else wo[:, :2]
    output = run(layers, torch.cat(features + [shown, encode(kappa)], 1))[:, 0]
    if case == "silhouette":
        cosine = (0.6 * torch.rand(SAMPLES, generator=generator)).float().double()
        target = torch.clamp((1 - torch.sqrt(1 - cosine**2)) / (kappa * DEPTH), 0, 1)
        out["silhouette_cosine"] = cosine
    else:
        target = torch.rand(SAMPLES, generator=generator).float().double()
        out["alpha"] = target
    error = output - target
    error = torch.where((target <= 0) & (output < 0) | (target >= 1) & (output > 1), 0 * error, error)
    finish((error**2 + 0.3 * error.abs()).mean(), out, uv=uv, wo=wo, kappa=kappa, opacity=(texture, layers))


def chain(generator, out):
    uv, wo, kappa = rays(generator)
    wi = torch.randn(SAMPLES, 3, generator=generator)
    wi = (wi / wi.norm(dim=1, keepdim=True)).float().double()
    truth = (0.3 * (2 * torch.rand(SAMPLES, 2, generator=generator) - 1)).float().double()
    rgb = (3 * torch.rand(SAMPLES, 3, generator=generator)).float().double()
    offset_texture = parameter(0.5 * (2 * torch.rand(4, 5, 3, generator=generator) - 1))
    colour_texture = parameter(0.5 * (2 * torch.rand(6, 4, 8, generator=generator) - 1))
    offset_layers = network(generator, [3 * 2 + 3, 7, 7, 7, 2])
    colour_layers = network(generator, [8 + 6, 7, 7, 7, 3])
    cosine, sine = wo[:, 2], wo[:, :2].norm(dim=1)
    reach = torch.clamp(torch.clamp(DEPTH * sine / cosine, max=LONGEST), max=2 * cosine * sine / kappa)
    step = away(wo) * reach.unsqueeze(1)
    features = [fetch(offset_texture, uv + fraction * step) for fraction in OFFSET_TAPS]
    offset = run(offset_layers, torch.cat(features + [wo[:, :2], encode(kappa)], 1))
    inputs = [fetch(colour_texture, uv + offset), wi, wo[:, :2], encode(kappa)]
    error = run(colour_layers, torch.cat(inputs, 1)) - torch.log1p(rgb)
    colour = (2 * (error + torch.exp(-error) - 1) + 0.1 * error.abs()).mean(1)
    loss = (colour + 0.5 * (offset - truth).abs().sum(1)).mean()
    finish(
        loss, out, uv=uv, wo=wo, kappa=kappa, wi=wi, offset=truth, rgb=rgb,
        offset_module=(offset_texture, offset_layers), colour_module=(colour_texture, colour_layers),
    )


def finish(loss, out, **values):
    loss.backward()
    out["loss"] = loss.detach().reshape(1)
    for name, value in values.items():
        if isinstance(value, tuple):
            texture, layers = value
            out[f"{name}.texture"] = texture.detach()
            out[f"{name}.network"] = torch.cat([layer.detach().flatten() for layer in layers])
            out[f"{name}.texture_gradient"] = texture.grad
            out[f"{name}.network_gradient"] = torch.cat([layer.grad.flatten() for layer in layers])
        else:
            out[name] = value


def record(path):
    tensors = {}
    for seed, case in enumerate(["silhouette", "direct", "chain"]):
        generator, out = torch.Generator().manual_seed(seed), {}
        chain(generator, out) if case == "chain" else opacity(case, generator, out)
        tensors |= {f"{case}.{name}": value.float().contiguous() for name, value in out.items()}
    save_file(tensors, path)


def time_step():
    torch.set_num_threads(1)
    torch.set_default_dtype(torch.float32)
    sizes, samples = [16, 24, 24, 24, 4], 65_536
    layers = []
    for inputs, outputs in zip(sizes, sizes[1:]):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.ReLU()]
    model = torch.nn.Sequential(*layers[:-1])
    adam = torch.optim.Adam(model.parameters(), lr=1e-3)
    x, y = torch.randn(samples, sizes[0]), torch.randn(samples, sizes[-1])

    def step():
        adam.zero_grad()
        ((model(x) - y) ** 2).mean().backward()
        adam.step()

    for _ in range(5):
        step()
    seconds = []
    for _ in range(40):
        began = time.process_time()
        step()
        seconds.append(time.process_time() - began)
    seconds.sort()
    print(f"torch {torch.__version__}: {1e3 * seconds[20]:.1f} ms a step of CPU time (median of 40; fastest {1e3 * seconds[0]:.1f})")


def time_queries():
    """The three networks of a query, without textures, in the batch that suits PyTorch best."""
    forms = {"paper": [11, 11, 14], "taps": [83, 59, 14], "neumip": [10, 13]}
    outputs = {"paper": [1, 2, 3], "taps": [1, 1, 3], "neumip": [1, 3]}
    for name, inputs in forms.items():
        best = math.inf
        for samples in (1024, 4096, 16_384, 65_536):
            models = []
            for first, last in zip(inputs, outputs[name]):
                sizes = [first, 24, 24, 24, last]
                layers = []
                for a, b in zip(sizes, sizes[1:]):
                    layers += [torch.nn.Linear(a, b), torch.nn.ReLU()]
                models.append((torch.nn.Sequential(*layers[:-1]), torch.randn(samples, first)))
            seconds = []
            with torch.inference_mode():
                for _ in range(3 + (1 << 21) // samples):
                    began = time.process_time()
                    for model, x in models:
                        model(x)
                    seconds.append(time.process_time() - began)
            best = min(best, min(seconds[3:]) / samples)
        print(f"torch {torch.__version__}: {name}, networks alone {1e9 * best:.0f} ns a query of CPU time (fastest batch)")


if __name__ == "__main__":
    torch.set_default_dtype(torch.float64)
    if sys.argv[1] == "--time":
        time_step()
        time_queries()
    else:
        record(sys.argv[1])
