"""Prints FLIP between the two pictures of the metric's own test, by the authors' implementation.

    pip install flip-evaluator==1.7 numpy && python tools/reference/flip_values.py

The pictures are made by the same formulas in crates/render/src/metrics/flip.rs.
"""

import flip_evaluator
import numpy as np

WIDTH, HEIGHT = 48, 32


def pictures():
    """A ramp with a disk; and the same shifted, with a tint and a thin line."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    disk = ((x - 20) ** 2 + (y - 14) ** 2 < 64).astype(np.float32)
    reference = np.stack([x / WIDTH, 0.2 + 0.6 * disk, y / HEIGHT], axis=-1)
    disk = ((x - 22) ** 2 + (y - 14) ** 2 < 64).astype(np.float32)
    line = (x == 40).astype(np.float32)
    test = np.stack([x / WIDTH, 0.2 + 0.6 * disk + 0.3 * line, 0.9 * y / HEIGHT], axis=-1)
    return reference.astype(np.float32), test.astype(np.float32)


reference, test = pictures()
values, mean, _ = flip_evaluator.evaluate(reference, test, "LDR", applyMagma=False)
print("mean", mean)
for row, column in [(14, 12), (14, 29), (5, 40), (30, 3)]:
    print((column, row), values[row, column].ravel()[0])
