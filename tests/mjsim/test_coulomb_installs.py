"""The law says so where MuJoCo is another one than it knows, and needs no place for a cache."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import mujoco
import pytest

ROOT = Path(__file__).parents[2]
HOLDS = """
import mujoco
from mjsim import Coulomb
model = mujoco.MjModel.from_xml_string(
    '<mujoco><option tolerance="1e-12" gravity="2.5 0 -9.5"/><worldbody>'
    '<geom type="plane" size="9 9 1"/>'
    '<body pos="0 0 .05"><freejoint/><geom type="box" size=".05 .05 .05"/></body>'
    '</worldbody></mujoco>'
)
data, coulomb = mujoco.MjData(model), Coulomb(model)
coulomb.step(data, 1000)
place = data.qpos[0]
coulomb.step(data, 50)
with coulomb.installed():
    mujoco.mj_step(model, data, 50)
assert abs(data.qpos[0] - place) < 1e-12, data.qpos[0] - place
print("holds")
"""


def held(before: str) -> subprocess.CompletedProcess[str]:
    """A box on a slope is, in a Python of its own."""
    words = [sys.executable, "-c", before + HOLDS]
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True)


NAME = f"MuJoCo {mujoco.__version__}"
STRUCTS = "import mujoco.introspect.structs as s; d = s.STRUCTS['mjData']; d.fields = {}\n"


@pytest.mark.parametrize(
    ("before", "says"),
    [
        (
            STRUCTS.format("[f for f in d.fields if f.name != 'time']"),
            f"{NAME}.* has no time",
        ),
        (STRUCTS.format("d.fields[::-1]"), f"{NAME}.* doesn't lie in memory"),
        (STRUCTS.format("d.fields[1:]"), f"{NAME}.* doesn't lie in memory"),
        (
            "import mujoco; mujoco.__version__, mujoco.MjModel = '3.3.0', object\n",
            "needs MuJoCo 4.0, and this is 3.3",
        ),
    ],
)
def test_another_mujoco_is_named(before, says):
    done = held(before)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()[-1]) < 160
    assert re.search(says, done.stderr.splitlines()[-1])


@pytest.mark.slow  # it compiles
def test_compiled_loops_need_no_place_for_a_cache():
    before = (
        "from numba.core import caching\n"
        "for name in 'CacheImpl', '_CacheImpl', 'CompileResultCacheImpl':\n"
        "    vars(caching).get(name, type('', (), {}))._locator_classes = []\n"
    )
    done = held(before)
    assert done.stdout.strip() == "holds", done.stderr


def test_both_wheels_have_one_version():
    versions = [
        tomllib.loads((ROOT / folder / "pyproject.toml").read_text())["project"]["version"]
        for folder in (".", "mjsim/coulomb")
    ]
    assert versions[0] == versions[1]
