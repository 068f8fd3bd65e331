"""The scene file, and what is said when it has been edited."""

import mujoco
import pytest

from mjsim import ContactSettings, scene
from model import InputError, Parameters

P = Parameters.named("reference")


def test_file_opens_as_it_is_and_holds_the_reference() -> None:
    model = mujoco.MjModel.from_xml_path(str(scene.SCENE))
    built, mjcf = scene.build(P, ContactSettings())
    for name in ("body_mass", "body_inertia", "body_pos", "jnt_pos", "geom_size", "geom_pos", "pair_solref"):
        assert getattr(built, name) == pytest.approx(getattr(model, name)), name
        assert getattr(mujoco.MjModel.from_xml_string(mjcf), name) == pytest.approx(getattr(model, name)), name


@pytest.mark.parametrize("kind", [("pair", "B"), ("geom", "wall"), ("joint", "inward"), ("body", "tangent")])
def test_missing_element_is_named(kind, tmp_path) -> None:
    edited = tmp_path / "scene.xml"
    edited.write_text(scene.SCENE.read_text().replace(f'name="{kind[1]}"', f'name="{kind[1]}x"'))
    with pytest.raises(InputError, match=f"has no {kind[0]} named '{kind[1]}'"):
        scene.build(P, ContactSettings(), edited)


def test_unreadable_scene(tmp_path) -> None:
    with pytest.raises(InputError, match="cannot read the scene"):
        scene.build(P, ContactSettings(), tmp_path / "none.xml")
    (tmp_path / "broken.xml").write_text("<mujoco>")
    with pytest.raises(InputError, match="not a valid MJCF"):
        scene.build(P, ContactSettings(), tmp_path / "broken.xml")


def test_too_large_a_step_is_refused_with_the_largest() -> None:
    with pytest.raises(InputError, match=r"timestep = 0.005 s is too large .* at most 0.001 s"):
        ContactSettings(timestep=5e-3)
