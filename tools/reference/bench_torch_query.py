"""Nanoseconds a query of the three networks of a model in PyTorch on one thread, beside those of plain numpy.

    bench_torch_query.py MODEL.sbtf [--batch 16384] [--runs 30]

Networks alone, without texture fetches, as matrix products over a batch; the fastest of the runs, as in
`cargo bench -p osculate-sbtf --bench queries`, beside which it is to be read. Needs numpy and torch.
"""

import argparse
import os
import time

os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")  # before any library is loaded

import numpy as np
import torch

import sbtf_numpy


def networks(path):
    """For every module its layers as pairs of float32 arrays."""
    _, arrays = sbtf_numpy.read(path)
    modules = []
    for module in ("opacity", "offset", "colour"):
        layers = []
        while f"{module}.layers.{len(layers)}.weight" in arrays:
            name = f"{module}.layers.{len(layers)}"
            layers.append((arrays[name + ".weight"].astype(np.float32), arrays[name + ".bias"].astype(np.float32)))
        if layers:
            modules.append(layers)
    return modules


def fastest(call, runs):
    call()
    times = []
    for _ in range(runs):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("--batch", type=int, default=16384)
    parser.add_argument("--runs", type=int, default=30)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    modules = networks(arguments.model)
    random = np.random.default_rng(1)
    inputs = [random.standard_normal((arguments.batch, layers[0][0].shape[1]), dtype=np.float32) for layers in modules]

    def with_numpy():
        for x, layers in zip(inputs, modules):
            for k, (weight, bias) in enumerate(layers):
                x = (np.maximum(x, 0) if k else x) @ weight.T + bias

    tensors = [[(torch.from_numpy(w), torch.from_numpy(b)) for w, b in layers] for layers in modules]
    torch_inputs = [torch.from_numpy(x) for x in inputs]

    def with_torch():
        with torch.inference_mode():
            for x, layers in zip(torch_inputs, tensors):
                for k, (weight, bias) in enumerate(layers):
                    x = torch.nn.functional.linear(torch.relu(x) if k else x, weight, bias)

    products = sum(w.size for layers in modules for w, _ in layers)
    print(f"{products} multiplications a query, batches of {arguments.batch}, one thread")
    for name, call in (("torch " + torch.__version__, with_torch), ("numpy " + np.__version__, with_numpy)):
        print(f"{name}: {fastest(call, arguments.runs) / arguments.batch * 1e9:.1f} ns a query")


if __name__ == "__main__":
    main()
