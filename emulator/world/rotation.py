"""Rotation matrices, Euler angles and rotation vectors, vectorised over a first axis of length N.

A matrix R (N, 3, 3) maps board to world vectors. Euler angles (N, 3) are roll, pitch, yaw in degrees with
R = Rz(yaw) Ry(pitch) Rx(roll). A rotation vector (N, 3) is axis times angle in radians.
Source of the formulas: Diebel, "Representing Attitude" (2006), sections 5.4, 6.2 and 8.
"""

from __future__ import annotations

import numpy as np

from emulator.world.track import Array

GIMBAL_LOCK_COSINE = 1e-9  # of the pitch; below it roll and yaw turn about the same axis


def euler_to_matrix(euler_deg: Array) -> Array:
    """(N, 3) degrees -> (N, 3, 3)."""
    roll, pitch, yaw = np.radians(euler_deg).T
    sr, cr = np.sin(roll), np.cos(roll)
    sp, cp = np.sin(pitch), np.cos(pitch)
    sy, cy = np.sin(yaw), np.cos(yaw)
    matrix = np.empty((len(euler_deg), 3, 3))
    rows = (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )
    for i, row in enumerate(rows):
        for j, element in enumerate(row):
            matrix[:, i, j] = element
    return matrix


def matrix_to_euler(matrix: Array) -> Array:
    """(N, 3, 3) -> (N, 3) degrees: pitch within +-90, roll and yaw within +-180; roll 0 in gimbal lock."""
    cosine = np.hypot(matrix[:, 2, 1], matrix[:, 2, 2])
    locked = cosine < GIMBAL_LOCK_COSINE
    pitch = np.arctan2(-matrix[:, 2, 0], cosine)
    roll = np.where(locked, 0.0, np.arctan2(matrix[:, 2, 1], matrix[:, 2, 2]))
    yaw = np.where(
        locked,
        np.arctan2(-matrix[:, 0, 1], matrix[:, 1, 1]),
        np.arctan2(matrix[:, 1, 0], matrix[:, 0, 0]),
    )
    euler_deg: Array = np.degrees(np.stack((roll, pitch, yaw), axis=1))
    return euler_deg


def about(axis: Array, angle_rad: Array) -> Array:
    """Rotation by ``angle_rad`` (N,) about unit ``axis`` (3,) or (N, 3) -> (N, 3, 3) (Rodrigues' formula)."""
    x, y, z = axis.T
    sine, cosine = np.sin(angle_rad), np.cos(angle_rad)
    versine = 1.0 - cosine
    matrix = np.empty((len(angle_rad), 3, 3))
    matrix[:, 0, 0] = cosine + versine * x * x
    matrix[:, 1, 1] = cosine + versine * y * y
    matrix[:, 2, 2] = cosine + versine * z * z
    for row, column, third, component in ((0, 1, z, x * y), (1, 2, x, y * z), (2, 0, y, z * x)):
        matrix[:, row, column] = versine * component - sine * third
        matrix[:, column, row] = versine * component + sine * third
    return matrix


def axis_and_angle(matrix: Array) -> tuple[Array, Array]:
    """(N, 3, 3) -> unit axis (N, 3) and angle (N,) in 0..pi; at pi either sense, at 0 the axis X.

    The matrix 4 q q^T of the unit quaternion q is linear in R; its row with the largest diagonal is q without
    cancellation (Shepperd's method), also at half a turn, where the usual arccos of the trace fails.
    """
    products = np.empty((len(matrix), 4, 4))
    diagonal = np.einsum("nii->ni", matrix)
    trace = diagonal.sum(axis=1)
    products[:, 0, 0] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        products[:, 1 + i, 1 + i] = 1.0 + 2.0 * diagonal[:, i] - trace
        products[:, 0, 1 + k] = products[:, 1 + k, 0] = matrix[:, j, i] - matrix[:, i, j]
        products[:, 1 + i, 1 + j] = products[:, 1 + j, 1 + i] = matrix[:, j, i] + matrix[:, i, j]
    largest = np.einsum("nii->ni", products).argmax(axis=1)
    quaternion = products[np.arange(len(matrix)), largest]
    quaternion *= np.where(quaternion[:, :1] < 0.0, -1.0, 1.0)  # the shorter way round
    sine = np.sqrt((quaternion[:, 1:] ** 2).sum(axis=1))
    angle = 2.0 * np.arctan2(sine, quaternion[:, 0])
    still = sine == 0.0
    axis = quaternion[:, 1:] / np.where(still, 1.0, sine)[:, np.newaxis]
    axis[still] = (1.0, 0.0, 0.0)
    return axis, angle


def to_board(matrix: Array, vector: Array) -> Array:
    """World ``vector`` (N, 3) in board axes, R^T v; a first axis of length 1 serves for all N."""
    seen: Array = np.einsum("nji,nj->ni", matrix, vector)
    return seen
