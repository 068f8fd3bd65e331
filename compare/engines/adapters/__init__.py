"""Physics engines with free bodies, a module each: they build and step scenes."""

KNOWN = {
    "dart": "dartpy 6.20.0",
    "drake": "drake 1.51.1",
    "mujoco_free": "mujoco 4.0.0",
    "mujoco_warp": "mujoco-warp 4.0.0",
    "newton": "newton 1.8.0",
    "pybullet": "pybullet 3.2.7",
    "rapier": "rapier3d 0.36.1",
    "sapien": "sapien 3.0.3",
}
"""Packages and versions with which they are known to work, also where one can't be imported."""
STUDIED = {"pybullet": "v1", "drake": "D+", "dart": "<3", "rapier": ">4", "sapien": "hH"}
"""Those that are asked of the study's claims: marks in figures, in best settings and as they come,
which is NAME-defaults."""
