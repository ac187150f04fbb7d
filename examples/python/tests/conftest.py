"""Scans that are simulated without the simulator: stems as vertical cylinders on smooth ground."""
import numpy as np
import pytest


def rigid(yaw_deg, shift):
    """A turn about the vertical and a shift, 4 x 4."""
    yaw = np.radians(yaw_deg)
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    matrix[:3, 3] = shift
    return matrix


def transformed(matrix, points):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def random_stems(count, extent, seed):
    """Stem positions with heights and radii, at least 1 m apart."""
    numbers = np.random.default_rng(seed)
    stems = np.zeros((0, 4))
    while len(stems) < count:
        x, y = numbers.uniform(-extent, extent, 2)
        if np.all(np.hypot(stems[:, 0] - x, stems[:, 1] - y) > 1):
            stems = np.vstack([stems, [x, y, height_of_ground(x, y), numbers.uniform(0.08, 0.2)]])
    return stems


def height_of_ground(x, y):
    return 0.4 * np.sin(0.15 * x) + 0.3 * np.cos(0.2 * y) - 1.5


def scan_of(stems, extent, seed):
    """Points on ground and stems, with a millimetre of noise."""
    numbers = np.random.default_rng(seed)
    ground = numbers.uniform(-extent, extent, (80000, 2))
    points = [np.column_stack([ground, height_of_ground(*ground.T)])]
    for x, y, z, radius in stems:
        angle, height = numbers.uniform(0, 2 * np.pi, 1500), numbers.uniform(0, 4, 1500)
        points.append(np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), z + height]))
    points = np.vstack(points)
    return points + numbers.normal(0, 0.001, points.shape)


@pytest.fixture(scope="session")
def stems():
    return random_stems(40, 14, seed=1)


@pytest.fixture(scope="session")
def true_transform():
    """target_from_source of both scans."""
    return rigid(35, [4, -7, 0.6])


@pytest.fixture(scope="session")
def scans(stems, true_transform):
    """Source and target: two scans of one plot, none with a scanner at its origin."""
    plot = [scan_of(stems, 16, seed) for seed in (2, 3)]
    return transformed(np.linalg.inv(true_transform), plot[0]), plot[1]
