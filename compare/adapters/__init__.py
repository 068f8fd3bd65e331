"""Physics engines with free bodies, a module each: they build and step the exact cases and the ball
in its vessel."""

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
"""Packages and versions with which they are known to work: here, so that it can be said where one
can't be imported."""
