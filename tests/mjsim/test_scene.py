"""The scene file."""

import mujoco
import pytest

from mjsim import ContactSettings, scene
from model import Parameters

P = Parameters.named("reference")


def test_file_opens_as_it_is_and_holds_the_reference() -> None:
    model = mujoco.MjModel.from_xml_path(str(scene.SCENE))
    built, mjcf = scene.build(P, ContactSettings())
    for name in ("body_mass", "body_inertia", "body_pos", "jnt_pos", "geom_size", "geom_pos", "pair_solref"):
        assert getattr(built, name) == pytest.approx(getattr(model, name)), name
        assert getattr(mujoco.MjModel.from_xml_string(mjcf), name) == pytest.approx(getattr(model, name)), name
