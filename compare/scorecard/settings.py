"""Ways of setting MuJoCo that are compared, and the names that they get from what they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

from compare.runs.engines import newcomer
from mjsim import ContactSettings

BASES: dict[str, Callable[[float], ContactSettings]] = {"ours": ContactSettings.at, "MuJoCo's defaults": newcomer}
"""Settings for a time step in s, beside which others are named."""


def name(settings: ContactSettings) -> str:
    """The base from which settings differ least, and in what they differ."""
    changes = {base: _changes(at(settings.timestep), settings) for base, at in BASES.items()}
    base = min(changes, key=lambda each: len(changes[each]))
    return ", ".join([base, *changes[base]])


def _changes(base: ContactSettings, settings: ContactSettings) -> list[str]:
    names = [f.name for f in fields(settings) if f.name != "timestep"]
    return [
        f"{each} {_text(getattr(settings, each))}" for each in names if getattr(settings, each) != getattr(base, each)
    ]


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return " ".join(_text(part) for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def ladder(step: float) -> list[ContactSettings]:
    """From what a newcomer writes to ours, each with one thing more than the one before."""
    return [
        replace(newcomer(step), cone="pyramidal", coordinates="free", wall="prism"),
        replace(newcomer(step), cone="pyramidal", coordinates="free"),
        replace(newcomer(step), coordinates="free"),
        newcomer(step),
        ContactSettings.at(step, memory=False, servo=0.0, order=1),
        ContactSettings.at(step, memory=False, order=1),
        ContactSettings.at(step, order=1),
        ContactSettings.at(step),
    ]


def rivals(step: float) -> list[ContactSettings]:
    """Settings whose error is compared with their cost."""
    return [
        ContactSettings.at(step),
        ContactSettings.at(step, order=1),
        ContactSettings.at(step, order=1, memory=False, servo=0.0),
        newcomer(step),
        ContactSettings.at(step, coordinates="free", memory=False, order=1),
    ]


def variants(step: float) -> list[ContactSettings]:
    """Other ways to set MuJoCo; a firmer impedance keeps the damping b_f h = 1 of the friction rows."""
    firm = {"solimp": 0.1, "solreffriction": 2 * step / 0.1}
    return [
        replace(newcomer(step), cone="pyramidal"),
        ContactSettings.at(step, **firm, cone="pyramidal", memory=False, order=1),
        ContactSettings.at(step, integrator="implicit"),
        ContactSettings.at(step, integrator="implicitfast"),
        ContactSettings.at(step, **firm, integrator="discrete"),
        ContactSettings.at(step, integrator="discrete"),
        ContactSettings.at(step, memory=False, noslip_iterations=10),
        ContactSettings.at(step, memory=False),
        ContactSettings.at(step),
    ]
