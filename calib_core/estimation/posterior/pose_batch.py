"""Many poses as arrays, for code that handles them all at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.geometry import RigidTransform, rotation_exp


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Poses camera_from_radar as arrays.

    Attributes:
        rotations: (s, 3, 3).
        translations_m: (s, 3).
    """

    rotations: np.ndarray
    translations_m: np.ndarray

    def __len__(self) -> int:
        return len(self.rotations)

    def perturbed(self, errors: np.ndarray) -> "Poses":
        """Apply an error (s, 6) to each pose: t = t_hat + dt, R = Exp(dtheta) R_hat."""
        return Poses(rotation_exp(errors[:, 3:]) @ self.rotations, self.translations_m + errors[:, :3])

    def some(self, which: np.ndarray | slice) -> "Poses":
        """Keep the poses of the given indices."""
        return Poses(self.rotations[which], self.translations_m[which])

    def transform(self, index: int) -> RigidTransform:
        """Return one of them, re-orthonormalised."""
        u, _, vt = np.linalg.svd(self.rotations[index])
        return RigidTransform(u @ vt, self.translations_m[index])


def batch_of(transforms: Sequence[RigidTransform]) -> Poses:
    """Stack poses."""
    return Poses(np.array([one.rotation for one in transforms]), np.array([one.translation_m for one in transforms]))


def joined_poses(several: Sequence[Poses]) -> Poses:
    """Concatenate batches of poses."""
    return Poses(
        np.concatenate([one.rotations for one in several]), np.concatenate([one.translations_m for one in several])
    )
